"""What the sensors of a record did to it, found in the record alone."""

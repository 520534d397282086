"""A user's own rig and records: the design report of a rig, and the sidecar of a record from the bench."""

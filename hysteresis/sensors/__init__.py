"""What a sensor adds to a record: values that are held, spikes, leaps, lost counts."""

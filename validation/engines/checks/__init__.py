"""The engines against each other on many rigs: evidence, which wheels are without."""

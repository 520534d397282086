"""The models of a joint against finer ones: evidence, which wheels are without."""

"""Records of the package's own making, with effects that the default model does not have."""

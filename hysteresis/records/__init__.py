"""Records: files, cycles, readings to leave out, samples that are held out, and metrics of loops."""

"""The smallest size of each effect that the tracer finds in nine cases of ten."""

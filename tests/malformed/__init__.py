"""Malformed files over all readers: ``python -m tests.malformed 1000 SEED``; a short run of it is a test."""

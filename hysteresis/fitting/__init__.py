"""Identification of a law on records: search, fit, uncertainty, and the choice between laws."""

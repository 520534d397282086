"""Mutation score: small faults are put into the code, and the tests are run to see whether they notice."""

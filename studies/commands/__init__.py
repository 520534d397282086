"""The command line: what a user types, and the work behind it."""

from studies.commands.cli import call, main

__all__ = ["call", "main"]

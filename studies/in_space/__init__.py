"""Rigs that bend in space: their runs, workspace and compensation as commands."""

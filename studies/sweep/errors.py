"""Errors of a study."""

from __future__ import annotations


class StudyError(ValueError):
    """A study that cannot be read or run; one line naming file, field, value and what was expected."""


class DiskFullError(StudyError):
    """No room on the disk for a result; everything stored before is kept."""


class LostError(StudyError):
    """Workers or a scheduler that no longer answer; everything stored before is kept."""

"""Words on a tube that jumps to another equilibrium."""

from __future__ import annotations

from hysteresis.records.record import Record

MOST_PLACES = 6
"""Most jumps whose drives are said."""


def jump_lines(record: Record) -> list[str]:
    """Say where the tube jumps; nothing where it does not."""
    if record.jump is None:
        return []
    at = record.drive[record.jump == 1]
    places = ", ".join(f"{drive:.4g}" for drive in at[:MOST_PLACES]) + (", ..." if at.size > MOST_PLACES else "")
    return [f"the tube jumps at {places} {record.drive_unit}: it snaps to another shape there"]

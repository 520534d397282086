"""What a caller gives for a record or a rig: itself, the path of its file, a DataFrame, or the name of a preset."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fem_models.rig import Rig, RigError, preset, read_rig
from fem_models.rig.presets import NAMES_IN_SPACE, PRESETS
from fem_models.rig.presets_in_space import any_preset
from fem_models.rig.rig import require_planar
from fem_models.rig.rig_file import read_any_rig
from hysteresis.messages import as_given, quoted
from hysteresis.records.frame import RecordLike, as_record, is_frame
from hysteresis.records.record import Record

_NAMES = (*PRESETS, *NAMES_IN_SPACE)
RigLike = Rig | Path | str
"""What a function that takes a rig takes: a rig, the path of its file (TOML), or the name of a preset."""


def as_records(what: RecordLike | Sequence[RecordLike], name: str = "records") -> list[Record]:
    """Give a list of records, of one or several.

    Raises
    ------
    RecordError
        A record that cannot be read, or none.
    TypeError
        Something else.
    """
    if isinstance(what, Record | str | Path) or is_frame(what) or not isinstance(what, Sequence):
        return [as_record(what, name)]
    return [as_record(one, f"{name}[{i}]") for i, one in enumerate(what)]


def as_rig(what: RigLike, name: str = "rig") -> Rig:
    """Give a rig of one plane as it is, read it from its file, or take that of a preset.

    Raises
    ------
    RigError
        A name that is neither of a preset nor of a file, a file that cannot be read, or a rig that bends in space.
    TypeError
        Something else.
    """
    if isinstance(what, str) and not _is_file(what):
        _require_preset(what, name)
        return preset(what)
    return read_rig(what) if isinstance(what, str | Path) else require_planar(as_any_rig(what, name))


def as_any_rig(what: RigLike, name: str = "rig") -> Rig:
    """Give a rig as :func:`as_rig`, also one that bends in space.

    Raises
    ------
    RigError, TypeError
        As :func:`as_rig`.
    """
    if isinstance(what, str) and not _is_file(what):
        _require_preset(what, name)
        return any_preset(what)
    if isinstance(what, str | Path):
        return read_any_rig(Path(what))
    if not isinstance(what, Rig):
        raise TypeError(f"{name} = {quoted(what, 40)}: expected a Rig, the path of a rig file, or the name of a preset")
    return what


def is_rig_name(what: object) -> bool:
    """Tell whether a text or path is of a rig, not of a record: a rig file or the name of a preset."""
    if isinstance(what, str) and what in _NAMES:
        return True
    return isinstance(what, str | Path) and Path(what).suffix.lower() == ".toml"


def _is_file(text: str) -> bool:
    return text.lower().endswith(".toml") or "/" in text or "\\" in text


def _require_preset(what: str, name: str) -> None:
    if what not in _NAMES:
        expected = f"expected a preset ({', '.join(_NAMES)}), or the path of a rig file, .toml"
        raise RigError(f"{name} = {as_given(what)}: {expected}")

"""Files of the page: the rig and the record that it saves, and measured records that are opened beside them.

The browser writes what is saved. What is opened comes as bytes, and goes into a folder that is removed at once, under
names of our own.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from fem_models.rig import Rig
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record, write_record
from hysteresis.records.sidecar import toml
from studies.results.files import file_stem

MOST_BYTES = 20_000_000
"""Largest file that is opened in the page: some 300,000 samples."""


def rig_text(rig: Rig) -> str:
    """Write a rig as a rig file, TOML."""
    one = rig.is_planar and rig.tendon_b is None
    return toml({"tendons": 1, **rig.to_dict()} if one else rig.to_dict())


def record_files(records: Mapping[str, Record], rig: Rig) -> bytes:
    """Write records, their sidecars and the rig that the sidecars name, as a ZIP file of one folder.

    ``records`` are given by the endings of their names.
    """
    stem = file_stem(rig.name)
    with TemporaryDirectory() as folder:
        rig_file = Path(folder) / f"{stem}-rig.toml"
        rig_file.write_text(rig_text(rig), encoding="utf-8")
        preload = {"preload_N": rig.preload_N} if rig.preload_N > 0 else {}
        for ending, record in records.items():
            named = replace(record, rig={"file": str(rig_file), **preload})
            write_record(named, Path(folder) / f"{stem}{ending}.csv")
        packed = io.BytesIO()
        with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as out:
            for path in sorted(Path(folder).iterdir()):
                out.write(path, f"{stem}/{path.name}")
    return packed.getvalue()


def opened_record(files: Sequence[Mapping[str, Any]]) -> Record:
    """Read a record that was chosen in the page: a CSV and, if it has one, its sidecar; ``name`` and ``content`` each.

    Raises
    ------
    RecordError
        Other files, files that are too large, or a record that cannot be shown; one line.
    """
    by_kind: dict[str, tuple[str, bytes]] = {}
    for file in files:
        name, content = str(file.get("name", "")), file.get("content")
        kind = Path(name).suffix.lower()
        if kind not in (".csv", ".toml") or kind in by_kind or not isinstance(content, bytes):
            raise RecordError(f"{name[:80]}: expected one record, CSV, and its sidecar, TOML, if it has one")
        if len(content) > MOST_BYTES:
            raise RecordError(f"{name[:80]}: {len(content)} bytes: expected at most {MOST_BYTES}")
        by_kind[kind] = name, content
    if ".csv" not in by_kind:
        raise RecordError("no CSV was chosen: expected a record, CSV")
    name = by_kind[".csv"][0][:80]
    with TemporaryDirectory() as folder:
        for kind, (_, content) in by_kind.items():
            (Path(folder) / f"record{kind}").write_bytes(content)
        path = Path(folder) / "record.csv"
        try:
            return shown(read_record(path), name)
        except RecordError as error:
            raise RecordError(str(error).replace(str(path.with_suffix("")), Path(name).stem)) from None


def shown(record: Record, name: str) -> Record:
    """Give the record if the page can show it beside a simulated one.

    Raises
    ------
    RecordError
        The unit of its drive is not mm.
    """
    if record.drive_unit != "mm":
        raise RecordError(f"{name}: drive in {record.drive_unit}: expected mm, the unit of the page")
    return record

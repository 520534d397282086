"""Good tables as strangers write them, of every kind that ``record new`` reads, which are then spoiled."""

from __future__ import annotations

import io
from functools import partial
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow
import pyarrow.parquet
import scipy.io

from malformed.samples import Reader

STRANGERS = Path(__file__).parents[1] / "records" / "strangers"
OPTIONS = {
    "tabs-without-names.tsv": ["--drive-column", "2", "--angle-column", "3"],
    "ros2-joint-states.csv": ["--drive-column", "/joint_states/position[0]", "--angle-column",
                              "/joint_states/position[1]", "--drive-unit", "mm", "--angle-unit", "rad"],
}  # fmt: skip
TEXTS = ("comments.csv", "cp1252.csv", "decimal-commas.csv", "decimal-commas-quoted.csv", "empty-angles.csv",
         "german-dates.csv", "iso.csv", "preamble-with-numbers.csv", "quoted-names-of-two-lines.csv",
         "ros2-joint-states.csv", "ros2-own-names.csv", "savetxt.txt", "semicolons-trailing.csv",
         "spaces-names-of-two-words.txt", "tabs-without-names.tsv", "thousands-commas.csv", "thousands-points.csv",
         "trials-restart.csv", "units-below-in-brackets.csv", "utf-16-bom.csv", "utf-16-without-bom.csv",
         "wrapped-360.csv")  # fmt: skip


def tables(folder: Path) -> list[Reader]:
    """Make the files, one in a folder, and give the reader of each."""
    drive = np.concatenate([np.linspace(0, 2, 9), np.linspace(2, -2, 17), np.linspace(-2, 2, 17)])
    values = {"t_s": 0.1 * np.arange(drive.size), "stage_um": 1e3 * drive, "tip_angle_rad": 0.3 * drive}
    contents = {name: (STRANGERS / name).read_bytes() for name in TEXTS}
    contents |= {"bench.xlsx": _workbook(values), "bench.parquet": _parquet(values), "bench.mat": _mat(values)}
    contents["packed.mat"] = _mat({"data": values}, packed=True)
    found = []
    for name, content in contents.items():
        at = folder / name.replace(".", "-")
        at.mkdir(parents=True)
        # texts in another encoding are spoiled by bytes alone
        kept = name if not name.endswith(".csv") or _is_utf8(content) else f"{name[:-4]}.txt"
        (at / kept).write_bytes(content)
        found.append(Reader(f"table {kept}", at, (kept,), partial(_new, kept, OPTIONS.get(name, []))))
    return found


def _new(name: str, options: list[str], at: Path) -> list[str]:
    return ["record", "new", str(at / name), *options, "--out", str(at / "new.csv"), "--quiet"]


def _is_utf8(content: bytes) -> bool:
    try:
        return "\0" not in content.decode()
    except UnicodeDecodeError:
        return False


def _workbook(values: dict[str, np.ndarray]) -> bytes:
    book, file = openpyxl.Workbook(), io.BytesIO()
    book.active.append(["Bench 3"])
    book.active.append(list(values))
    for row in zip(*(column.tolist() for column in values.values()), strict=True):
        book.active.append(row)
    book.create_sheet("notes").append(["held by hand"])
    book.save(file)
    return file.getvalue()


def _parquet(values: dict[str, np.ndarray]) -> bytes:
    file = io.BytesIO()
    more = {"note": ["a"] * len(values["t_s"]), "in": [{"x_mm": 1.0}] * len(values["t_s"])}
    pyarrow.parquet.write_table(pyarrow.table({**values, **more}), file)
    return file.getvalue()


def _mat(values: dict[str, object], packed: bool = False) -> bytes:
    file = io.BytesIO()
    scipy.io.savemat(file, values, do_compression=packed)
    return file.getvalue()

"""Which kind of file a table is in, by its first bytes, and how it is read."""

from __future__ import annotations

import re
from pathlib import Path

from hysteresis.files import RecordError, read_bytes
from studies.own_rig.tables.table import BenchTable
from studies.own_rig.tables.text import read_text_table

_OTHERS = (
    (b"\xd0\xcf\x11\xe0", "a spreadsheet of before 2007: expected it saved as .xlsx or CSV"),
    (b"MATLAB 7.3", "HDF5, as MATLAB 7.3 writes it: expected save('x.mat', '-v7'), or writetable to CSV"),
    (b"\x89HDF", "HDF5, as MATLAB 7.3 writes it: expected save('x.mat', '-v7'), or writetable to CSV"),
    (b"TDSm", "a LabVIEW TDMS file: expected its channels exported as CSV"),
    (b"SQLite format 3", "a database, as of a ROS 2 bag: expected its topics exported as CSV"),
    (b"\x89MCAP", "an MCAP log, as of a ROS 2 bag: expected its topics exported as CSV"),
    (b"#ROSBAG", "a ROS 1 bag: expected its topics exported as CSV (rostopic echo -p)"),
    (b"\x1f\x8b", "compressed: expected it unpacked (gunzip)"),
    (b"BZh", "compressed: expected it unpacked (bunzip2)"),
    (b"\xfd7zXZ", "compressed: expected it unpacked (unxz)"),
    (b"\x80\x04\x95", "a pickle of Python: expected a CSV or parquet (DataFrame.to_csv)"),
    (b"\x80\x05\x95", "a pickle of Python: expected a CSV or parquet (DataFrame.to_csv)"),
    (b"7z\xbc\xaf", "compressed: expected it unpacked"),
    (b"\x93NUMPY", "an array of NumPy: expected a CSV (numpy.savetxt)"),
    (b"ARROW1", "a Feather file: expected parquet or CSV"),
    (b"%PDF", "a PDF: expected a table"),
    (b"\x89PNG", "a picture: expected a table"),
)
"""First bytes of files that are not read, and what to do."""
_TEXTS = (
    (rb"<(\?xml|!|html|table|meta)", "XML or a page of the web: expected a table, saved as .xlsx or CSV"),
    (rb"\[?\s*\{\s*\"", "JSON: expected a CSV (pandas.read_json and DataFrame.to_csv make one)"),
)
"""How texts begin that are no tables, and what to do."""


def read_table(path: Path, *, encoding: str | None = None, sheet: str | None = None) -> BenchTable:
    """Read a table: text (CSV and its kin), ``.xlsx``, ``.parquet``, or ``.mat`` up to version 7.

    Parameters
    ----------
    encoding
        Of a text; by default UTF-8, UTF-16 or cp1252, by what its bytes say.
    sheet
        Of a spreadsheet: the name or the number, from 1, of the sheet; by default the one with a table.

    Raises
    ------
    RecordError
        One line with the file, its place and what was expected.
    MissingError
        A library that the kind of file needs and that is not installed.
    """
    content = read_bytes(path, "a table")
    for first, words in _OTHERS:
        if content.startswith(first):
            raise RecordError(f"{path}: {words}")
    begin = content[:200].removeprefix(b"\xef\xbb\xbf").lstrip()
    for first, words in _TEXTS:
        if re.match(first, begin, re.IGNORECASE):
            raise RecordError(f"{path}: {words}")
    if content.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        from studies.own_rig.tables.spreadsheet import read_spreadsheet

        return read_spreadsheet(path, content, sheet)
    if sheet is not None:
        raise RecordError(f"{path}: --sheet: this is no spreadsheet: expected no --sheet")
    kind = "parquet" if content.startswith(b"PAR1") else "mat" if _is_mat(path, content) else None
    if kind is not None:
        from studies.own_rig.tables.arrays import read_arrays

        return read_arrays(path, kind)
    return read_text_table(path, content, encoding)


def _is_mat(path: Path, content: bytes) -> bool:
    return content.startswith(b"MATLAB 5.0") or path.suffix.lower() == ".mat"

"""Ways to spoil a file: bytes, numbers, names, structure, and what stands in the place of the file."""

from __future__ import annotations

import json
import os
import random
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

NUMBERS = (
    "1e308", "-1e308", "1e-308", "1e15", "-1", "0", "0.0", "-0.0", "nan", "inf", "-inf", "1000000000", "2.5", "true",
    "9" * 400, "9" * 5000, "0x" + "f" * 6000, "1." + "1" * 200, '"text"', "[]", "{}", "[[[[1]]]]", "null", "1e", "--1",
    "1979-05-27", "9223372036854775808",
)  # fmt: skip
NAMES = (
    "", ".", "..", "../../../../../../etc/passwd", "/etc/passwd", "/dev/zero", "a\\u0000b", "x" * 5000, "{{7*7}}",
    "<img src=x onerror=alert(1)>", "angle_deg", "drive_mm", "loop.csv", "\\n\\n", "\\u202e", "nowhere.csv",
)  # fmt: skip
VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 2.5, 1e308, float("nan"), float("inf"), 10**400, "", "text", "../../../etc/passwd",
    "/etc/passwd", "a\0b", "\ud800", "x" * 5000, [], [[]], [1], {},
    {"a": {"a": {"a": {}}}}, [None] * 3, "{{7*7}}", "<script>",
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.\"])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_NAME = re.compile(r'"([^"\n]*)"')

Spoil = Callable[[Path, random.Random], None]


def spoil(path: Path, rng: random.Random) -> str:
    """Spoil a file in one of the ways; return its name."""
    ways = [*ANY, *(TEXT if path.suffix in (".toml", ".csv", ".json") else [])]
    if path.suffix == ".json":
        ways += [in_json] * 12
    if path.suffix == ".xlsx":
        ways += [in_archive] * 8
    if path.suffix in (".csv", ".txt", ".tsv"):
        ways += [a_cell, another_delimiter] * 2
    if path.suffix == ".toml":
        ways += [a_number, a_name, a_line, a_line, a_table] * 2
    way = rng.choice(ways)
    way(path, rng)
    return way.__name__.replace("_", " ")


def cut(path: Path, rng: random.Random) -> None:
    """Keep only the beginning."""
    content = path.read_bytes()
    path.write_bytes(content[: rng.randrange(len(content) + 1)])


def bytes_changed(path: Path, rng: random.Random) -> None:
    """Change some bytes."""
    content = bytearray(path.read_bytes())
    for _ in range(rng.choice((1, 3, 30))):
        if content:
            content[rng.randrange(len(content))] = rng.choice((0, 10, 13, 34, 44, 127, 255, rng.randrange(256)))
    path.write_bytes(bytes(content))


def a_part_twice(path: Path, rng: random.Random) -> None:
    """Repeat a part, or leave it out."""
    content = path.read_bytes()
    a, b = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    path.write_bytes(content[:b] + content[a:] if rng.random() < 0.5 else content[:a] + content[b:])


def another_encoding(path: Path, rng: random.Random) -> None:
    """UTF-16, a byte order mark, or line ends of another system."""
    content = path.read_bytes()
    text = content.decode("latin-1")
    path.write_bytes(rng.choice((text.encode("utf-16"), b"\xef\xbb\xbf" * 2 + content, content.replace(b"\n", b"\r"))))


def another_thing(path: Path, rng: random.Random) -> None:
    """Nothing, a folder, a fifo, a link that leads nowhere, in a circle or to a device, or a huge file."""
    path.unlink()
    kind = rng.randrange(8)
    if kind == 1:
        path.mkdir()
    elif kind == 2:
        os.mkfifo(path)
    elif kind == 3:
        path.symlink_to(path.parent / "nowhere")
    elif kind == 4:
        path.symlink_to(path)
    elif kind == 5:
        path.symlink_to("/dev/zero")
    elif kind == 6:
        path.touch()
        os.truncate(path, 2**34)
    elif kind == 7:
        path.touch()


def a_number(path: Path, rng: random.Random) -> None:
    """Put a number out of place into a text."""
    _replace(path, rng, _NUMBER, rng.choice(NUMBERS))


def a_name(path: Path, rng: random.Random) -> None:
    """Put a name out of place into a text."""
    _replace(path, rng, _NAME, f'"{rng.choice(NAMES)}"')


def a_line(path: Path, rng: random.Random) -> None:
    """Leave out a line, repeat it, exchange it with another, or make it long or deep."""
    lines = path.read_text(encoding="utf-8").split("\n")
    i, j, way = rng.randrange(len(lines)), rng.randrange(len(lines)), rng.randrange(6)
    match way:
        case 0:
            del lines[i]
        case 1:
            lines.insert(j, lines[i])
        case 2:
            lines[i], lines[j] = lines[j], lines[i]
        case 3:
            lines[i] += "," * rng.choice((1, 5000))
        case 4:
            lines[i] = "a = " + "[" * 50_000
        case 5:
            lines[i] = "a." * 50_000 + "a = 1"
    path.write_text("\n".join(lines), encoding="utf-8")


def a_table(path: Path, rng: random.Random) -> None:
    """Put a value in the place of a table, or a table in the place of a value."""
    text = path.read_text(encoding="utf-8")
    if rng.random() < 0.5:
        headers = re.findall(r"^\[([\w]+)\]", text, flags=re.MULTILINE)
        if headers:
            name = rng.choice(headers)
            text = re.sub(rf"^\[{name}\]\n(?:[^\[].*\n)*", f"[{name}]\n", text, flags=re.MULTILINE)
            if rng.random() < 0.5:
                text = f"{name} = {rng.choice(NUMBERS)}\n" + text.replace(f"[{name}]\n", "")
    else:
        text = re.sub(r"^(\w+) = .*$", r"\1 = { a = 1 }", text, count=rng.randrange(1, 5), flags=re.MULTILINE)
    path.write_text(text, encoding="utf-8")


def in_json(path: Path, rng: random.Random) -> None:
    """Replace a value at some place of a JSON file, or leave it out."""
    values = json.loads(path.read_text(encoding="utf-8"))
    inner = values
    while True:
        keys = list(inner) if isinstance(inner, dict) else list(range(len(inner)))
        key = rng.choice(keys)
        if not isinstance(inner[key], dict | list) or not inner[key] or rng.random() < 0.25:
            break
        inner = inner[key]
    if rng.random() < 0.3:
        del inner[key]
    else:
        inner[key] = rng.choice(VALUES)
    path.write_text(json.dumps(values), encoding="utf-8")


def in_archive(path: Path, rng: random.Random) -> None:
    """Change bytes, numbers or a name of one member of an archive, or leave it out."""
    with zipfile.ZipFile(path) as archive:
        members = {one: archive.read(one) for one in archive.namelist()}
    name = rng.choice(list(members))
    content = bytearray(members.pop(name))
    way = rng.randrange(4)
    if way == 1 and content:
        for _ in range(rng.choice((1, 3, 30))):
            content[rng.randrange(len(content))] = rng.choice((0, 10, 34, 60, 62, 255, rng.randrange(256)))
    elif way == 2:
        numbers = [*re.finditer(rb"\d+(?:\.\d+)?", content)]
        if numbers:
            one = rng.choice(numbers)
            content[one.start() : one.end()] = rng.choice(NUMBERS).encode()
    elif way == 3:
        names = [*re.finditer(rb"[A-Za-z]{2,}", content)]
        if names:
            one = rng.choice(names)
            content[one.start() : one.end()] = rng.choice((b"", b"a" * 5000, b"ZZ99999999", b"XFD1048577", b"&a;"))
    if way:
        members[name] = bytes(content)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for one, inner in members.items():
            archive.writestr(one, inner)


CELLS = (
    "", "nan", "#N/A", "1,5", "1.234,5", "1,234.5", "1e400", "12:61:99", "2026-13-45T99:99:99", "31.02.2026 10:00:00",
    "23:59:59.999", '"', '""', '"a', "-", "--", "9" * 200, "x" * 5000, "\0", "٣", "１２", "1_000", "1 000", "0x10",
    "inf", "1D+400", "1D", "−5", "é", "sep=;", "360", "-180", "99:99.9", "1:2:3:4", "May 5", "+", ".", ",", "1.2.3",
)  # fmt: skip


def a_cell(path: Path, rng: random.Random) -> None:
    """Put something else into a cell, or into a column of them, of a table as text."""
    text = path.read_bytes().decode("latin-1")
    delimiter = next((one for one in ("\t", ";", ",") if one in text), " ")
    lines = text.split("\n")
    k = rng.randrange(8)
    for i in [rng.randrange(len(lines))] if rng.random() < 0.7 else range(rng.randrange(3), len(lines)):
        cells = lines[i].split(delimiter)
        if k < len(cells):
            cells[k] = rng.choice(CELLS)
            lines[i] = delimiter.join(cells)
    path.write_bytes("\n".join(lines).encode("utf-8"))


def another_delimiter(path: Path, rng: random.Random) -> None:
    """Put other marks between the fields, of all lines or of some."""
    text = path.read_bytes().decode("latin-1")
    old, new = (rng.choice((",", ";", "\t", "|", " ", "  ", ".", '"', ":")) for _ in range(2))
    lines = [line.replace(old, new) if rng.random() < 0.8 else line for line in text.split("\n")]
    path.write_bytes("\n".join(lines if rng.random() < 0.5 else [text.replace(old, new)]).encode("latin-1"))


def _replace(path: Path, rng: random.Random, pattern: re.Pattern[str], by: str) -> None:
    text = path.read_text(encoding="utf-8")
    found = [*pattern.finditer(text)]
    if found:
        one = rng.choice(found)
        text = text[: one.start()] + by + text[one.end() :]
    path.write_text(text, encoding="utf-8")


ANY: list[Spoil] = [cut, bytes_changed, a_part_twice, another_encoding, another_thing]
TEXT: list[Spoil] = [a_number, a_number, a_name, a_line]

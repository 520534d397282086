"""The cases as files, and the sealed answers beside them.

``DIR/benchmark.json`` lists the cases and has the checksum of the file of answers, so that anyone can see later that
those were not changed. The file of answers has a checksum of every file of the cases: a changed case is refused.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hysteresis.files import read_json, write_files
from hysteresis.messages import quoted
from hysteresis.plain import from_plain, to_plain
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import write_record
from validation.practice.benchmark.sources import Drawn

LIST = "benchmark.json"
DRIVE_DIGITS, ANGLE_DIGITS, TIME_DIGITS = 5, 5, 6
"""Decimals of all records alike, so that digits do not tell what was computed."""


@dataclass(frozen=True)
class SealedCase:
    """Truth of a case, and the checksums (SHA-256) of its files; the other fields are those of :class:`Drawn`.

    ``control`` is the name of the case with the untouched records.
    """

    name: str
    source: str
    label: str
    effects: tuple[str, ...]
    counts: bool
    outside: bool
    describes: tuple[str, ...]
    size: float | None
    noise_deg: float
    rig: str
    control: str | None
    sha256: Mapping[str, str]


@dataclass(frozen=True)
class SealedAnswers:
    """What the file of answers holds."""

    schema: int
    seed: int
    cases: tuple[SealedCase, ...]


@dataclass(frozen=True)
class CaseList:
    """What ``benchmark.json`` holds: names of the cases, and the checksum of the file of answers."""

    schema: int
    cases: tuple[str, ...]
    answers_sha256: str


def write_cases(drawn: Sequence[Drawn], seed: int, folder: Path, answers: Path) -> SealedAnswers:
    """Write cases into ``folder/case-001`` and so on, in an order by chance, and the answers into another place.

    Titles, names, digits and file times are the same for all.

    Raises
    ------
    RecordError
        A folder that has cases already or cannot be written to, or answers inside it.
    """
    require_apart(folder, answers)
    order = np.random.default_rng((seed, len(drawn))).permutation(len(drawn))
    shuffled = [drawn[int(index)] for index in order]
    names = [f"case-{number + 1:03d}" for number in range(len(shuffled))]
    controls = {one.control_of: name for one, name in zip(shuffled, names, strict=True) if not one.counts}
    cases = []
    for one, name in zip(shuffled, names, strict=True):
        paths = _write_case(one, folder / name)
        cases.append(_sealed(one, name, controls, checksums(paths, folder)))
    sealed = SealedAnswers(1, seed, tuple(cases))
    text = json.dumps(to_plain(sealed), indent=1) + "\n"
    write_files({answers: text})
    listed = CaseList(1, tuple(names), hashlib.sha256(text.encode()).hexdigest())
    write_files({folder / LIST: json.dumps(to_plain(listed), indent=1) + "\n"})
    moment = (folder / LIST).stat().st_mtime_ns
    for path in sorted(folder.rglob("*")):
        os.utime(path, ns=(moment, moment))
    return sealed


def require_apart(folder: Path, answers: Path) -> None:
    """Refuse answers among the cases, and a folder that has cases.

    Raises
    ------
    RecordError
        One line with the path.
    """
    if answers.resolve().is_relative_to(folder.resolve()):
        raise RecordError(f"{answers}: inside {folder}: expected the answers apart from the cases")
    if (folder / LIST).exists():
        raise RecordError(f"{folder / LIST}: exists: expected a folder without cases")
    if answers.exists():
        raise RecordError(f"{answers}: exists: expected another name for the answers")


def _write_case(one: Drawn, folder: Path) -> list[Path]:
    paths = []
    for number, record in enumerate(one.records, start=1):
        path = folder / f"record-{number}.csv"
        path.parent.mkdir(parents=True, exist_ok=True)
        write_record(blind(record, f"Benchmark {folder.name}, record {number} of {len(one.records)}"), path)
        paths += [path, path.with_suffix(".toml")]
    return paths


def blind(record: Record, title: str) -> Record:
    """Record with a title that tells nothing, and with the digits of all."""
    time = record.time_s
    return replace(
        record,
        title=title,
        drive=np.round(record.drive, DRIVE_DIGITS),
        angle_deg=np.round(record.angle_deg, ANGLE_DIGITS),
        time_s=None if time is None else np.round(time - time[0], TIME_DIGITS),
    )


def checksums(paths: Sequence[Path], folder: Path) -> dict[str, str]:
    """SHA-256 of files by their path from a folder."""
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def _sealed(one: Drawn, name: str, controls: Mapping[str, str], sha256: Mapping[str, str]) -> SealedCase:
    return SealedCase(
        name=name,
        source=one.source,
        label=one.label,
        effects=one.effects,
        counts=one.counts,
        outside=one.outside,
        describes=one.describes,
        size=one.size,
        noise_deg=one.noise_deg,
        rig=one.rig,
        control=controls.get(one.control_of) if one.counts and one.control_of else None,
        sha256=sha256,
    )


def read_list(folder: Path) -> CaseList:
    """Read the list of cases of a folder.

    Raises
    ------
    RecordError
        A folder without it, or one that is malformed.
    """
    path = folder / LIST
    return from_plain(CaseList, _json(path, "the list of a benchmark, as export writes it"), str(path))


def read_sealed(folder: Path, answers: Path) -> SealedAnswers:
    """Read the answers of a folder of cases, and check that neither has changed.

    Raises
    ------
    RecordError
        One line with the file: answers of other cases, or a case that was changed or is missing.
    """
    listed = read_list(folder)
    values = _json(answers, "the answers that export wrote")
    found = hashlib.sha256(answers.read_bytes()).hexdigest()
    if found != listed.answers_sha256:
        raise RecordError(f"{answers}: SHA-256 {found[:12]}...: expected {listed.answers_sha256[:12]}..., as in {LIST}")
    sealed = from_plain(SealedAnswers, values, str(answers))
    for case in sealed.cases:
        for name, expected in case.sha256.items():
            path = folder / name
            if not path.is_file():
                raise RecordError(f"{path}: missing: expected the record of {case.name}")
            if (now := hashlib.sha256(path.read_bytes()).hexdigest()) != expected:
                raise RecordError(f"{path}: SHA-256 {now[:12]}...: expected {expected[:12]}...: the case was changed")
    return sealed


def records_of(folder: Path, name: str) -> list[Path]:
    """CSV files of a case, in their order."""
    paths = sorted((folder / name).glob("record-*.csv"), key=lambda path: int(path.stem.partition("-")[2]))
    if not paths:
        raise RecordError(f"{folder / name}: no records: expected record-1.csv")
    return paths


def _json(path: Path, expected: str) -> dict[str, object]:
    values = read_json(path, expected)
    if not isinstance(values, dict):
        raise RecordError(f"{path}: {quoted(values)}: expected {expected}")
    return values

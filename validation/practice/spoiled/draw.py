"""Draw spoiled practice cases, of either generator, and write them.

    python -m validation.practice.spoiled.draw --seed 7 --kind known --generator own --count 2 --out DIR

What a sensor or a protocol spoils is the case of :mod:`validation.practice.draw` (``own``) or of
:mod:`validation.practice.lumped` before its noise. It is clean, or has an effect of moderate size.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Literal

import numpy as np
from rich.progress import track

from hysteresis.records.record import Record
from validation.practice.cases import write_case
from validation.practice.draw import CLEAN, Case, Noiseless, draw_noiseless, with_white_noise
from validation.practice.draw import LABELS as OWN_LABELS
from validation.practice.lumped.cases import LABELS as LUMPED_LABELS
from validation.practice.lumped.cases import draw_lumped_case, draw_lumped_noiseless
from validation.practice.lumped.outside import LUMPED_OUTSIDE, draw_lumped_outside
from validation.practice.planned import PlanChange
from validation.practice.protocols import KINDS, Kind
from validation.practice.series.cases import draw_series_case
from validation.practice.series.effects import SERIES_LABELS, UNDECLARED
from validation.practice.spoiled.plans import PLANS
from validation.practice.spoiled.sensors import SENSORS, Sensor

Generator = Literal["own", "lumped"]
GENERATORS: tuple[Generator, ...] = ("own", "lumped")
Source = Literal["own", "lumped", "series", "sensors", "protocols"]
SOURCES: Mapping[Source, tuple[str, ...]] = {
    "own": OWN_LABELS,
    "lumped": (*LUMPED_LABELS, *LUMPED_OUTSIDE),
    "series": SERIES_LABELS,
    "sensors": tuple(SENSORS),
    "protocols": tuple(PLANS),
}
"""Where scored cases come from, and their labels: effects, or what spoils a clean case."""


@dataclass(frozen=True)
class Asked:
    """Which case is drawn before it is spoiled; the fields are arguments of :func:`draw_noiseless`."""

    seed: int
    kind: Kind
    number: int
    generator: Generator = "own"
    label: str = CLEAN


def draw_spoiled_sensor(asked: Asked, name: str) -> tuple[Case, Sensor]:
    """Draw a case that a sensor spoils, and the sensor; ``name`` is a key of :data:`SENSORS`.

    Raises
    ------
    SolverError, ValueError
        No draw has an effect of moderate size.
    """
    noiseless, _ = _noiseless(asked, None)
    rng = np.random.default_rng((asked.seed, zlib.crc32(name.encode()), asked.number))
    sensor = SENSORS[name](rng)
    noise = noiseless.truth.noise_deg
    records = tuple(
        as_logged(sensor.read(replace(record, angle_deg=record.angle_deg + zero), noise, rng))
        for record, zero in zip(noiseless.records, noiseless.zeros_deg, strict=True)
    )
    return Case(f"{name}-{noiseless.name}", records, noiseless.truth), sensor


def draw_spoiled_protocol(asked: Asked, name: str) -> Case:
    """Draw a case with a spoiled protocol; ``name`` is a key of :data:`PLANS`. Its noise is white.

    Raises
    ------
    SolverError, ValueError
        No draw has an effect of moderate size.
    """
    noiseless, rng = _noiseless(asked, PLANS[name])
    case = with_white_noise(noiseless, rng)
    return replace(case, name=f"{name}-{case.name}")


def _noiseless(asked: Asked, change: PlanChange | None) -> tuple[Noiseless, np.random.Generator]:
    draw = draw_noiseless if asked.generator == "own" else draw_lumped_noiseless
    return draw(asked.seed, asked.kind, asked.label, asked.number, change)


def draw_labelled(source: Source, seed: int, kind: Kind, label: str, number: int) -> tuple[Case, tuple[str, ...]]:
    """Draw a case of a source, and the effects that count neither way: they describe its sensor, or what is undeclared.

    Spoiled cases are clean; their generators take turns.

    Raises
    ------
    SolverError, ValueError
        No draw has an effect of moderate size.
    """
    if source == "own":
        noiseless, rng = draw_noiseless(seed, kind, label, number)
        return with_white_noise(noiseless, rng), ()
    if source == "lumped":
        draw = draw_lumped_outside if label in LUMPED_OUTSIDE else draw_lumped_case
        return draw(seed, kind, label, number), ()
    if source == "series":
        return draw_series_case(seed, kind, label, number), UNDECLARED
    asked = Asked(seed, kind, number, GENERATORS[number % 2])
    if source == "protocols":
        return draw_spoiled_protocol(asked, label), ()
    case, sensor = draw_spoiled_sensor(asked, label)
    return case, sensor.describes


def as_logged(record: Record) -> Record:
    """Record with the digits that a practice record is logged with: 0.1 um and 0.1 mdeg."""
    return replace(record, drive=np.round(record.drive, 4), angle_deg=np.round(record.angle_deg, 4))


def main(arguments: Sequence[str] | None = None) -> None:
    """Write clean cases, spoiled in each way, into ``DIR/WAY-clean-NUMBER``."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.spoiled.draw", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--kind", choices=KINDS, default="known", help="whether the sidecar describes the rig")
    parser.add_argument("--generator", choices=GENERATORS, default="own", help="what simulates the records")
    parser.add_argument("--count", type=int, default=2, help="cases of each way")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    options = parser.parse_args(arguments)
    for name, number in track([*product([*SENSORS, *PLANS], range(options.count))], description="cases"):
        asked = Asked(options.seed, options.kind, number, options.generator)
        case = draw_spoiled_sensor(asked, name)[0] if name in SENSORS else draw_spoiled_protocol(asked, name)
        write_case(case, options.out)


if __name__ == "__main__":
    main()

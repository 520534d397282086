"""Where the cases of the benchmark come from: six sources, each case with its truth.

``own`` is the generator whose engines the tracer fits, ``other`` the lumped rig, ``series`` the rigs in series.
``sensors`` and ``protocols`` spoil cases of the first two. ``real`` hides a change in measured records; its controls
are the same records untouched.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record, RecordError
from validation.practice.benchmark.sizes import size_of
from validation.practice.catalogue import ANGLE_ALONE, CATALOGUE
from validation.practice.draw import CLEAN, Case, draw_noiseless, with_white_noise
from validation.practice.hidden import HiddenCase
from validation.practice.hidden.draw import CONTROL, nth
from validation.practice.lumped.cases import LABELS, draw_lumped_noiseless
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.protocols import KINDS, Kind
from validation.practice.series.cases import draw_series_case
from validation.practice.series.effects import DOMINANT, UNDECLARED, labels_of
from validation.practice.spoiled.draw import GENERATORS, Asked, draw_spoiled_protocol, draw_spoiled_sensor
from validation.practice.spoiled.plans import PLANS
from validation.practice.spoiled.sensors import SENSORS

Rng = np.random.Generator

LEARNT = ("own", "other", "sensors", "protocols")
"""Sources that other ways may learn from."""
SIMULATED = (*LEARNT, "series")
REAL = "real"
SOURCES = (*SIMULATED, REAL)

SPOILED_EFFECTS = (
    "backlash",
    "tendon_slack",
    "unequal_tendons",
    "guide_friction",
    "viscous_drag",
    "time_delay",
    "superelastic_plateau",
    "thermal_drift",
)
"""Effects of spoiled cases: those that one record of one cycle can show."""
ATTEMPTS = 10


@dataclass(frozen=True)
class Drawn:
    """A case with its truth.

    Parameters
    ----------
    source
        One of :data:`SOURCES`.
    label
        The effect or change, or what spoils the case; ``clean`` or ``control``.
    effects
        Names that are right; empty where nothing is to be named.
    counts
        Whether a name, or none, counts: not for a control.
    outside
        Whether something is wrong that is no effect of the catalogue.
    describes
        Names that count neither for nor against.
    size
        Main constant of the effect; None where it means another thing in each model.
    noise_deg
        Standard deviation of the noise; of measured records the residual level.
    rig
        What the sidecars tell: ``known`` or ``unknown``.
    control_of
        Key of the untouched records of a measured case.
    """

    records: tuple[Record, ...]
    source: str
    label: str
    effects: tuple[str, ...]
    noise_deg: float
    rig: Kind
    counts: bool = True
    outside: bool = False
    describes: tuple[str, ...] = ()
    size: float | None = None
    control_of: str = ""


def draw_source(source: str, seed: int, count: int, measured: Path | None = None) -> list[Drawn]:
    """Draw the cases of a source; measured ones come with their controls, which are beyond the count.

    Raises
    ------
    RecordError
        A folder without measured records, or a case that could not be drawn.
    """
    if source == REAL:
        if measured is None:
            raise RecordError("real: expected the folder of the measured records")
        return _real(measured, seed, count)
    return [draw_simulated(source, seed, number) for number in range(count)]


def draw_simulated(source: str, seed: int, number: int) -> Drawn:
    """Draw a simulated case; where an effect has no moderate size on a rig, another effect is drawn.

    Raises
    ------
    RecordError
        No case in :data:`ATTEMPTS`.
    """
    key = zlib.crc32(source.encode())
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng((seed, key, number, attempt))
        try:
            return _DRAW[source](rng, number)
        except (SolverError, ValueError):
            continue
    raise RecordError(f"case {number} of {source}, seed {seed}: not drawn in {ATTEMPTS} attempts")


def _seed(rng: Rng) -> int:
    return int(rng.integers(2**31))


def _label(rng: Rng, number: int, kind: Kind, effects: Sequence[str], outside: Sequence[str] = ()) -> str:
    """Two cases of eight are clean, one is outside the catalogue where there is such, the others have an effect."""
    if number % 4 == 0:
        return CLEAN
    if outside and number % 8 == 3:
        return str(rng.choice([*outside]))
    return str(rng.choice([name for name in effects if kind == "known" or name not in ANGLE_ALONE]))


def _own(rng: Rng, number: int) -> Drawn:
    kind = KINDS[int(rng.integers(2))]
    label = _label(rng, number, kind, [*CATALOGUE], [*OUTSIDE_CATALOGUE])
    noiseless, noise = draw_noiseless(_seed(rng), kind, label, number)
    return _simulated(with_white_noise(noiseless, noise), "own", kind, label)


def _other(rng: Rng, number: int) -> Drawn:
    kind = KINDS[int(rng.integers(2))]
    label = _label(rng, number, kind, [name for name in LABELS if name in CATALOGUE])
    noiseless, noise = draw_lumped_noiseless(_seed(rng), kind, label, 0)
    return _simulated(with_white_noise(noiseless, noise), "other", kind, label)


def _series(rng: Rng, number: int) -> Drawn:
    kind = KINDS[int(rng.integers(2))]
    label = _label(rng, number, kind, [name for name in labels_of(kind) if name not in (CLEAN, DOMINANT)])
    return _simulated(draw_series_case(_seed(rng), kind, label, 0), "series", kind, label, UNDECLARED)


def _asked(rng: Rng, *, clean: bool) -> Asked:
    kind, generator = KINDS[int(rng.integers(2))], GENERATORS[int(rng.integers(2))]
    label = CLEAN if clean else str(rng.choice(SPOILED_EFFECTS))
    return Asked(_seed(rng), kind, 0, generator, label)


def _sensor(rng: Rng, number: int) -> Drawn:
    """Spoil two clean cases of three; the third has an effect."""
    name = [*SENSORS][number % len(SENSORS)]
    asked = _asked(rng, clean=number % 3 < 2)
    case, sensor = draw_spoiled_sensor(asked, name)
    return _simulated(case, "sensors", asked.kind, name, sensor.describes)


def _protocol(rng: Rng, number: int) -> Drawn:
    """Spoil clean cases and cases with an effect in turn."""
    name = [*PLANS][number % len(PLANS)]
    asked = _asked(rng, clean=number % 2 == 0)
    return _simulated(draw_spoiled_protocol(asked, name), "protocols", asked.kind, name)


_DRAW: Mapping[str, Callable[[Rng, int], Drawn]] = {
    "own": _own,
    "other": _other,
    "sensors": _sensor,
    "protocols": _protocol,
    "series": _series,
}


def _simulated(case: Case, source: str, rig: Kind, label: str, describes: tuple[str, ...] = ()) -> Drawn:
    truth = case.truth
    named = tuple(name for name in truth.effects if name in CATALOGUE)
    return Drawn(
        records=case.records,
        source=source,
        label=label,
        effects=named,
        noise_deg=truth.noise_deg,
        rig=rig,
        outside=truth.effects != named,
        describes=describes,
        size=size_of(named[0], truth.numbers.get(named[0], {}), rig) if named else None,
    )


def _real(measured: Path, seed: int, count: int) -> list[Drawn]:
    hidden = [nth(measured, seed, number) for number in range(count)]
    controls = {_key(one): one for one in hidden}
    return [
        *(_of_hidden(one) for one in hidden),
        *(
            Drawn(one.control, REAL, CONTROL, (), one.case.truth.noise_deg, "unknown", counts=False, control_of=key)
            for key, one in controls.items()
        ),
    ]


def _key(one: HiddenCase) -> str:
    return " ".join(Path(record.source).name for record in one.control)


def _of_hidden(one: HiddenCase) -> Drawn:
    truth = one.case.truth
    return Drawn(
        records=one.case.records,
        source=REAL,
        label=one.change,
        effects=truth.effects,
        noise_deg=truth.noise_deg,
        rig="unknown",
        outside=not truth.effects,
        size=size_of(one.change, truth.numbers[one.change], "unknown"),
        control_of=_key(one),
    )

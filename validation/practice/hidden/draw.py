"""Draw measured records with a hidden change, and write them.

    python -m validation.practice.hidden.draw --measured DIR --seed 7 --count 40 --out OUT

The size of a change is drawn relative to the residual level of the untouched records: what a curve with play operators
leaves of them. It is 2 to 5 times that level, root mean square, beyond what a smooth curve of the drive takes
(:func:`validation.practice.hidden.curve_with_plays.change_beyond_curve`). The untouched records are the control.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.progress import track

from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import read_record
from validation.practice.cases import write_case
from validation.practice.draw import Case, Truth
from validation.practice.hidden.changes import CHANGES, OUTSIDE, Change, Sized
from validation.practice.hidden.curve_with_plays import CurveWithPlays, change_beyond_curve, fit_curve_with_plays

GROUPS: dict[str, tuple[str, ...]] = {
    "catheter-slack": ("catheter-slack-*.csv",),
    "catheter-taut": ("catheter-taut-*.csv",),
    "tendon-robot": ("tendon-robot-*.csv",),
    "davinci": ("davinci-tool-load010-*.csv", "davinci-tool-load050-*.csv", "davinci-tool-load100-*.csv"),
    "manipulator": ("surgical-manipulator-0-80.csv",),
}
"""Files of a group; where there are several patterns, one is drawn."""
RATIOS = (2.0, 5.0)
"""Size over the residual level."""
TOLERANCE = 0.002
"""Relative deviation of a size from its target: small, or bisection gives other seeds the same few sizes."""
ATTEMPTS = 20
CONTROL = "control"


@dataclass(frozen=True)
class HiddenCase:
    """Records with a hidden change, the same records without it, and where they are from.

    ``truth.noise_deg`` is the residual level of the control; ``change`` is a key of :data:`CHANGES`.
    """

    case: Case
    control: tuple[Record, ...]
    group: str
    change: str


def read_group(folder: Path, group: str, rng: np.random.Generator) -> tuple[Record, ...]:
    """Read the records of a group.

    Raises
    ------
    RecordError
        A folder without records of the group, or a record that cannot be read.
    """
    pattern = GROUPS[group][int(rng.integers(len(GROUPS[group])))]
    paths = sorted(folder.glob(pattern))
    if not paths:
        raise RecordError(f"{folder}: no record of the group {group}: expected {pattern}")
    return tuple(read_record(path) for path in paths)


def draw_hidden_case(folder: Path, seed: int, group: str, change: str, number: int) -> HiddenCase:
    """Draw a case; the same arguments and files give the same records.

    Raises
    ------
    RecordError
        From :func:`read_group`, or no draw of the change has a size within :data:`RATIOS`.
    """
    rng = np.random.default_rng((seed, zlib.crc32(f"{group} {change}".encode()), number))
    control = read_group(folder, group, rng)
    baseline = fit_curve_with_plays(control)
    for _ in range(ATTEMPTS):
        target = float(rng.uniform(*RATIOS))
        found = sized(control, CHANGES[change](control, rng), target, baseline)
        if found is None:
            continue
        hidden, ratio = found
        outside = change in OUTSIDE
        truth = Truth(
            effects=() if outside else (change,),
            numbers={change: hidden.numbers},
            ratios=(round(ratio, 3),),
            beyond_curve=(),
            engine="measured",
            noise_deg=baseline.level_deg,
            rig=group,
        )
        case = Case(f"{group}-{change}-{number:02d}", hidden.records(control), truth)
        return HiddenCase(case, control, group, change)
    raise RecordError(
        f"{folder}: {group}, {change}: no size between {RATIOS[0]:g} and {RATIOS[1]:g} times the residual"
    )


def sized(
    records: Sequence[Record], change: Sized, target: float, baseline: CurveWithPlays
) -> tuple[Change, float] | None:
    """Give the change of a size, by bisection of its logarithm, and its ratio; None if 1 is not large enough."""

    def ratio(one: Change) -> float:
        return change_beyond_curve(baseline, one.records(records)) / baseline.level_deg

    low, high = np.log(1e-5), 0.0
    if ratio(change(1.0)) < target:
        return None
    for _ in range(30):
        middle = 0.5 * (low + high)
        one = change(float(np.exp(middle)))
        now = ratio(one)
        if abs(now / target - 1) < TOLERANCE:
            return one, now
        low, high = (middle, high) if now < target else (low, middle)
    return None


def groups_of(folder: Path) -> list[str]:
    """Give the groups of which a folder has records.

    Raises
    ------
    RecordError
        A folder that has none.
    """
    there = [name for name, patterns in GROUPS.items() if all(any(folder.glob(pattern)) for pattern in patterns)]
    if not there:
        raise RecordError(f"{folder}: no measured records: expected those of {', '.join(GROUPS)}")
    return there


def nth(folder: Path, seed: int, number: int) -> HiddenCase:
    """Draw the case of a number: the groups take turns, and so do the changes, so that all meet in the end.

    Where a change cannot be as large as it has to be, another one is drawn by chance, so that none takes all those
    turns: a wheel that runs out by a tenth of its radius hardly shows in most groups.

    Raises
    ------
    RecordError
        From :func:`groups_of`, or no change of the records can be drawn.
    """
    groups = groups_of(folder)
    turn, group = divmod(number, len(groups))
    names = [*CHANGES]
    own = names.pop((group + turn) % len(names))
    for name in (own, *np.random.default_rng((seed, number)).permutation(names)):
        with suppress(RecordError):
            return draw_hidden_case(folder, seed, groups[group], str(name), number)
    raise RecordError(f"{folder}: {groups[group]}: no change of case {number} has its size")


def main(arguments: Sequence[str] | None = None) -> None:
    """Write cases into ``OUT/GROUP-CHANGE-NUMBER``, and the control of each beside them."""
    parser = argparse.ArgumentParser(prog="python -m validation.practice.hidden.draw", description=__doc__)
    parser.add_argument("--measured", type=Path, required=True, help="folder of the measured records")
    parser.add_argument("--seed", type=int, required=True, help="of the set")
    parser.add_argument("--count", type=int, default=40, help="cases")
    parser.add_argument("--out", type=Path, required=True, help="folder")
    options = parser.parse_args(arguments)
    for number in track(range(options.count), description="cases"):
        drawn = nth(options.measured, options.seed, number)
        write_case(drawn.case, options.out)
        write_case(replace(drawn.case, name=f"{drawn.case.name}-{CONTROL}", records=drawn.control), options.out)


if __name__ == "__main__":
    main()

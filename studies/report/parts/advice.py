"""What to do: sentences that follow from the results of a folder, the most urgent first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from hysteresis.files import present
from studies.report.parts.feasible import Feasible
from studies.report.summary import OVER_NOISE, limit_words, words_of_part
from studies.results import fit, read_result, trace
from studies.results.fit import StoredFit
from studies.results.run import RigNumber, RunLoop, RunSummary, StrainLimit, read_run
from studies.results.separation import Separation
from studies.results.trace import StoredTrace
from studies.results.wrist import FILE as WRIST
from studies.results.wrist import WristSummary, read_wrist

_SEPARATION = "the result of `notchbend separate`"
_STRONGEST = 2
_LEAST_FLOOR_DEG = 1e-3  # a record without noise has no floor


def what_to_do(folder: Path, feasible: Feasible | None = None) -> tuple[str, ...]:
    """Give the advice that follows from the stored results of a folder; ``feasible`` is that of its study.

    Raises
    ------
    RecordError
        One line with the file that cannot be read.
    """
    return tuple(_advice(folder, feasible))


def _advice(folder: Path, feasible: Feasible | None) -> Iterator[str]:
    run = read_run(folder) if present(folder / "run.json") else None
    separations = [read_result(Separation, path, _SEPARATION) for path in sorted(folder.glob("separate*.json"))]
    if run is not None:
        yield from _of_strain(run.loops, run.rig)
        yield from _of_slack(run.loops)
        yield from _of_predictions(run, calibrated=any(one.calibration is not None for one in separations))
    if present(folder / WRIST):
        wrist = read_wrist(folder)
        yield from _of_strain(wrist.loops, wrist.rig, in_space=True)
        yield from _of_slack(wrist.loops)
        yield from _of_wrist(wrist)
    for separation in separations:
        yield from _of_separation(separation)
    traces = [read_result(StoredTrace, path, trace.WHAT) for path in sorted(folder.glob("trace*.json"))]
    for path in sorted(folder.glob("identify*.json")):
        yield from _of_fit(read_result(StoredFit, path, fit.WHAT), path.stem, traces)
    for result in traces:
        yield from _of_trace(result)
    if feasible is not None:
        yield from _of_study(feasible)
    if run is not None and run.own is not None:
        yield from _of_missing(run)


def _of_strain(loops: Sequence[RunLoop], rig: Sequence[RigNumber], *, in_space: bool = False) -> Iterator[str]:
    """Say which limit is passed first, at which drive, and by how much."""
    worst = max(loops, key=lambda loop: loop.peak_strain_percent)
    passed = [row for row in worst.strain_limits if row.passed_at_mm is not None]
    if not worst.strain_limits:
        return
    if not passed:
        row = worst.strain_limits[0]
        yield (
            f"Strain: no limit is passed; {row.name} allows {row.limit_percent:.3g} %, the loop of {worst.record} has "
            f"{row.largest_percent:.2g} %."
        )
        return
    low, last = passed[0], passed[-1]
    times = low.largest_percent / low.limit_percent
    cycles = limit_words(worst, low)
    yield (
        f"Strain: {low.name} ({low.limit_percent:.3g} % {low.kind}) is passed {cycles}, at joint {low.joint} of "
        f"{worst.record}, and by a factor of {times:.2g} at full drive. For many cycles stay below that, or strain "
        "each notch less: more notches, wider ones, or deeper ones."
    )
    is_superelastic = any(number.name.startswith("superelastic.") for number in rig)
    if last is not low and not ("plateau" in last.name and is_superelastic):
        then = "the tube may not spring back."
        if "plateau" in last.name:
            cure = ", and there is no other one in space." if in_space else ": add [superelastic] to the rig file."
            then = f"beyond it the linear law of the rig no longer holds{cure}"
        yield f"Strain: {last.name} ({last.limit_percent:.3g} %) is passed from {_at(last)} on; {then}"


def _at(row: StrainLimit) -> str:
    return "" if row.passed_at_mm is None else f"{abs(row.passed_at_mm):.2f} mm"


def _of_slack(loops: Sequence[RunLoop]) -> Iterator[str]:
    for loop in loops:
        if loop.slack_from_mm is not None:
            yield (
                f"Slack: a tendon of {loop.record} goes slack from {loop.slack_from_mm:.2f} mm on, and the loop widens "
                "there: raise the preload, or drive it less."
            )


def _of_predictions(run: RunSummary, *, calibrated: bool) -> Iterator[str]:
    """Say how far a record is from the loop of its rig file; ``calibrated`` is whether the page has better numbers."""
    cure = "take over the calibrated numbers under Contributions, or " if calibrated else ""
    for one in run.own.predictions if run.own is not None else ():
        if one.rmse_deg > OVER_NOISE * one.noise_floor_deg:
            widths = ""
            if one.width_deg is not None and one.predicted_width_deg is not None:
                widths = f" (loop {one.width_deg:.3g} deg measured, {one.predicted_width_deg:.3g} deg predicted)"
            yield (
                f"Rig file: the loop of {one.record} is {one.rmse_deg:.2g} deg rms from what the file predicts"
                f"{widths}, {one.rmse_deg / max(one.noise_floor_deg, 1e-12):.2g} times the noise: {cure}measure "
                "friction and stiffness."
            )


def _of_separation(result: Separation) -> Iterator[str]:
    """Say which part makes the loop, and which number of the rig it depends on most."""
    shares = {name: row.width_share for name, row in result.contributions.items() if row.width_share is not None}
    if shares:
        most = max(shares, key=lambda name: shares[name])
        limits = result.contributions[most].interval("width_share")
        between = f" ({100 * limits[0]:.0f} to {100 * limits[1]:.0f} %)" if limits else ""
        words = f"Loop of {result.rig['name']}, {result.total.width_deg:.3g} deg wide: {words_of_part(most)} make"
        words += f" {100 * shares[most]:.0f} %{between} of it"
        strongest = _strongest(result)
        yield f"{words}. {strongest}" if strongest else f"{words}."
    if result.calibration is not None and result.calibration.next_experiments:
        best = result.calibration.next_experiments[0]
        yield (
            f"Measure next, for the contributions: {best.what} ({best.preload_N:.3g} N, {best.amplitude_mm:.3g} mm); "
            f"it narrows the interval of {best.parameter} {best.narrower:.2g} times."
        )


def _strongest(result: Separation) -> str:
    known = {n: one.width for n, one in (result.sensitivity or {}).items() if one.width is not None}
    names = sorted(known, key=lambda name: -abs(known[name]))[:_STRONGEST]
    if not names:
        return ""
    each = " and ".join(f"{name} by {known[name]:+.2g} %" for name in names)
    return f"Its width changes most with these numbers of the rig, for 1 % more of each: {each}."


def _of_fit(found: StoredFit, name: str, traces: Sequence[StoredTrace]) -> Iterator[str]:
    after, floor = found.heldout.rmse_deg, found.noise_floor_deg
    if floor <= _LEAST_FLOOR_DEG or after <= OVER_NOISE * floor:
        return
    files = [Path(one).name for one in found.records]
    traced = [one.verdict for one in traces if set(files) <= {Path(record).name for record in one.records}]
    if "none" in traced:
        then = "the rig with calibrated numbers explains it to the noise (trace: none), the layer alone does not"
    else:
        then = "see its trace" if traced else "`notchbend trace` looks for what is missing"
    yield f"Layer: on {' '.join(files) or name} the held-out error is {after / floor:.2g} times the noise: {then}."


def _of_trace(result: StoredTrace) -> Iterator[str]:
    names = " + ".join(effect.name.replace("_", " ") for effect in result.effects)
    records = ", ".join(Path(record).name for record in result.records) or "the records"
    if names and result.verdict in ("effect", "partial", "ambiguous"):
        sure = {"effect": "", "partial": " in part", "ambiguous": " possibly"}[result.verdict]
        yield f"Trace: the residual of {records} comes{sure} from {names}: look at the rig for it."
    if result.next_experiment:
        yield f"Measure next, for the trace of {records}: {result.next_experiment}."


def _of_study(feasible: Feasible) -> Iterator[str]:
    best = feasible.best
    if best is None:
        return
    if best.feasible:
        gain = 100 * (1 - best.share_percent / best.middle_percent) if best.middle_percent > 0 else 0.0
        yield (
            f"Best design within the limits: {best.place()}. It bends {best.angle_deg:.3g} deg with a loop of "
            f"{best.width_deg:.3g} deg, {best.share_percent:.2g} % of full scale, {gain:.0f} % less than the median of "
            f"the {feasible.kept} designs within the limits."
        )
        return
    nearest = "" if best.fatigue_margin is None else f" (fatigue margin {best.fatigue_margin:.2g}, expected at least 1)"
    broken = min(feasible.limits, key=lambda limit: limit.kept)
    yield (
        f"No design of the study keeps all limits; the one that fewest keep is {broken.words} ({broken.kept} of "
        f"{feasible.cases}). The narrowest loop regardless of them is at {best.place()}{nearest}: widen the ranges, or "
        "drive it less."
    )


def _of_wrist(wrist: WristSummary) -> Iterator[str]:
    """Say what to do about friction, and with records."""
    two_wheels = {one.wheel for one in wrist.tendons} == {1, 2}
    for path in wrist.paths[-1:] if two_wheels else ():
        yield (
            f"Path: friction moves the tip by up to {path.largest_apart_mm:.2g} mm from where it is without. "
            f"`notchbend compensate` finds the motion of two wheels that takes friction into account."
        )
    yield (
        "Records: this report is of the model alone. Measure a loop of each wheel while the others stand still, name "
        "the rig in the sidecars, and give the records to `notchbend trace`; the report takes none."
    )


def _of_missing(run: RunSummary) -> Iterator[str]:
    """Say what a report without records, or with one preload, cannot say yet."""
    assert run.own is not None
    if not run.fits:
        rig, has_preload = run.own.option, bool(run.loops[-1].preload_N)
        two = "preloads" if has_preload else "amplitudes"
        yield (
            f"Records: this report is of the model alone. Measure two {two} with two cycles each, then "
            f"`notchbend record new bench.csv {rig}{' --preload N' * has_preload}`, and give the "
            f"records to `notchbend run {rig}`."
        )
    elif len({fit.record for fit in run.fits}) == 1:
        yield "Records: one record. A second preload says more than twice as many cycles."

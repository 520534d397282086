"""The loop of a rig, or of measured records, divided among its sources: the work of ``notchbend separate``."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import rig_of
from hysteresis import identify
from hysteresis.arrays import Floats
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.records.metrics import dissipated_area, loop_width
from hysteresis.records.record import Record
from studies.engines import solver_of
from studies.results.separation import (
    Calibration,
    Combination,
    Contribution,
    EnergyBalance,
    Interval,
    Law,
    LoopSensitivity,
    LoopSize,
    MeasuredLoop,
    NextExperiment,
    OverEnsemble,
    Separation,
    ToMeasure,
)
from validation.separation import Contributions, calibrate_rig, loop_program, separate
from validation.separation.contributions import PLAY, SETS, SOURCES, STEPS, shapley_shares
from validation.separation.ensemble import LEVEL, range_of, separate_each
from validation.separation.posterior import quantiles
from validation.separation.priors import METAL_TEST, PRIORS, stated_values
from validation.separation.rig_calibration import LEVELS, MISFIT, RigCalibration
from validation.separation.sensitivity import Sensitivities, sensitivities

SHARES = {"width_deg": "width_share", "area": "area_share", "dissipated_mJ": "share"}
"""Quantities that are divided, with the name of their shares: ``share`` is that of the energy, which every loop has."""
NUMBERS = tuple(name for pair in SHARES.items() for name in pair)
"""Numbers of a part that have an interval."""
CLOSES_PERCENT, RIGID_PERCENT = 1.0, 0.1
MOVING = 0.02
"""Change of a share from a tenfold EA, over the largest share, of which the result warns."""
_MOST_OF_THEM = 0.5  # weight of the draws that have a share, of which an interval is given
UNLIKE = 0.1  # of the range of the angle: more than that is left by a rig that is not that of the record
LAW = "law"
"""Name of the law of the metal among the numbers that a share depends on: 1 is the flag."""
SHOWN = 6
"""Constants whose sensitivity a terminal shows, the strongest; ``separate.json`` has all."""

OBSERVABLE = {
    "all": SETS[-1],
    "friction": frozenset({"friction", "tendon_elasticity"}),
    "tendon_elasticity": frozenset({"tendon_elasticity"}),
    "material": frozenset({"material", "tendon_elasticity"}),
}
"""Combinations that Bouc-Wen parameters are given for: each source with the rig's own elastic tendons. With
inextensible tendons the wheel prescribes the angle, and there is no loop to fit."""

STEPS_OF_RIG = 2 + len(OBSERVABLE)
STEPS_OF_RECORDS = 1 + STEPS_OF_RIG


@dataclass(frozen=True, eq=False)
class Draws:
    """Parts of the loops of rigs drawn from a posterior, with their weights, which add up to 1.

    ``tables`` has shape (n, parts, :data:`NUMBERS`), ``weights`` (n,).
    """

    rigs: tuple[Rig, ...]
    tables: Floats
    weights: Floats


Report = Callable[[str], None]
"""Called with the name of a step that begins."""


def separate_rig(
    rig: Rig, amplitude_mm: float, *, engine: str = "chain", seed: int = 0, members: Sequence[Rig] = (),
    report: Report = lambda step: None,
) -> Separation:  # fmt: skip
    """Divide the loop of a rig, and of the ``members`` of its ensemble. One tendon is driven from 0 to the amplitude.

    ``report`` is called with the name of each of :data:`STEPS_OF_RIG` steps before it begins.

    Raises
    ------
    RigError, SolverError, MissingError
        A rig that cannot be divided or cannot follow the drive; members with another engine than the chain.
    """
    if members and engine != "chain":
        raise RigError(f"--engine {engine} with --ensemble: expected chain")
    program = loop_program(0.0 if rig.tendon_b is None else -amplitude_mm, amplitude_mm)
    report("loops with and without each source")
    found = separate(rig, program, solver_of(engine))
    result = _result(rig, program, found, engine, _laws(found, seed, report))
    report("sensitivities and members")
    if engine == "chain":
        result = _with_sensitivity(result, sensitivities(rig, program))
    return _over_members(result, separate_each(members, program)) if members else result


def _with_sensitivity(result: Separation, found: Sensitivities) -> Separation:
    of = {
        name: LoopSensitivity(**{key: value if np.isfinite(value) else None for key, value in vars(one).items()})
        for name, one in found.of.items()
    }
    return replace(result, sensitivity=of, inseparable=found.sentence())


def _over_members(result: Separation, found: Sequence[Contributions]) -> Separation:
    """Add the ranges of all numbers over the members of an ensemble."""
    parts, without = [_parts(one) for one in found], Contribution(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    names = [name for pair in SHARES.items() for name in pair]
    own = dict(result.contributions)
    if any(PLAY in one for one in parts):
        own.setdefault(PLAY, without)

    def interval(values: list[float | None]) -> Interval | None:
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        limits = range_of(known)
        return limits.low, limits.high

    contributions = {
        name: replace(
            part, intervals={n: interval([getattr(one.get(name, without), n) for one in parts]) for n in names}
        )
        for name, part in own.items()
    }
    width, area, energy = (range_of([getattr(one.whole, n) for one in found]) for n in SHARES)
    whole = OverEnsemble(len(found), LEVEL, (width.low, width.high), (area.low, area.high), (energy.low, energy.high))
    return replace(result, contributions=contributions, ensemble=whole)


def separate_records(
    records: Sequence[Record], *, seed: int = 0, report: Report = lambda step: None
) -> Separation:  # fmt: skip
    """Divide the loop of the first record, with its rig calibrated on all records; with 95 % intervals.

    ``report`` is called with the name of each of :data:`STEPS_OF_RECORDS` steps before it begins.

    Raises
    ------
    RecordError, RigError, SolverError
        A record without a known rig, or without a loop; a rig that cannot be divided or cannot follow the drive.
    """
    for record in records:
        rig_of(record)
    report("calibrating the rig")
    calibrated = calibrate_rig(records, seed=seed)
    drive = records[0].drive
    program = loop_program(min(0.0, float(drive.min())), float(drive.max()))
    report("loops with and without each source")
    found = replace(separate(calibrated.rig, program), has_play=calibrated.has_play)
    result = _result(calibrated.rig, program, found, "chain", _laws(found, seed, report))
    report("sensitivities and intervals")
    result = _with_sensitivity(result, sensitivities(calibrated.rig, program))
    draws = divided_draws(calibrated, program, found)
    unseparated = tuple(f"not separated by these records: {words}" for words in calibrated.inseparable)
    unlike = _unlike(calibrated, max(float(np.ptp(record.angle_deg)) for record in records))
    return replace(
        result,
        contributions=parts_with_intervals(found, draws),
        calibration=replace(_calibration(calibrated), to_measure=to_measure(found, draws)),
        measured=_measured(records[0]),
        warnings=result.warnings + _without_loss(draws) + calibrated.notes + unlike + unseparated,
        records=tuple(record.source for record in records if record.source),
    )


def divided_draws(calibrated: RigCalibration, program: LoadProgram, found: Contributions) -> Draws:
    """Divide the loop of every rig drawn from the posterior; those that cannot follow the drive are left out.

    What the steps of a loop change in its parts is nearly the same in all of these rigs. Longer steps are enough for
    their differences from the best rig, whose division with short ones is ``found``.
    """
    coarse = loop_program(float(program.drive_mm.min()), float(program.drive_mm.max()), cycles=1, steps=STEPS // 2)

    def table(rig: Rig) -> Floats:
        return _table(replace(separate(rig, coarse, softer=found.softer), has_play=found.has_play))

    exact = np.nan_to_num(_table(found) - table(calibrated.rig))  # what the best rig has no share of is not mended
    rigs, tables, weights = [], [], []
    for rig, weight in zip(calibrated.rigs, calibrated.weights.tolist(), strict=True):
        try:
            tables.append(exact + table(rig))
        except (RigError, SolverError):
            continue
        rigs.append(rig)
        weights.append(weight)
    if not rigs:
        raise SolverError("none of the rigs that explain the records follows the drive of the first one")
    return Draws(tuple(rigs), np.array(tables), np.array(weights) / sum(weights))


def _table(found: Contributions) -> Floats:
    """Parts of a loop, shape (parts, numbers); NaN where there is no such loop."""
    return np.array(
        [
            [math.nan if (value := getattr(part, name)) is None else value for name in NUMBERS]
            for part in _parts(found).values()
        ]
    )


def parts_with_intervals(found: Contributions, draws: Draws) -> dict[str, Contribution]:
    """Parts of the best rig's loop with 95 % intervals, which reach to the value."""

    def interval(part: str, value: float | None, drawn: Floats) -> Interval | None:
        known = np.isfinite(drawn)
        if value is None or draws.weights[known].sum() < _MOST_OF_THEM:
            return None
        low, high = quantiles(drawn[known], draws.weights[known] / draws.weights[known].sum(), LEVELS)
        least = max(0.0, low) if part == PLAY else low  # a play makes no loop narrower by itself
        return min(least, value), max(high, value)

    return {
        part: replace(
            one,
            intervals={
                name: interval(part, getattr(one, name), draws.tables[:, i, j]) for j, name in enumerate(NUMBERS)
            },
        )
        for i, (part, one) in enumerate(_parts(found).items())
    }


def to_measure(found: Contributions, draws: Draws) -> tuple[ToMeasure, ...]:
    """Name the parameter of each source that its energy share depends on most, over the draws.

    It explains the square of its correlation with the share. Where the draws have two laws, the law is one of them.
    """
    known = [stated_values(rig) | {LAW: float(rig.superelastic is not None)} for rig in draws.rigs]
    names = [name for name in known[0] if all(name in one for one in known)]
    if not all(rig.backlash for rig in draws.rigs):  # what a preload takes up of no play
        names = [name for name in names if name != "backlash_takes_up_N"]
    column, rows = NUMBERS.index("share"), list(_parts(found))
    out = []
    for source in SOURCES:
        share = np.nan_to_num(draws.tables[:, rows.index(source), column])  # a rig without losses has none
        squares = {name: _explained([one[name] for one in known], share, draws.weights) for name in names}
        most = max(squares, key=lambda name: squares[name])
        if squares[most] > 0:
            how = METAL_TEST if most == LAW else PRIORS[most].how
            out.append(ToMeasure(part=source, parameter=most, explains=squares[most], how=how))
    return tuple(out)


def _explained(values: Sequence[float], share: Floats, weights: Floats) -> float:
    """Square of the correlation of a number with a share, shapes (n,); 0 where one of them does not vary."""
    x, y = (one - weights @ one for one in (np.asarray(values), share))
    spread = float(weights @ x**2) * float(weights @ y**2)
    return float((weights @ (x * y)) ** 2 / spread) if spread > 0 else 0.0


def _without_loss(draws: Draws) -> tuple[str, ...]:
    """Warn where some drawn rigs dissipate nothing, so that their energy has no shares."""
    share = float(draws.weights[np.isnan(draws.tables[:, 0, NUMBERS.index("share")])].sum())
    if share == 0:
        return ()
    return (
        f"{100 * share:.0f} % of the rigs that explain the records dissipate no energy: intervals of energy shares are "
        "those of the others",
    )


def _unlike(found: RigCalibration, range_deg: float) -> tuple[str, ...]:
    """Warn of a rig that does not follow the records, as one of another scale, or with something that it lacks."""
    if found.rmse_deg > UNLIKE * range_deg:
        return (
            f"the calibrated rig leaves {found.rmse_deg:.3g} deg rms of an angle that covers {range_deg:.3g} deg: the "
            "parts are not those of this record; expected degrees and mm, and the rig of the record",
        )
    if found.misfit > MISFIT:
        return (
            f"the calibrated rig leaves {found.rmse_deg:.3g} deg rms, {found.misfit:.2g} times the noise of "
            f"{found.noise_deg:.2g} deg: something in the records is not in the rig, and intervals are as many times "
            "wider; notchbend trace says what it may be",
        )
    return ()


def _result(
    rig: Rig, program: LoadProgram, found: Contributions, engine: str, laws: Mapping[str, Law | None]
) -> Separation:  # fmt: skip
    whole = found.whole
    return Separation(
        schema=1,
        rig=rig.to_dict(),
        engine=engine,
        drive_mm=(float(program.drive_mm.min()), float(program.drive_mm.max())),
        total=LoopSize(whole.width_deg, whole.area, whole.dissipated_mJ),
        contributions=_parts(found),
        shapley={share: shapley_shares(found, quantity) for quantity, share in SHARES.items()},
        energy=EnergyBalance(whole.dissipated_mJ, whole.friction_mJ, whole.material_mJ, found.closure_percent),
        rigid_rope_residual_percent=found.residual_percent,
        combinations=tuple(
            Combination(
                tuple(sorted(on)), loop.width_deg, loop.area, loop.dissipated_mJ, loop.friction_mJ, loop.material_mJ
            )
            for on, loop in found.loops.items()
        ),
        bouc_wen=laws,
        calibration=None,
        measured=None,
        warnings=tuple(_warnings(found)),
    )


def _parts(found: Contributions) -> dict[str, Contribution]:
    """Divide width, area and energy of the whole loop among the parts."""
    numbers: dict[str, dict[str, float | None]] = {}
    for quantity, name in SHARES.items():
        values, shares = found.parts(quantity), found.shares(quantity)
        for part, value in values.items():
            row = numbers.setdefault(part, {})
            row |= {quantity: value, name: None if shares is None else shares[part]}
    return {part: Contribution(**row) for part, row in numbers.items()}  # type: ignore[arg-type]


def _laws(found: Contributions, seed: int, report: Report) -> dict[str, Law | None]:
    out = {}
    for name, on in OBSERVABLE.items():
        report(f"Bouc-Wen parameters of {name.replace('_', ' ')}")
        out[name] = _law(found, on, seed)
    return out


def _law(found: Contributions, on: frozenset[str], seed: int) -> Law | None:
    """Fit the Bouc-Wen law and f to the loop of a combination; None where there is no loop."""
    loop = found.loops[on]
    if loop.is_flat:
        return None
    settings = IdentifySettings(seed=seed, forward=True, population=40, generations=30)  # a loop without noise
    fit = identify(loop.record, settings=settings)
    return Law(fit.parameters, fit.saturation_deg, fit.heldout)


def _warnings(found: Contributions) -> list[str]:
    words = []
    if found.whole.is_lossless and not found.whole.is_flat:
        words.append("the rig dissipates no energy: its loop is that of the play, and the energy has no shares")
    elif found.whole.is_lossless:
        words.append("no loop: the rig dissipates no energy, so there is nothing to divide")
    elif found.whole.is_flat:
        words.append("no loop of the angle: shares are those of the energy")
    if abs(found.closure_percent) > CLOSES_PERCENT:
        words.append(
            f"energy: the parts differ from the losses by {found.closure_percent:+.2f} %: expected at most 1 %"
        )
    if not found.whole.is_lossless and (found.moved > MOVING or not found.is_balanced):
        still = (
            "" if found.moved == math.inf else f", and with ten times that a share moves by {100 * found.moved:.2g} %"
        )
        words.append(
            "tendon elasticity cannot be switched off: the tendons of this rig jam on one wheel if they are stiffer. "
            f"The shares are those with {found.stiffened:.3g} times their EA{still}: read the loops, not the shares"
        )
        return words
    residual = found.residual_percent
    if residual is not None and residual > RIGID_PERCENT:
        words.append(
            f"{residual:.2g} % of the width remains with inextensible tendons: the joints bend unevenly, such a tendon "
            "goes slack at this preload, or the rig's own tendons are nearly as stiff"
        )
    return words


def _calibration(found: RigCalibration) -> Calibration:
    return Calibration(
        parameters=found.parameters,
        rmse_deg=found.rmse_deg,
        noise_deg=found.noise_deg,
        condition=found.condition,
        correlations=found.correlations,
        not_separated=found.inseparable,
        next_experiments=tuple(NextExperiment(**vars(e)) for e in found.experiments),
        laws=found.laws,
        effective_draws=found.effective_draws,
    )


def _measured(record: Record) -> MeasuredLoop | None:
    """Measure the record's own loop."""
    try:
        width = loop_width(record.drive, record.angle_deg, record.cycle).max_deg
        return MeasuredLoop(width, dissipated_area(record.drive, record.angle_deg, record.cycle))
    except ValueError:  # loops of decaying amplitude do not close
        return None


def summary(result: Separation) -> list[str]:
    """Give the lines that stand below the table of parts on a terminal."""
    total, energy = result.total, result.energy
    lines = [
        f"whole loop: {total.width_deg:.4g} deg wide, {total.area:.4g} deg mm, {total.dissipated_mJ:.4g} mJ a cycle",
        *_over_ensemble(result),
        "raw loops, deg wide and mJ: " + "; ".join(map(_raw, result.combinations)),
        f"energy balance: wheel {energy.wheel_work_mJ:.4g} mJ = friction {energy.friction_loss_mJ:.4g} "
        f"+ material {energy.material_loss_mJ:.4g} mJ, difference {energy.closure_percent:+.2g} %",
    ]
    if result.calibration is not None:
        found = result.calibration
        lines.append(f"calibrated rig: {found.rmse_deg:.3g} deg rmse, condition number {found.condition:.3g}")
        for name, c in found.parameters.items():
            lines.append(f"  {name} {c}")
        lines += [f"law of the metal: {name}, {100 * odds:.3g} %" for name, odds in (found.laws or {}).items()]
        lines += [
            f"energy of {one.part.replace('_', ' ')}: {100 * one.explains:.0f} % of what is open depends on "
            f"{one.parameter}: {one.how}"
            for one in found.to_measure
        ]
        for e in found.next_experiments[:2]:
            lines.append(
                f"next experiment: {e.what} ({e.preload_N:.3g} N, {e.amplitude_mm:.3g} mm): information gain "
                f"{e.gain:.2f}, interval of {e.parameter} {e.narrower:.2g} times narrower"
            )
    if result.sensitivity is not None:
        widths = {name: one.width for name, one in result.sensitivity.items() if one.width is not None}
        strongest = sorted(widths, key=lambda name: -abs(widths[name]))[:SHOWN]
        if strongest:
            named = ", ".join(f"{name} {widths[name]:+.2g}" for name in strongest)
            lines.append(f"d ln(width)/d ln(constant): {named}")
    if result.inseparable is not None:
        lines.append(result.inseparable)
    return [*lines, *(f"warning: {words}" for words in result.warnings)]


def _over_ensemble(result: Separation) -> list[str]:
    if (over := result.ensemble) is None:
        return []
    (low, high), (least, most) = over.width_deg, over.dissipated_mJ
    return [
        f"{100 * over.level:.0f} % of {over.members} members of the ensemble: {low:.4g} to {high:.4g} deg wide, "
        f"{least:.4g} to {most:.4g} mJ a cycle; ranges in brackets"
    ]


def _raw(one: Combination) -> str:
    """Loop of one combination of sources, in words."""
    sources = " + ".join(name.replace("_", " ") for name in one.on) or "none"
    return f"{sources} {one.width_deg:.3g}, {one.dissipated_mJ:.3g}"

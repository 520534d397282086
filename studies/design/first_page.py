"""The first page of a design report: what the chosen tube makes of its requirements, and what that rests on."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain import solve_chain
from fem_models.drawings import side_view_svg
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.records.record import Record
from studies.design.evaluation import Task, bent
from studies.design.quantities import QUANTITIES, Measured
from studies.design.space import Candidate
from studies.design.tolerance import CHANGES
from studies.results.design import FoundDesign, Verdict
from studies.results.page_one import DRAWING, KeyNumber, PageOne, ToleranceCost
from studies.units import words_of

LOOP = "records/cycle.csv"
SAMPLES = 81
"""Of a branch of the cycle that is drawn."""
WORTH = 0.01
"""Least gain of P(all met) for which a tolerance is worth tightening: what some hundred draws can tell."""
MODEL_DEG = (2.31, 3.51)
"""Error of the tip of a measured wrist, rms, with the metal fitted to another one: docs/validation/wrists.md."""
MODEL = (
    "Model: the compiled chain. With the metal fitted to one measured wrist it gave the tip of another to "
    f"{MODEL_DEG[0]} and {MODEL_DEG[1]} deg rms; with published constants alone it gave York's wrist 112 deg where "
    "144 deg were measured (docs/validation/wrists.md, york2015.md). P(met) does not know these errors."
)
TOO_STIFF = 4.0
"""Most of the tip stiffness of the chain over that of the multibody model, notches closed: docs/guide/design.md."""
CLOSED = (
    "Notches are closed at the required bend. The tip stiffness is too high there, up to four times, because the chain "
    "has no shear of the flexures"
)
WIRE_PERCENT = 1.0
"""Strain of a wire from which the page speaks of it: steel wire of 2,000 MPa yields there."""
LIFE = (
    "Cycles are the lower end of a 95 % interval from published tests of Nitinol, with an assumed exponent: no test of "
    "this tube."
)


@dataclass(frozen=True)
class FirstPage:
    """The rows, the drawing as SVG text, and the record of a cycle; None of a tube that the chain cannot bend so."""

    page: PageOne
    drawing: str
    loop: Record | None


def first_page(task: Task, candidate: Candidate, found: FoundDesign, title: str) -> FirstPage:
    """Make the first page of a design that was found.

    All quantities are taken, also those that nothing requires.

    Raises
    ------
    RigError
        A tube that cannot be made.
    """
    rig = task.space.rig(candidate, found.name)
    use = replace(task.use, wanted=frozenset(QUANTITIES))
    measured = bent(rig, task.space.wire(candidate), use) or Measured()
    loop = _loop(rig, measured.drive_mm)
    limits = f", within a tension of {use.tension_N:g} N" if math.isfinite(use.tension_N) else ""
    limiting = _limiting(found)
    page = PageOne(
        at=f"tube {found.name} at the required bend of {use.bend_deg:g} deg{limits}",
        rows=(*(_required(one, found) for one in found.verdicts), *_others(found, measured)),
        first=tuple(first_words(found)),
        drawing=DRAWING,
        title=title,
        made_of=_made_of(task, candidate, found),
        surely=_surely(found),
        costs=tuple(_costs(found, task, limiting)),
        limiting=_named(limiting),
        rests_on=tuple(_rests_on(task, rig, measured)),
        loop=None if loop is None else LOOP,
    )
    return FirstPage(page, side_view_svg(rig), loop)


def _loop(rig: Rig, drive_mm: float) -> Record | None:
    """Record a cycle to the required bend and back, to the other side, too, with two tendons, after the first way."""
    if not math.isfinite(drive_mm):
        return None
    low = 0.0 if rig.tendon_b is None else -drive_mm
    parts = np.linspace(drive_mm, low, SAMPLES), np.linspace(low, drive_mm, SAMPLES)[1:]
    path = np.concatenate([np.linspace(0.0, drive_mm, SAMPLES)[:-1], *parts])
    try:
        return replace(solve_chain(rig, LoadProgram(path)).record, title=f"{rig.name}, a cycle to the required bend")
    except (RigError, SolverError):
        return None


# --- rows ---------------------------------------------------------------------------------------------------------


def _required(one: Verdict, found: FoundDesign) -> KeyNumber:
    """Give a row; what no tolerance changes has no probability."""
    p_met = one.p_met if one.quantity in {row.quantity for row in found.influences} else None
    sides = (("at least", one.low), ("at most", one.high))
    bounds = [f"{side} {bound:g}" for side, bound in sides if bound is not None]
    return KeyNumber(
        name=_name(one.quantity),
        unit=_unit(one.unit),
        value=_known(one.value),
        required=", ".join(bounds),
        margin=_known(one.margin),
        p_met=None if p_met is None else p_met.value,
        met=one.decision,
        note=one.words,
        p_low=None if p_met is None else p_met.low,
        p_asked=None if p_met is None else one.confidence,
    )


def _others(found: FoundDesign, measured: Measured) -> Iterator[KeyNumber]:
    """Give what nothing requires, as far as it is known."""
    required = {one.quantity for one in found.verdicts}
    for name, quantity in QUANTITIES.items():
        if name not in required and math.isfinite(measured.of(name)):
            yield KeyNumber(_name(name), _unit(quantity.units), measured.of(name), note=quantity.long_name)


def _name(quantity: str) -> str:
    words = words_of(quantity)
    return words[:1].upper() + words[1:]


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _named(quantity: str) -> str:
    """Give the words of a quantity and its unit."""
    if quantity not in QUANTITIES:
        return ""
    unit = _unit(QUANTITIES[quantity].units)
    return f"{words_of(quantity)}, {unit}" if unit else words_of(quantity)


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


# --- what to buy and to cut ---------------------------------------------------------------------------------------


def _made_of(task: Task, one: Candidate, found: FoundDesign) -> Mapping[str, str]:
    tendons = 1 if task.space.base.tendon_b is None else 2
    arm, strength = 0.5 * (one.tube.inner_mm - one.wire.diameter_mm), one.wire.breaking_N
    breaks = f", breaks at {strength:.3g} N" if math.isfinite(strength) else ""
    shape = task.space.shape.replace("_", " of a ")
    tolerances = "; ".join(f"{one.name} {one.words}" for one in task.tolerances.each)
    return {
        "Tube": f"Ø{one.tube.outer_mm:g} outside, Ø{one.tube.inner_mm:g} mm inside (a size of: {one.tube.source})",
        "Tendon": f"{tendons} x Ø{one.wire.diameter_mm:g} mm{breaks}, its middle {arm:.3g} mm from the axis "
        f"({one.wire.source})",
        "Cut": f"{one.count} notches, {shape}, {one.depth_mm:.3f} mm deep, {one.width_mm:.3f} mm wide, "
        f"{one.spacing_mm:.3f} mm of metal between two; kerf {task.space.cutting.kerf_mm:g} mm",
        "Tolerances": tolerances or "none given",
        "Files": f"{found.rig}; notchbend export --rig {found.rig} --to dxf --out tube.dxf, "
        "in the folder of this report",
    }


# --- how surely, and what to tighten ------------------------------------------------------------------------------


def _surely(found: FoundDesign) -> str:
    p = found.p_all
    if p is None:
        return "No tolerances were given: how many tubes meet the requirements is not known."
    return (
        f"{100 * p.value:.3g} % of {p.draws:,} tubes simulated with these tolerances meet all of it (95 % interval "
        f"{100 * p.low:.3g} to {100 * p.high:.3g} %; errors of the model not counted)."
    )


def _limiting(found: FoundDesign) -> str:
    """Name the quantity that limits a design, of those that tolerances change."""
    changed = [one.quantity for one in found.influences]
    if found.limited_by in changed:
        return found.limited_by
    odds = {one.quantity: one.p_met.value for one in found.verdicts if one.p_met and one.quantity in changed}
    return min(odds, key=lambda name: odds[name]) if odds else ""


def _costs(found: FoundDesign, task: Task, limiting: str) -> Iterator[ToleranceCost]:
    given = {one.name: one.words for one in task.tolerances.each}
    told = {one.tolerance: one for one in found.influences if one.quantity == limiting}
    for row in found.tightened:
        one = told.get(row.tolerance)
        yield ToleranceCost(
            row.tolerance,
            given[row.tolerance],
            row.p_met.value,
            None if one is None else _known(one.change),
            None if one is None else min(one.total, 1.0),
            None if one is None else one.total_within,
        )


def first_words(found: FoundDesign) -> Iterator[str]:
    """Say what to tighten first, or why nothing has to be; nothing without tolerances."""
    missed = [_name(one.quantity) for one in found.verdicts if one.decision in ("not met", "not known")]
    if missed:
        yield f"No tolerance mends what the drawing misses: {', '.join(missed)}."
    elif found.p_all is not None and found.tightened:
        best, now = found.tightened[0], found.p_all.value
        if best.p_met.value - now >= WORTH:
            yield (
                f"Tighten {best.tolerance} first: half as wide, P(all met) rises from {100 * now:.3g} to "
                f"{100 * best.p_met.value:.3g} %."
            )
        else:
            yield "Nothing has to be tightened: no tolerance half as wide raises P(all met) by one in a hundred."
        limiting = _limiting(found)
        told = [one for one in found.influences if one.quantity == limiting]
        if told:
            most = max(told, key=lambda one: one.total)
            yield (
                f"{_name(limiting)} leaves the least room of what tolerances change. Most of its spread is from "
                f"{most.tolerance} (Sobol index {min(most.total, 1.0):.2f}): from one standard deviation below to one "
                f"above, {most.change:+.3g} {_unit(most.unit)}".rstrip()
                + "."
            )


def _rests_on(task: Task, rig: Rig, measured: Measured) -> Iterator[str]:
    """Say what the numbers rest on, in the order in which a reader has to doubt them."""
    law, metal = rig.superelastic, f"E {rig.material.youngs_modulus_GPa:g} GPa"
    if law is not None:
        metal = f"superelastic Nitinol, {metal}, plateaus {law.plateau_MPa:g} and {law.unloading_plateau_MPa:g} MPa"
    yield (
        f"Metal and friction: {metal}, capstan coefficient {rig.friction.capstan_coefficient:g}, of the requirement "
        "file or by default. Bend a sample of your tube before you rely on them."
    )
    required = task.requirements.names
    room = task.requirements.each[0].margin(measured.bend_deg)
    near = f" The margin of the bend, {room:.3g} deg, is of that size." if 0 <= room < 2 * MODEL_DEG[1] else ""
    yield MODEL + near
    given = {one.name for one in task.tolerances.each}
    silent = ("preload_N",) * (rig.tendon_b is None) + ("plateau_MPa",) * (rig.superelastic is None)
    exact = [name for name in CHANGES if name not in given and name not in silent]
    if given and exact:
        yield f"Taken as exact, because no tolerance was given: {', '.join(exact)}."
    if measured.closing_bend_deg < task.use.bend_deg:
        yield f"{CLOSED}{_divided(task, measured)}."
    if measured.tendon_strain_percent > WIRE_PERCENT and "tendon_strain_percent" not in required:
        yield (
            "The tendon counts as a cable without bending stiffness. A solid wire of its diameter would be strained by "
            f"{measured.tendon_strain_percent:.2g} % at the required bend: take a stranded one, or require a "
            "tendon_strain_percent."
        )
    if task.use.life is None and rig.superelastic is not None:
        yield LIFE


def _divided(task: Task, measured: Measured) -> str:
    """Say whether a required tip stiffness is met by the least that it may be."""
    least = task.requirements.bound("tip_stiffness_N_per_mm", "low")
    if least is None:
        return ""
    kept = measured.tip_stiffness_N_per_mm / TOO_STIFF >= least
    return f"; a quarter of it {'still meets' if kept else 'would miss'} what is required"

"""The numbers that a tube is decided by: bend, reach, closing, tension, stiffness at the tip, and what changes them.

They are those of the compiled chain on the way from rest to a drive. The tip is probed by a small dead force against
the bend, across the tip's heading, that acts from the start, so that the guides slide as they do under way.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fem_models.chain import solve_chain
from fem_models.drawings import side_view_svg
from fem_models.joint import joint_mechanics, joint_row
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.effects import TipLoad
from fem_models.rig.joints import Notch, NotchedTube
from fem_models.rig.rig import notched_tube, with_notch, with_number
from hysteresis.arrays import Floats
from hysteresis.attempts import attempt
from hysteresis.files import write_files
from studies.results import write_result
from studies.results.page_one import DRAWING, FILE, KeyNumber, PageOne, Tightening
from studies.results.run import RunLoop

SAMPLES = 41
PROBE = 0.05
"""Force at the tip over the tension times its arm over the length."""
CUT_MM = 0.02
"""Change of a cut or a wall: what laser and wire leave open."""
_SHARE = 0.05


@dataclass(frozen=True)
class _Way:
    """The way from rest to a drive, arrays of shape (m,), and ``tip_mm`` (m, 2)."""

    drive_mm: Floats
    bend_deg: Floats
    tension_N: Floats
    tip_mm: Floats
    notches_deg: Floats
    strain_percent: float

    def tension_at(self, bend_deg: float) -> float:
        """Tension at a bend; NaN beyond the largest one."""
        rising = np.maximum.accumulate(self.bend_deg)
        return float(np.interp(bend_deg, rising, self.tension_N, right=math.nan))


def page_one(rig: Rig, drive_mm: float, loop: RunLoop | None, notes: list[str]) -> PageOne:
    """Take the numbers of the first page of a rig that is driven to ``drive_mm``.

    What cannot be found is left out, and a line in ``notes`` says why. ``loop`` gives width and strain limits.
    """
    way = attempt("no numbers of the first page", lambda: _way(rig, drive_mm), None, notes)
    rows = [] if way is None else [*_rows(rig, way, loop), *_of_tip(rig, drive_mm, way, notes)]
    tighten = () if way is None else tuple(_tightenings(rig, drive_mm, way))
    return PageOne(
        at=f"on the way from rest to {drive_mm:g} mm" + (f" at {rig.preload_N:g} N" if rig.preload_N else ""),
        rows=tuple(rows),
        tighten=tighten,
        first=tuple(_first(tighten)),
        derived=derived(rig),
    )


def write_page_one(rig: Rig, drive_mm: float, loop: RunLoop | None, out: Path, notes: list[str]) -> None:
    """Write ``page-one.json`` and, of a notched tube, ``drawing.svg`` into a folder of results.

    Raises
    ------
    RecordError
        A folder that cannot be written to.
    """
    page = page_one(rig, drive_mm, loop, notes)
    if isinstance(rig.joint, NotchedTube):
        write_files({out / DRAWING: side_view_svg(rig)})
        page = replace(page, drawing=DRAWING)
    write_result(out / FILE, page)


def derived(rig: Rig) -> dict[str, float]:
    """Give numbers of the joints that follow from those of a rig, by name; of notches that differ, the first one's."""
    joint, row = joint_mechanics(replace(rig, joint=rig.joint.of_joint(0))), rig.joint
    found = {"length_mm": row.length_mm, "joint.bending_stiffness_Nmm_per_rad": joint.flexure.bending_Nmm_per_rad}
    if isinstance(row, NotchedTube):
        found |= {
            "joint.neutral_offset_mm": joint.flexure.neutral_offset_mm,
            "joint.bending_length_mm": joint.bending_length_mm,
            "joint.closes_at_deg": math.degrees(joint.closure_angle_rad),
        }
    return found | {"joint.arm_of_tendon_a_mm": joint.arms_mm.a}


def _way(rig: Rig, drive_mm: float) -> _Way:
    run = solve_chain(rig, LoadProgram(np.linspace(0.0, drive_mm, SAMPLES)))
    record = run.record
    assert record.notches_deg is not None
    assert record.tension_a_N is not None
    assert record.tip_mm is not None
    strain = math.nan
    if rig.superelastic is None:
        strain = 100 * float(np.abs(run.peak_strain).max())
    return _Way(record.drive, record.angle_deg, record.tension_a_N, record.tip_mm, record.notches_deg, strain)


def _rows(rig: Rig, way: _Way, loop: RunLoop | None) -> Iterator[KeyNumber]:
    bend, length, tension = float(way.bend_deg[-1]), rig.length_mm, float(way.tension_N.max())
    yield KeyNumber("Bend", "deg", bend, note=f"of the tip, over {length:.3g} mm of notched tube")
    if bend > 0:
        yield KeyNumber("Bending radius", "mm", length / math.radians(bend), note="length over bend")
    yield KeyNumber(
        "Reach across", "mm", float(np.abs(way.tip_mm[:, 1]).max()), note="of the tip, from the straight axis"
    )
    yield _closing(rig, way)
    if loop is not None:
        share = 100 * loop.loop_width_deg / loop.full_scale_deg if loop.full_scale_deg else 0.0
        words = f"at {loop.widest_at_drive_mm:.3g} mm; {share:.2g} % of full scale"
        yield KeyNumber("Loop width", "deg", loop.loop_width_deg, note=words)
    stretch = 100 * tension / rig.tendon_a.EA_N
    words = f"at the wheel; it strains the tendon by {stretch:.2g} % of its length (EA {rig.tendon_a.EA_N:g} N)"
    yield KeyNumber("Largest tension", "N", tension, note=words)
    yield KeyNumber(
        "Tension over the tendon's strength", "%", 100 * stretch / _YIELD_PERCENT,
        note=f"strength taken as EA times {_YIELD_PERCENT:g} %: cold-drawn steel yields below that; for another wire "
        "compare the tension with its breaking load",
    )  # fmt: skip
    if loop is not None and loop.strain_limits:
        yield _strain(loop)


_YIELD_PERCENT = 2.0


def _closing(rig: Rig, way: _Way) -> KeyNumber:
    """Bend at which the first notch closes, in proportion to the bend so far."""
    row = joint_row(rig)
    closes = row.of("closure_angle_rad")
    if not np.isfinite(closes).all():
        return KeyNumber("Notches close at", "deg", None, note="measured joints: their notches are not known")
    share = float((np.abs(np.radians(way.notches_deg)).max(axis=0) / closes).max())
    if share <= 0:
        return KeyNumber("Notches close at", "deg", None, note="no notch bends")
    bend = float(np.abs(way.bend_deg).max())
    each = math.degrees(float(closes.min()))
    words = f"bend of the tip at which the first notch closes; it does at {each:.3g} deg"
    if share > 1:
        words += ": it closes on the way"
    return KeyNumber("Notches close at", "deg", bend / share, margin=bend / share - bend, note=words)


def _strain(loop: RunLoop) -> KeyNumber:
    worst = loop.strain_limits[0]
    state = "passed" if worst.passed_at_mm is not None else "kept"
    return KeyNumber(
        "Strain of the flexures", "%", loop.peak_strain_percent,
        note=f"largest in the loop; lowest limit: {worst.name}, {worst.limit_percent:.3g} % {worst.kind}, {state} "
        f"with {worst.largest_percent:.2g} %",
    )  # fmt: skip


def _of_tip(rig: Rig, drive_mm: float, way: _Way, notes: list[str]) -> list[KeyNumber]:
    """Stiffness and force across the tip."""
    if rig.tip_load is not None or rig.tip_stop is not None:
        return []
    bend, arm = float(way.bend_deg[-1]), joint_mechanics(replace(rig, joint=rig.joint.of_joint(0))).arms_mm.a
    load = PROBE * float(way.tension_N[-1]) * arm / rig.length_mm
    if not load > 0:
        return []
    pushed = replace(rig, tip_load=TipLoad(load, bend - 90.0))
    found = attempt("no stiffness of the tip", lambda: _way(pushed, drive_mm), None, notes)
    if found is None:
        return []
    across = np.array([-math.sin(math.radians(bend)), math.cos(math.radians(bend))])
    moved = float((way.tip_mm[-1] - found.tip_mm[-1]) @ across)
    beyond = _way_beyond(pushed, drive_mm, bend)
    rows = []
    if moved > 0:
        note = "across the tip, the drive held, with guides that slide"
        rows.append(KeyNumber("Tip stiffness", "N/mm", load / moved, note=note))
    more = math.nan if beyond is None else beyond.tension_at(bend) - way.tension_at(bend)
    if more > 0:
        note = "held across the tip at the same bend, for 1 N more at the wheel"
        rows.append(KeyNumber("Tip force", "N per N", load / more, note=note))
    return rows


def _way_beyond(rig: Rig, drive_mm: float, bend_deg: float) -> _Way | None:
    """Drive far enough for a bend, as a load asks for more."""
    for more in (1.1, 1.3, 1.6):
        try:
            way = _way(rig, more * drive_mm)
        except (RigError, SolverError):
            return None
        if way.bend_deg.max() >= bend_deg:
            return way
    return None


# --- what to tighten ----------------------------------------------------------------------------------------------


def _changes(rig: Rig) -> Iterator[tuple[str, str, Callable[[], Rig]]]:
    """Small changes of what a workshop or a datasheet leaves open: name, change, and the rig that has it."""
    if isinstance(rig.joint, NotchedTube):
        for name in ("depth_mm", "width_mm"):
            yield f"notch.{name}", f"+{CUT_MM:g} mm", lambda name=name: with_notch(rig, _wider(rig, name))  # type: ignore[misc]
        inner = notched_tube(rig).tube.inner_diameter_mm
        yield (
            "tube.inner_diameter_mm",
            f"+{CUT_MM:g} mm",
            lambda: with_number(rig, "tube.inner_diameter_mm", inner + CUT_MM),
        )
    shares = ["material.youngs_modulus_GPa", "tendon_a.moment_arm_mm", "tendon_a.EA_N"]
    shares += ["superelastic.plateau_MPa"] if rig.superelastic is not None else []
    shares += ["friction.capstan_coefficient"] if rig.friction.capstan_coefficient else []
    for name in shares:
        yield name, f"+{100 * _SHARE:g} %", lambda name=name: _more(rig, name)  # type: ignore[misc]


def _more(rig: Rig, name: str) -> Rig:
    part, key = name.split(".")
    changed = with_number(rig, name, (1 + _SHARE) * float(getattr(rig.parts()[part], key)))
    if part == "tendon_a" and rig.tendon_b is not None:  # both tendons are of one make
        changed = with_number(changed, f"tendon_b.{key}", (1 + _SHARE) * float(getattr(rig.tendon_b, key)))
    return changed


def _wider(rig: Rig, name: str) -> Notch:
    notch = notched_tube(rig).notch
    value = getattr(notch, name)
    more = tuple(one + CUT_MM for one in value) if isinstance(value, tuple) else value + CUT_MM
    spacing = notch.spacing_mm
    if name == "width_mm":  # the pitch stays
        less = tuple(one - CUT_MM for one in spacing) if isinstance(spacing, tuple) else spacing - CUT_MM
        return replace(notch, width_mm=more, spacing_mm=less)
    return replace(notch, depth_mm=more)


def _tightenings(rig: Rig, drive_mm: float, way: _Way) -> list[Tightening]:
    closing = _closing(rig, way).value
    bend = 0.95 * min(float(way.bend_deg.max()), math.inf if closing is None else closing)  # both have a tension there
    found = []
    for name, change, make in _changes(rig):
        try:
            other = _way(make(), drive_mm)
        except (RigError, SolverError):
            found.append(Tightening(name, change, None, None, None))
            continue
        tension, before = other.tension_at(bend), way.tension_at(bend)
        found.append(
            Tightening(
                name,
                change,
                float(other.bend_deg[-1] - way.bend_deg[-1]),
                _percent(tension, before),
                _percent(other.strain_percent, way.strain_percent),
            )
        )
    return sorted(found, key=lambda one: -abs(one.tension_percent or math.inf))


def _percent(value: float, before: float) -> float | None:
    share = 100 * (value / before - 1) if before else math.nan
    return share if math.isfinite(share) else None


def _first(rows: Sequence[Tightening]) -> Iterator[str]:
    """Say what to tighten first."""
    known = [one for one in rows if one.tension_percent is not None and one.bend_deg is not None]
    cuts = [one for one in known if one.name.startswith(("notch.", "tube."))]
    for one in [one for one in rows if one.bend_deg is None]:
        yield f"{one.name} {one.change}: the rig cannot be made or driven so: leave it more room."
    if cuts:
        worst = max(cuts, key=lambda one: abs(one.tension_percent or 0.0))
        yield (
            f"Tighten {worst.name} first: {worst.change} changes the tension at the same bend by "
            f"{worst.tension_percent:+.2g} %, and the bend at the same drive by {worst.bend_deg:+.2g} deg."
        )

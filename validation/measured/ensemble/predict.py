"""What the ensemble of du2018 predicts, and which one measurement would narrow its ranges most."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain import solve_chain
from fem_models.load import triangle
from fem_models.rig import Rig
from fem_models.rig.checks import ClosedNotchError
from fem_models.rig.effects import TipLoad
from hysteresis.arrays import Floats
from validation.measured.preset_du2018 import AMPLITUDE_MM
from validation.measured.readings.loops import static_loop
from validation.separation import loop_program
from validation.separation.ensemble import gathered, left_by, range_of, separate_each

PRELOAD_N = 20.0
"""Of all that names no preload: the one that the paper studies further."""
WIDTHS: Mapping[str, tuple[float, float]] = {
    "width at 5 N, deg": (5.0, AMPLITUDE_MM),
    "width at 15 N, deg": (15.0, AMPLITUDE_MM),
    "width at 30 N, deg": (30.0, AMPLITUDE_MM),
    "width at 1.1 mm, 10 N, deg": (10.0, 1.1),
    "width at 1.1 mm, 20 N, deg": (20.0, 1.1),
}
"""Preload and amplitude of loops that no constant was fitted to."""
PLAY_READ = "load cell, 0.05 N at 10 N/mm: 0.005 mm"
TIP_N = 0.2
"""Load on the tip, against positive angles."""


@dataclass(frozen=True)
class Candidate:
    """A measurement on the rig: what it would read on every member, shape (members,), and its error."""

    values: Floats
    error: float
    how: str


def predicted_widths(rigs: Sequence[Rig]) -> dict[str, Floats]:
    """Largest widths of :data:`WIDTHS` over the rigs, deg, shape (members,) each; NaN where a notch would close."""
    return {
        name: np.array([_width_deg(replace(rig, preload_N=preload), amplitude) for rig in rigs])
        for name, (preload, amplitude) in WIDTHS.items()
    }


def _width_deg(rig: Rig, amplitude_mm: float) -> float:
    try:
        return float(static_loop(rig, amplitude_mm).width_deg.max())
    except ClosedNotchError:
        return float("nan")


def predicted_shares(rigs: Sequence[Rig], *, threads: int | None = None) -> dict[str, Floats]:
    """Shares of energy and width at 20 N over the rigs, shape (members,) each."""
    program = loop_program(-AMPLITUDE_MM, AMPLITUDE_MM)
    found = separate_each([replace(rig, preload_N=PRELOAD_N) for rig in rigs], program, threads=threads)
    out = {}
    for quantity, word in (("dissipated_mJ", "energy"), ("width_deg", "width")):
        for part, values in gathered(found, quantity).items():
            if part != "interaction":
                out[f"{part.replace('_', ' ')}, share of {word}"] = values
    return out


@dataclass(frozen=True)
class _Readings:
    """What load cells and a camera would read on one rig at 20 N."""

    pulling_N: float
    holding_N: float
    tip_N: float
    friction_N: float
    tip_deg: float
    strain_percent: float


def _readings(rig: Rig) -> _Readings:
    rig = replace(rig, preload_N=PRELOAD_N)
    program = triangle(AMPLITUDE_MM)
    solution = solve_chain(rig, program)
    tension, drive = solution.segment_tensions_N, program.drive_mm
    quarter = (drive.size - 1) // 5
    force = tension[:, 0, 0] - tension[:, 1, 0]
    k = 3 * quarter + int(np.argmax(drive[3 * quarter :]))
    middle = np.flatnonzero(np.abs(drive) < 1e-9)[1:]  # of the closed cycle: down, then up
    loaded = replace(rig, tip_load=TipLoad(TIP_N))
    bent = solve_chain(loaded, triangle(0.1, step_mm=0.1)).record.angle_deg[0]
    return _Readings(
        pulling_N=float(tension[k, 0, 0]),
        holding_N=float(tension[k, 1, 0]),
        tip_N=float(tension[k, 0, -1]),
        friction_N=float(0.5 * (force[middle[1]] - force[middle[0]])),
        tip_deg=float(-bent),
        strain_percent=100 * float(np.abs(solution.peak_strain).max()),
    )


def measurements(rigs: Sequence[Rig], widths: Mapping[str, Floats]) -> dict[str, Candidate]:
    """Measurements that a laboratory can make on the rig or its parts, with usual errors."""
    read = [_readings(rig) for rig in rigs]

    def of(name: str) -> Floats:
        return np.array([getattr(one, name) for one in read])

    def part(value: object) -> Floats:
        return np.asarray(value, dtype=float)

    play = part([0.0 if rig.backlash is None else rig.backlash.left_mm(PRELOAD_N) for rig in rigs])
    arms = part([rig.tendon_a.moment_arm_mm for rig in rigs])
    stiffness = part([rig.tendon_a.EA_N for rig in rigs])
    stretch = part(
        [np.log(rig.tendon_a.free_length_mm * (1 + rig.tendon_a.toe_N / 10) / rig.tendon_a.EA_N) for rig in rigs]
    )
    depth = part([rig.joint.cut.depth_mm for rig in rigs])  # type: ignore[union-attr]
    return {
        "tension at the wheel at full drive, pulling": Candidate(of("pulling_N"), 0.2, "load cell, 0.2 N"),
        "tension at the wheel at full drive, the other": Candidate(of("holding_N"), 0.2, "load cell, 0.2 N"),
        "tension at the tip at full drive": Candidate(of("tip_N"), 0.2, "load cell at the tip, 0.2 N"),
        "half the force loop of the wheel at zero drive": Candidate(of("friction_N"), 0.1, "load cells, 0.1 N"),
        f"turn of the tip under {TIP_N:g} N": Candidate(of("tip_deg"), 0.05, "camera, 0.05 deg"),
        "motion of the motor that changes no tension, after a reversal": Candidate(play, 0.005, PLAY_READ),
        **{
            f"loop, {name.removesuffix(', deg')}": Candidate(values, 0.05, "camera, 0.05 deg")
            for name, values in widths.items()
        },
        "moment arm": Candidate(arms, 0.02, "microscope, 0.02 mm"),
        "notch depth": Candidate(depth, 0.01, "microscope, 0.01 mm"),
        "EA of the tendon": Candidate(np.log(stiffness), 0.03, "tensile test, 3 %"),
        "compliance of a free tendon at 10 N": Candidate(stretch, 0.03, "pull on one tendon, 3 %"),
    }


def narrowing(candidates: Mapping[str, Candidate], wanted: Mapping[str, Floats]) -> dict[str, dict[str, float]]:
    """Part of each range that is left after each measurement, by measurement and wanted number."""
    return {
        name: {target: left_by(one.values, values, one.error) for target, values in wanted.items()}
        for name, one in candidates.items()
    }


def relative_width(name: str, values: Floats) -> float:
    """Width of a range: of a share as it is, of any other number over its median."""
    found = range_of(values)
    return found.width if "share" in name else found.width / abs(found.median)

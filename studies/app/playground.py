"""Sliders on the numbers of a rig, and the loop and the tube that the chain computes from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain.solve import solve_chain
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import with_number
from fem_models.view.manipulator import tendon_lines
from hysteresis.arrays import Ints
from hysteresis.records.metrics import loop_width
from hysteresis.records.record import Record
from studies.app.advice import warnings_of
from studies.app.loop_svg import Curves, Plot, less_backbone
from studies.app.scene import MeshState, mesh_of
from studies.report.tube import coarse_surface
from studies.report.wrist_plots import in_plane
from validation.separation import loop_program

AMPLITUDE = "amplitude_mm"
SHALLOWEST = 0.25
"""Least depth of a notch that a slider reaches, over the diameter of the tube."""


@dataclass(frozen=True)
class Slider:
    """A number that can be changed.

    ``name`` is dotted as in :func:`fem_models.rig.rig.numeric_fields`, or ``amplitude_mm``.
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    start: float

    @property
    def key(self) -> str:
        """The name as an identifier."""
        return self.name.replace(".", "_")

    @property
    def decimals(self) -> int:
        """Digits after the point that a step changes."""
        return max(0, -math.floor(math.log10(self.step)))


@dataclass(frozen=True)
class Answer:
    """What follows from the sliders.

    ``records`` are those that are saved, by the endings of their names; ``figures``: words and values with units;
    ``mesh``: the tube and its tendons for the browser. ``directions_deg`` of a rig in space are those of the planes of
    its loops, from y towards z.
    """

    rig: Rig
    records: Mapping[str, Record]
    figures: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]
    plots: tuple[Plot, ...]
    mesh: MeshState
    directions_deg: tuple[float, ...] = ()

    def beside(self, measured: Record) -> tuple[Curves | None, ...]:
        """Give the curves of a measured record, one for each plot.

        Of a rig in space: the loop of a wheel that moves alone, and the tip.
        """
        if self.rig.is_planar:
            return (measured.drive, measured.angle_deg), less_backbone(measured)
        drives = (measured.drive, measured.drive_2, measured.drive_3, measured.drive_4)
        moving = [k for k, drive in enumerate(drives) if drive is not None and np.ptp(drive) > 0]
        out: list[Curves | None] = [None, None] * len(self.directions_deg)
        alone = moving[0] if len(moving) == 1 and measured.angle_2_deg is not None else len(drives)
        if alone < len(self.directions_deg) and (drive := drives[alone]) is not None:
            one = replace(in_plane(measured, self.directions_deg[alone]), drive=drive)
            out[2 * alone : 2 * alone + 2] = [(one.drive, one.angle_deg), less_backbone(one)]
        tip = measured.tip_mm
        return (*out, None if tip is None or tip.shape[1] < 3 else (tip[:, 1], tip[:, 2]))


def sliders(rig: Rig, amplitude_mm: float) -> tuple[Slider, ...]:
    """Give the sliders of a rig, around its own numbers; those of the notch only if it has one."""
    out = [
        Slider("preload_N", "Preload", "N", min(1.0, rig.preload_N), max(40.0, 2 * rig.preload_N), 0.5, rig.preload_N)
    ]
    if isinstance(rig.joint, NotchedTube):
        notch = rig.joint.notch.at(0)
        tube = rig.joint.tube
        limit = tube.outer_diameter_mm / (1 if rig.joint.one_sided else 2)
        wall = (tube.outer_diameter_mm - tube.inner_diameter_mm) / 2
        root = notch.root_width_mm or 0.0
        if not isinstance(rig.joint.notch.depth_mm, tuple):
            least = max(SHALLOWEST * tube.outer_diameter_mm, wall)  # a cut that stays in the wall is no notch
            low, high = _around(notch.depth_mm, least, 0.99 * limit, 0.005)
            out.append(Slider("notch.depth_mm", "Notch depth", "mm", low, high, 0.005, notch.depth_mm))
        if not isinstance(rig.joint.notch.width_mm, tuple):
            low, high = _around(notch.width_mm, root + 0.1 * notch.width_mm, 2 * notch.width_mm, 0.02)
            out.append(Slider("notch.width_mm", "Notch width", "mm", low, high, 0.02, notch.width_mm))
    sheath, capstan = rig.friction.sheath_N, rig.friction.capstan_coefficient
    out.append(Slider("friction.sheath_N", "Sheath friction", "N", 0.0, max(4.0, 2 * sheath), 0.01, sheath))
    out.append(
        Slider("friction.capstan_coefficient", "Capstan friction", "", 0.0, max(0.3, 2 * capstan), 0.005, capstan)
    )
    out.append(
        Slider(
            AMPLITUDE, "Amplitude", "mm", round(0.1 * amplitude_mm, 2), round(1.6 * amplitude_mm, 2), 0.02, amplitude_mm
        )
    )
    return tuple(out)


def _around(start: float, low: float, high: float, step: float) -> tuple[float, float]:
    """Give ends that are whole steps from the start, within ``low`` to ``high``."""
    down, up = np.floor((start - low) / step + 1e-9), np.floor((high - start) / step + 1e-9)
    return round(float(start - max(0.0, down) * step), 6), round(float(start + max(0.0, up) * step), 6)


def outer_mm(rig: Rig) -> float:
    """Give the diameter at which a rig is drawn: that of the tube, or of the circle of its tendons."""
    return rig.joint.tube.outer_diameter_mm if isinstance(rig.joint, NotchedTube) else 2 * rig.tendon_a.moment_arm_mm


def with_values(rig: Rig, values: Mapping[str, float]) -> Rig:
    """Change numbers of the rig by their dotted names.

    Raises
    ------
    RigError
        A rig that is not possible.
    """
    for name, value in values.items():
        rig = with_number(rig, name, value)
    return rig


def closed_cycle(record: Record) -> Ints:
    """Give the samples of the last cycle of a record of :func:`validation.separation.loop_program`, and its start."""
    assert record.cycle is not None
    last = np.flatnonzero(record.cycle == record.cycle[-1])
    return np.append(last[0] - 1, last)


def answer(rig: Rig, values: Mapping[str, float]) -> Answer:
    """Run a cycle of the rig with the values of the sliders.

    Raises
    ------
    RigError, SolverError
        A rig that is not possible, or cannot follow the drive; one line.
    """
    amplitude = float(values[AMPLITUDE])
    moved = with_values(rig, {name: float(value) for name, value in values.items() if name != AMPLITUDE})
    low = 0.0 if rig.tendon_b is None else -amplitude
    solution = solve_chain(moved, loop_program(low, amplitude))
    record = solution.record
    assert record.cycle is not None
    assert record.notches_deg is not None
    if not np.isfinite(record.angle_deg).all():
        raise SolverError(f"rig {rig.name}: angles that are not finite")
    closed = closed_cycle(record)
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    work = float(solution.wheel_work_mJ[-1] - solution.wheel_work_mJ[closed[0]])
    tension = solution.segment_tensions_N[:, : len(rig.tendons)]
    strain = 100 * float(np.abs(solution.peak_strain).max())
    figures = [
        ("Largest angle", f"{np.abs(record.angle_deg).max():.2f} deg"),
        ("Largest loop width", f"{width.max_deg:.2f} deg"),
        ("Loss in a cycle", f"{work:.2f} mJ"),
        ("Tension", f"{tension.min():.1f} to {tension.max():.1f} N"),
    ]
    if np.isfinite(strain):
        figures.append(("Peak strain", f"{strain:.2f} %"))
    bent = record.notches_deg[int(record.angle_deg.argmax())]
    return Answer(
        rig=moved,
        records={"": record},
        figures=tuple(figures),
        warnings=tuple(warnings_of(moved, solution)),
        plots=loop_plots(record, "bending angle, deg", "angle less its backbone, deg"),
        mesh=mesh_of(coarse_surface(moved, bent), tendon_lines(moved, bent), outer_mm(moved)),
    )


def loop_plots(record: Record, whole: str, bare: str) -> tuple[Plot, Plot]:
    """Chart the closed cycle of a record, and the same less its backbone; the labels of their angles."""
    closed = closed_cycle(record)
    return (
        Plot("whole", whole, (record.drive[closed], record.angle_deg[closed])),
        Plot("bare", bare, less_backbone(record)),
    )

"""Notches of a rig in space: six stiffnesses from the section and of the solid, and the wrist bent with either."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from fem_models.joint.flexure import elasticity
from fem_models.multibody.spatial import solve_spatial_multibody
from fem_models.rig import Rig
from fem_models.rig.checks import SolverError
from fem_models.rig.rig import notched_tube, with_joint
from fem_models.solid import snr_stiffness, solid_snr
from fem_models.spatial import SpatialSolution, WheelProgram, of_rig_in_space, solve_spatial
from fem_models.spatial.drives import round_axes
from fem_models.spatial.stiffness import NotchStiffness, notch_stiffness, stiffness_of_solid

SOLID, SECTION, MULTIBODY = "chain, solid", "chain, section", "multibody, section"
SAMPLES = 8
REFINEMENT = 0.7
"""Of the meshes: stiffness is 1 to 2 % above that of fine ones at sharp corners (docs/validation/notches.md)."""


@dataclass(frozen=True)
class NotchInBoth:
    """One notch: its stiffnesses from the section and of the solid, Nmm/rad and N/mm, and their ratio, by name.

    The names are those of :class:`fem_models.spatial.stiffness.NotchStiffness`. Both are of a pitch: the bendings and
    the torsion of the section have the ring in series, as in the engines.
    """

    number: int
    depth_mm: float
    width_mm: float
    section: Mapping[str, float]
    solid: Mapping[str, float]
    ratio: Mapping[str, float]


@dataclass(frozen=True)
class BentWrist:
    """The wrist with its wheels at one place: angles and tip by a model."""

    name: str
    bending_deg: tuple[float, float]
    torsion_deg: float
    tip_mm: tuple[float, float, float]


@dataclass(frozen=True)
class SixStiffnesses:
    """All notches of a rig, and the wrist bent by each motion in every model; ``drives_mm`` has the wheels.

    ``notes`` says where a model was left out, because it found no equilibrium.
    """

    rig: str
    notches: tuple[NotchInBoth, ...]
    drives_mm: tuple[tuple[float, ...], ...]
    bent: tuple[tuple[BentWrist, ...], ...]
    notes: tuple[str, ...] = ()


def compare_in_space(
    rig: Rig,
    *,
    amplitude_mm: float,
    refinement: float = REFINEMENT,
    progress: Callable[[str], None] = lambda _: None,
) -> SixStiffnesses:
    """Compare section and solid of every notch, and bend the wrist with both, and in the other engine.

    Parameters
    ----------
    amplitude_mm
        Drive of the wheels: towards y, then towards z.
    refinement
        Of the solids' meshes.

    Raises
    ------
    RigError, SolverError
        From the models; a multibody model that finds no equilibrium is left out.
    """
    metal, known = elasticity(rig.material), dict[Any, NotchStiffness]()
    notches, section = list[NotchInBoth](), of_rig_in_space(rig)
    for k, joint in enumerate(section.joints):
        one = with_joint(rig.in_plane, k)
        if one.joint not in known:
            progress(f"solid, notch {k + 1}")
            known[one.joint] = stiffness_of_solid(snr_stiffness(solid_snr(one, refinement=refinement)).stiffness)
        own, solid = notch_stiffness(notched_tube(one), metal), known[one.joint]
        whole = _with_ring(own, joint.ring)
        ratio = {name: value / getattr(solid, name) for name, value in whole._asdict().items()}
        cut = notched_tube(one).cut
        notches.append(NotchInBoth(k + 1, cut.depth_mm, cut.width_mm, whole._asdict(), solid._asdict(), ratio))
    of_solid = of_rig_in_space(rig, [NotchStiffness(**one.solid) for one in notches])
    axes = round_axes(rig) if rig.wheel_count > 1 else np.ones((1, 1))
    bent, drives, notes = list[tuple[BentWrist, ...]](), list[tuple[float, ...]](), list[str]()
    for axis in axes:
        progress(f"bent wrist, {len(drives) + 1} of {len(axes)}")
        program = WheelProgram(np.linspace(0.0, amplitude_mm, SAMPLES)[:, None] * axis).of_tendons(rig)
        found = [
            _bent(SOLID, solve_spatial(of_solid, program)),
            _bent(SECTION, solve_spatial(section, program)),
        ]
        try:
            found.append(_bent(MULTIBODY, solve_spatial_multibody(section, program)))
        except SolverError as error:
            notes.append(f"{MULTIBODY}: {error}")
        bent.append(tuple(found))
        drives.append(tuple((amplitude_mm * axis).tolist()))
    return SixStiffnesses(rig.name, tuple(notches), tuple(drives), tuple(bent), tuple(notes))


def _with_ring(own: NotchStiffness, ring: tuple[float, float]) -> NotchStiffness:
    """Rotational stiffnesses with the ring in series, as the engines have them."""
    bends, twists = ring

    def series(one: float, other: float) -> float:
        return one * other / (one + other)

    return own._replace(
        weak=series(own.weak, bends), strong=series(own.strong, bends), torsion=series(own.torsion, twists)
    )


def _bent(name: str, run: SpatialSolution) -> BentWrist:
    towards_y, towards_z = run.bending_deg[-1].tolist()
    x, y, z = run.tip_mm[-1].tolist()
    return BentWrist(name, (towards_y, towards_z), float(run.torsion_deg[-1]), (x, y, z))

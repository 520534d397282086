"""Sets of mechanisms that may carry the paper's loop: their constants with bounds, and the rig of a choice of them.

Bounds are the priors of the ensemble where it has the constant. Names are those of a rig file; ``tendon.`` stands for
both tendons, ``ratio.`` for tendon b over tendon a, ``camera.`` for the sensor.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from fem_models.rig import Rig, preset
from fem_models.rig.ensemble import with_constants
from validation.measured.ensemble.priors import COMMON, FLAG, JENKINS, PLAY, TOE, MechanismSet, Prior


def _of(priors: Mapping[str, Prior], *names: str) -> dict[str, Prior]:
    return {name: priors[name] for name in names}


_TUBE = _of(COMMON, "tendon.moment_arm_mm", "tendon.EA_N", "notch.depth_mm")
_SHEATH = _of(COMMON, "friction.sheath_N")
_MODULUS = _of(COMMON, "material.youngs_modulus_GPa")
_ALONG = {
    **_of(COMMON, "friction.capstan_coefficient"),
    "friction.guide_N": Prior(0.001, 0.6, True, "14 guides together below the preload of 10 N; assumed"),
}
_WIDTH = _of(PLAY, "backlash.width_mm")
UNEQUAL: Mapping[str, Prior] = {
    "ratio.moment_arm_mm": Prior(0.95, 1.05, False, "assembly error named by the paper, no number; assumed"),
    "ratio.EA_N": Prior(0.7, 1.4, True, "a splice or a knot; assumed"),
    "slack.tendon_b_mm": Prior(-0.2, 0.2, False, "two steps of the drive; assumed"),
}
DRAG: Mapping[str, Prior] = {
    "drag.sheath_N_s_per_mm": Prior(1e-4, 0.5, True, "up to 7 N at the 13.8 mm/s of the test; assumed"),
    "drag.joint_Nmm_s_per_rad": Prior(1e-3, 10.0, True, "up to 4 Nmm of the 15 of a joint; assumed"),
}
WEAKENING: Mapping[str, Prior] = {
    "stribeck.rise": Prior(0.02, 2.0, True, "static over sliding friction up to 3; assumed"),
    "stribeck.speed_mm_per_s": Prior(0.05, 20.0, True, "between the speeds of the two tests; assumed"),
}
HEATING: Mapping[str, Prior] = {
    "superelastic.heating_time_s": Prior(0.05, 50.0, True, "arcs half a mm wide in still air: seconds; assumed"),
}
CAMERA: Mapping[str, Prior] = {
    "camera.delay_ms": Prior(0.1, 50.0, True, "exposure and transfer of a GigE camera; assumed"),
}
_NO_TOE, _NO_LOOP = {"tendon.toe_N": 0.0}, {"material.loop_share": 0.0}
_BARE = {"friction.guide_N": 0.0, "friction.capstan_coefficient": 0.0}
_J = {**_TUBE, **_SHEATH, **JENKINS}
_F = {**_TUBE, **_SHEATH, **_MODULUS, **FLAG}
SETS: Mapping[str, MechanismSet] = {
    "sheath, Jenkins": MechanismSet(_J, {**_BARE, **_NO_TOE}),
    "sheath, Jenkins, play of the drive": MechanismSet({**_J, **_WIDTH}, {**_BARE, **_NO_TOE}),
    "sheath, Jenkins, play that preload takes up": MechanismSet({**_J, **PLAY}, {**_BARE, **_NO_TOE}),
    "sheath, Jenkins, toe": MechanismSet({**_J, **TOE}, _BARE),
    "sheath, Jenkins, toe, play taken up": MechanismSet({**_J, **TOE, **PLAY}, _BARE),
    "sheath, toe, play taken up, linear metal": MechanismSet(
        {**_TUBE, **_SHEATH, **TOE, **PLAY}, {**_BARE, **_NO_LOOP}
    ),
    "capstan, guides, Jenkins, toe": MechanismSet({**_TUBE, **_ALONG, **JENKINS, **TOE}, {"friction.sheath_N": 0.0}),
    "capstan, guides, Jenkins, toe, play taken up": MechanismSet(
        {**_TUBE, **_ALONG, **JENKINS, **TOE, **PLAY}, {"friction.sheath_N": 0.0}
    ),
    "sheath, flag": MechanismSet(_F, {**_BARE, **_NO_TOE, **_NO_LOOP}),
    "sheath, flag, play of the drive": MechanismSet({**_F, **_WIDTH}, {**_BARE, **_NO_TOE, **_NO_LOOP}),
    "sheath, flag, toe": MechanismSet({**_F, **TOE}, {**_BARE, **_NO_LOOP}),
    "sheath, flag, play taken up": MechanismSet({**_F, **PLAY}, {**_BARE, **_NO_TOE, **_NO_LOOP}),
    "sheath, flag, toe, play taken up": MechanismSet({**_F, **TOE, **PLAY}, {**_BARE, **_NO_LOOP}),
    "sheath, flag and Jenkins, toe, play taken up": MechanismSet({**_F, **JENKINS, **TOE, **PLAY}, _BARE),
    "all friction, Jenkins, toe, play taken up, unequal tendons": MechanismSet(
        {**_J, **_ALONG, **TOE, **PLAY, **UNEQUAL}
    ),
    "sheath, Jenkins, toe, play taken up, drag": MechanismSet({**_J, **TOE, **PLAY, **DRAG}, _BARE),
    "sheath, Jenkins, toe, play taken up, weakening": MechanismSet({**_J, **TOE, **PLAY, **WEAKENING}, _BARE),
    "sheath, Jenkins, toe, play taken up, camera's delay": MechanismSet({**_J, **TOE, **PLAY, **CAMERA}, _BARE),
    "sheath, Jenkins, toe, play taken up, drag, weakening, delay": MechanismSet(
        {**_J, **TOE, **PLAY, **DRAG, **CAMERA, **WEAKENING}, _BARE
    ),
}
"""Sets in the order of the page."""


@dataclass(frozen=True)
class Chosen:
    """A rig, and the sensor that looks at it."""

    rig: Rig
    camera: Mapping[str, float]


def rig_of(constants: Mapping[str, float]) -> Chosen:
    """Build the rig of a choice of constants on the preset du2018.

    Raises
    ------
    RigError
        An impossible rig.
    """
    own = {name: value for name, value in constants.items() if not name.startswith(("ratio.", "camera."))}
    rig = with_constants(preset("du2018"), own)
    ratios = {name.removeprefix("ratio."): value for name, value in constants.items() if name.startswith("ratio.")}
    if ratios:
        change: dict[str, Any] = {name: value * getattr(rig.tendon_a, name) for name, value in ratios.items()}
        rig = replace(rig, tendon_b=replace(rig.tendon_a, **change))
    camera = {name.removeprefix("camera."): v for name, v in constants.items() if name.startswith("camera.")}
    return Chosen(rig, camera)

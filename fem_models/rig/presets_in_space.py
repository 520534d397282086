"""Rigs that bend in two planes and ship with the package, with the source of each of their numbers."""

from __future__ import annotations

from fem_models.rig.checks import RigError
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.layout import Layout
from fem_models.rig.presets import PRESETS, Preset, Source, preset
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel
from hysteresis.messages import as_given

ZHANG2026 = (
    "Zhang, Qiu, Yan, Zeng, Lu and Cheng, Capstan-driven continuum surgical robot: design, modeling, and perception, "
    "arXiv:2608.13396, 2026, as reported by R. Harlan, 15 August 2026"
)


_NOTCHES = 24
_TENDON = Tendon(EA_N=5_500.0, moment_arm_mm=1.56, free_length_mm=150.0)

_ZHANG2026 = Preset(
    rig=Rig(
        name="zhang2026",
        joint=NotchedTube(
            Tube(outer_diameter_mm=3.5, inner_diameter_mm=2.74),
            Notch("rectangular_pair", count=_NOTCHES, depth_mm=1.6, width_mm=0.6, spacing_mm=0.4),
        ),
        material=Material(youngs_modulus_GPa=62.9, poissons_ratio=0.33),
        tendon_a=_TENDON,
        tendon_b=None,
        wheel=Wheel(radius_mm=5.0),
        friction=Friction(capstan_coefficient=0.15),
        preload_N=2.0,
        layout=Layout(
            turns_deg=tuple(90.0 * (k % 2) for k in range(_NOTCHES)),
            angles_deg=(0.0, 180.0, 90.0, 270.0),
            wheels=(1, 1, 2, 2),
        ),
    ),
    sources={
        "tube.outer_diameter_mm": Source("stated", "a notched Nitinol tube of 3.5 mm"),
        "tube.inner_diameter_mm": Source("assumed", "a wall of 0.38 mm; stated is one thinner than 0.4 mm"),
        "notch.count": Source("assumed", "12 in each plane, over 24 mm"),
        "notch.depth_mm": Source("assumed", "webs soft enough for 45 deg below the 9.5 N of the paper's sensors"),
        "notch.width_mm": Source("assumed", "notches of stiff short beams, as stated; no dimension was found"),
        "notch.spacing_mm": Source("assumed", "rings with room for guides"),
        "notch.turn_deg": Source("assumed", "every second notch by 90 deg; stated is bending in two planes"),
        "tendons.angles_deg": Source("assumed", "stated are four channels in a ring; a quarter turn apart"),
        "tendons.wheels": Source("assumed", "opposite tendons on one wheel; stated is one motor for each of them"),
        "precurvature_deg": Source("assumed", "straight at rest"),
        "preload_N": Source("assumed", "stated are sensors for 0 to 9.5 N"),
        "material.youngs_modulus_GPa": Source("taken", "austenite, GitHub confluentmedical/nitinol-design-concepts"),
        "material.poissons_ratio": Source("assumed", "usual for metals of this class"),
        "material.loop_share": Source("assumed", "no loop of the material: none was published"),
        "material.loop_angle_deg": Source("assumed", "no influence at a loop_share of 0"),
        "tendon_a.moment_arm_mm": Source("assumed", "in the middle of the wall; stated are channels in the wall"),
        "tendon_a.EA_N": Source("assumed", "a steel strand, half of it metal; stated are cables of 0.27 mm"),
        "tendon_a.free_length_mm": Source("assumed", "no dimension was found"),
        "tendon_a.toe_N": Source("assumed", "a linear tendon"),
        "wheel.radius_mm": Source("assumed", "only its product with the wheel's angle matters"),
        "friction.capstan_coefficient": Source("assumed", "as of the notched wrists, docs/validation/wrists.md"),
        "friction.guide_N": Source("assumed", "no friction without tension"),
        "friction.sheath_N": Source("assumed", "none beside the capstan's"),
        "friction.rest_wrap_deg": Source("assumed", "tendons run straight from wheel to base"),
        "friction.stick_compliance_mm_per_N": Source("assumed", "guides of metal: they do not give way"),
    },
)

PRESETS_IN_SPACE: dict[str, Preset] = {"zhang2026": _ZHANG2026}


def any_preset(name: str, *, preload_N: float | None = None) -> Rig:
    """Return the rig of a preset, in one plane or in space, at another preload if one is given.

    Raises
    ------
    RigError
        Unknown name, or an impossible preload.
    """
    if name in PRESETS_IN_SPACE:
        return PRESETS_IN_SPACE[name].rig.with_preload(preload_N)
    if name not in PRESETS:
        expected = ", ".join([*PRESETS, *PRESETS_IN_SPACE])
        raise RigError(f"preset = {as_given(name)}: expected one of {expected}")
    return preset(name, preload_N=preload_N)


def sidecar_table_in_space(rig: Rig) -> dict[str, str | float]:
    """Return the ``[rig]`` table of a record made with a rig in space: the name of its preset, and its preload."""
    table: dict[str, str | float] = {"preload_N": rig.preload_N} if rig.preload_N > 0 else {}
    known = PRESETS_IN_SPACE.get(rig.name)
    if known is not None and known.rig.with_preload(rig.preload_N) == rig:
        table = {"preset": rig.name, **table}
    return table

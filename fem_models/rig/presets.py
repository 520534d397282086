"""Rigs that ship with the package, with the source of each of their numbers."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from operator import attrgetter
from typing import Literal

from fem_models.rig.checks import RigError
from fem_models.rig.effects import Closure, Superelastic
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.layout import IN_SPACE
from fem_models.rig.rig import Friction, Material, Rig, Tendon, Wheel
from hysteresis.arguments import checked
from hysteresis.messages import as_given

DU2018 = "Hysteresis analysis of a notched continuum manipulator driven by tendon, Mech. Sci. 9, 2018"


@dataclass(frozen=True)
class Source:
    """Source of a default: stated in the paper, taken from another source, fitted to its numbers, or assumed."""

    kind: Literal["stated", "taken", "fitted", "assumed"]
    note: str


@dataclass(frozen=True)
class Preset:
    """A rig with the source of each number, by its name in :func:`fem_models.rig.rig.numeric_fields`."""

    rig: Rig
    sources: dict[str, Source]


_TENDON = Tendon(EA_N=17_000.0, moment_arm_mm=2.58, free_length_mm=150.0, toe_N=37.2)

_DU2018 = Preset(
    rig=Rig(
        name="du2018",
        joint=NotchedTube(
            Tube(outer_diameter_mm=6.2, inner_diameter_mm=5.64),
            Notch("v_pair", count=14, depth_mm=2.825, width_mm=1.4, spacing_mm=1.2, root_width_mm=0.8),
        ),
        material=Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33, loop_share=0.4, loop_angle_deg=1.9),
        tendon_a=_TENDON,
        tendon_b=_TENDON,
        wheel=Wheel(radius_mm=10.0),
        friction=Friction(capstan_coefficient=0.02, guide_N=0.01, sheath_N=3.49),
        preload_N=20.0,
    ),
    sources={
        "notch.count": Source("stated", "14 single notched rings, section 3.3 of the paper"),
        "precurvature_deg": Source("assumed", "the paper's manipulator is straight at rest"),
        "preload_N": Source("stated", "10 and 20 N, section 3.1 of the paper, which studies 20 N further"),
        "tube.outer_diameter_mm": Source("assumed", "the paper bounds the moment arm only: x/theta <= 2.80 mm"),
        "tube.inner_diameter_mm": Source(
            "assumed", "a tendon of 0.48 mm along the inner wall has the moment arm below"
        ),
        "notch.depth_mm": Source("assumed", "leaves two arcs 0.55 mm wide, soft enough for 45 deg at 2.2 mm"),
        "notch.width_mm": Source("assumed", "V opening that does not close at 45 deg; the V itself is stated"),
        "notch.spacing_mm": Source("assumed", "pitch 2.6 mm, bending length 36 mm"),
        "notch.root_width_mm": Source("assumed", "several passes of a 0.25 mm wire"),
        "material.youngs_modulus_GPa": Source(
            "taken", "upper end of the 40-60 GPa fitted to a notched NiTi tube, GitHub nepacheco/MastersThesis 4f920c7"
        ),
        "material.poissons_ratio": Source("assumed", "usual for metals of this class; enters only the shear"),
        "material.loop_share": Source("assumed", "with loop_angle_deg: the loop is widest at zero drive"),
        "material.loop_angle_deg": Source("assumed", "slips before the middle of the stroke"),
        **{
            f"tendon_{side}.{name}": source
            for side in "ab"
            for name, source in {
                "EA_N": Source("fitted", "full scale 45 deg at 2.2 mm; a stranded steel tendon of 0.48 mm, 47 % metal"),
                "moment_arm_mm": Source(
                    "assumed", "below the paper's bound of 2.80 mm; its value, EA_N and sheath_N compensate each other"
                ),
                "free_length_mm": Source("assumed", "experimental set-up of the paper's Fig. 8, no dimension given"),
                "toe_N": Source(
                    "fitted",
                    "ratio of loop widths at 10 and 20 N, 2 x 3.52 and 2 x 2.21 deg; calibration.md of the docs",
                ),
            }.items()
        },
        "wheel.radius_mm": Source("assumed", "only its product with the wheel's angle matters"),
        "friction.capstan_coefficient": Source("assumed", "small: a larger one widens the loop with preload and bend"),
        "friction.guide_N": Source("assumed", "small compared with the sheath"),
        "friction.sheath_N": Source(
            "fitted", "loop width at 20 N, 2 x 2.21 deg, half widths in the paper; calibration.md of the documentation"
        ),
        "friction.rest_wrap_deg": Source("assumed", "tendons run straight from wheel to base"),
        "friction.stick_compliance_mm_per_N": Source("assumed", "guides of metal: they do not give way"),
    },
)


def _full_widths() -> Preset:
    """Give the preset ``du2018`` of 0.1.0, with the other reading of the paper: its widths as full widths."""
    rig = _DU2018.rig
    tendon = replace(rig.tendon_a, moment_arm_mm=2.64, toe_N=40.0)
    other = replace(
        rig,
        name="du2018-full-widths",
        tendon_a=tendon,
        tendon_b=tendon,
        friction=replace(rig.friction, sheath_N=1.39),
        material=replace(rig.material, loop_angle_deg=2.2),
    )
    fit = Source("fitted", "loop widths at 10 and 20 N, 3.52 and 2.21 deg as full widths; calibration.md of the docs")
    arms = Source("assumed", "below the paper's bound of 2.80 mm; its value and EA_N compensate each other")
    return Preset(
        other,
        {
            **_DU2018.sources,
            **{f"tendon_{side}.moment_arm_mm": arms for side in "ab"},
            **{f"tendon_{side}.toe_N": fit for side in "ab"},
            "friction.sheath_N": fit,
        },
    )


_SLOW_AND_ALIKE = {
    "superelastic.compression_factor": Source("assumed", "alike in tension and compression, as where it was fitted"),
    **{
        f"superelastic.{name}": Source("assumed", "the plateaus are those of the trials: no shift")
        for name in ("temperature_C", "reference_C", "clausius_clapeyron_MPa_per_K")
    },
    "superelastic.fibres_per_side": Source("assumed", "a matter of accuracy, not of the tube"),
    **{
        f"superelastic.{name}": Source("assumed", "slow trials: no influence without heating_time_s")
        for name in ("latent_heat_J_per_g", "heat_capacity_J_per_gK")
    },
}

WRISTS = "GitHub nepacheco/MastersThesis 4f920c7"


def _wrist(range_deg: int, width_mm: float, spacing_mm: float, rest_deg: float, fitted: dict[str, float]) -> Preset:
    """One of the two measured NiTi wrists: five one-sided notches and a single tendon."""
    other = 240 - range_deg
    stated = Source("stated", f"geometry of the {range_deg} deg tube, {WRISTS}")
    fit = Source("taken", f"fitted to notch angles of the {other} deg tube, docs/validation/wrists.md")
    rig = Rig(
        name=f"notched-wrist-{range_deg}",
        joint=NotchedTube(
            Tube(outer_diameter_mm=1.62, inner_diameter_mm=1.40),
            Notch("rectangular", count=5, depth_mm=1.40, width_mm=width_mm, spacing_mm=spacing_mm, rigid_roots=True),
        ),
        material=Material(youngs_modulus_GPa=fitted["E_GPa"], poissons_ratio=0.33),
        tendon_a=Tendon(EA_N=5_000.0, moment_arm_mm=0.60, free_length_mm=200.0),
        tendon_b=None,
        wheel=Wheel(radius_mm=10.0),
        preload_N=0.0,
        precurvature_deg=rest_deg,
        friction=Friction(capstan_coefficient=fitted["mu"]),
        superelastic=Superelastic(
            plateau_MPa=fitted["plateau_MPa"],
            unloading_plateau_MPa=0.5 * fitted["plateau_MPa"],
            transformation_strain=0.06,
            plateau_modulus_GPa=fitted["plateau_modulus_GPa"],
        ),
        closure=Closure(stiffness_Nmm_per_rad=1_000.0),
    )
    sources = {
        **{f"tube.{name}": stated for name in ("outer_diameter_mm", "inner_diameter_mm")},
        **{f"notch.{name}": stated for name in ("count", "depth_mm", "width_mm", "spacing_mm")},
        "precurvature_deg": Source("stated", "mean of the notches without load, training trials"),
        "material.youngs_modulus_GPa": fit,
        "material.poissons_ratio": Source("assumed", "usual for metals of this class; enters only the shear"),
        "material.loop_share": Source("assumed", "no loop in addition to that of the superelastic law"),
        "material.loop_angle_deg": Source("assumed", "no influence at a loop_share of 0"),
        "tendon_a.moment_arm_mm": Source("assumed", "a tendon of 0.2 mm along the inner wall: 0.70 - 0.10 mm"),
        "tendon_a.EA_N": Source("assumed", "a steel wire of 0.2 mm; no influence under load control"),
        "tendon_a.free_length_mm": Source("assumed", "no dimension given; no influence under load control"),
        "tendon_a.toe_N": Source("assumed", "a wire; no influence under load control"),
        "wheel.radius_mm": Source("assumed", "only its product with the wheel's angle matters"),
        "preload_N": Source("stated", "the unloaded wrist is the first sample of every trial"),
        "friction.capstan_coefficient": fit,
        "friction.guide_N": Source("assumed", "no friction without tension"),
        "friction.sheath_N": Source(
            "assumed", "none in addition to the capstan's: it would shift the force by a constant"
        ),
        "friction.rest_wrap_deg": Source("assumed", "the tendon runs straight into the wrist"),
        "friction.stick_compliance_mm_per_N": Source("assumed", "guides of metal: they do not give way"),
        "superelastic.plateau_MPa": fit,
        "superelastic.plateau_modulus_GPa": fit,
        "superelastic.unloading_plateau_MPa": Source(
            "assumed", "half of the loading plateau: only loading was measured"
        ),
        "superelastic.transformation_strain": Source("assumed", "not reached before the notches close"),
        **_SLOW_AND_ALIKE,
        "closure.stiffness_Nmm_per_rad": Source("assumed", "stiff: closed notches deform by less than 0.1 deg"),
    }
    return Preset(rig, sources)


# each tube has the parameters fitted to the other one, so that no preset was fitted to its own tube
_FROM_90 = {"E_GPa": 17.1, "plateau_MPa": 277.0, "plateau_modulus_GPa": 3.97, "mu": 0.125}
_FROM_150 = {"E_GPa": 17.3, "plateau_MPa": 271.0, "plateau_modulus_GPa": 2.78, "mu": 0.175}

PRESETS: dict[str, Preset] = {
    "du2018": _DU2018,
    "du2018-full-widths": _full_widths(),
    "notched-wrist-90": _wrist(90, 0.5, 1.5, 1.57, _FROM_150),
    "notched-wrist-150": _wrist(150, 0.8, 1.2, 2.21, _FROM_90),
}

NAMES_IN_SPACE = ("zhang2026",)
"""Presets of rigs that bend in space: :mod:`fem_models.rig.presets_in_space`."""


@checked
def preset(name: str, *, preload_N: float | None = None) -> Rig:
    """Return the rig of a preset, at another preload if one is given.

    Parameters
    ----------
    name
        One of those that ``notchbend simulate --help`` lists, such as ``"du2018"``.
    preload_N
        Tension of the tendons at rest, N; by default that of the preset.

    Raises
    ------
    RigError
        Unknown name, or an impossible preload; a rig that bends in space, which
        :func:`fem_models.rig.presets_in_space.any_preset` gives.

    Examples
    --------
    >>> nb.preset("du2018", preload_N=10.0).preload_N
    10.0
    """
    if name in NAMES_IN_SPACE:
        raise RigError(f"preset = {name}: the rig {IN_SPACE}")
    if name not in PRESETS:
        raise RigError(f"preset = {as_given(name)}: expected one of {', '.join(PRESETS)}")
    rig = PRESETS[name].rig
    return rig if preload_N is None else replace(rig, preload_N=preload_N)


_BUT_PRELOAD = attrgetter(*(f.name for f in fields(Rig) if f.name != "preload_N"))


def sidecar_table(rig: Rig) -> dict[str, str | float]:
    """Return the ``[rig]`` table of a record made with this rig: the name of its preset, and its preload, if any."""
    table: dict[str, str | float] = {"preload_N": rig.preload_N} if rig.preload_N > 0 else {}
    known = PRESETS.get(rig.name)
    if known is not None and _BUT_PRELOAD(known.rig) == _BUT_PRELOAD(rig):
        table = {"preset": rig.name, **table}
    return table

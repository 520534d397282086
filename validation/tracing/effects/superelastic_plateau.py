"""Nitinol beyond the elastic strain."""

from __future__ import annotations

from dataclasses import replace

from fem_models.rig import Rig, RigError
from fem_models.rig.effects import Superelastic
from hysteresis.arrays import Floats
from validation.tracing.baseline.curve_kernels import transformed
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    RelativeParameter,
    RigForm,
    Scale,
    Values,
)

PLATEAU = FreeParameter("plateau_MPa", "MPa", 20.0, 1e4, 0.05, log=True)
SLOPE = FreeParameter("plateau_modulus_GPa", "GPa", 0.0, 30.0, 0.5)
UNLOADING = FreeParameter("unloading_ratio", "-", 0.05, 1.0, 0.05)
STRAIN = FreeParameter("transformation_strain", "-", 5e-3, 0.5, 0.2, log=True)

_UNSEEN = 0.5  # unloading plateau over the loading one, where nothing unloads
_FLAT = 0.1  # GPa: a plateau that hardly rises
_SPAN = 0.06  # strain of the whole transformation, where no fibre reaches its end


def _rig(rig: Rig, values: Values) -> Rig:
    """Give the metal a plateau; a rig that declares one is refused, since a metal has one."""
    if rig.superelastic is not None:
        raise RigError(
            f"superelastic.plateau_MPa = {rig.superelastic.plateau_MPa}: expected none: a metal has one plateau"
        )
    plateau = values["plateau_MPa"]
    slope = min(values.get("plateau_modulus_GPa", 0.0), 0.9 * rig.material.youngs_modulus_GPa)
    ratio = values.get("unloading_ratio", _UNSEEN)
    span = values.get("transformation_strain", _SPAN)
    return replace(rig, superelastic=Superelastic(plateau, plateau * ratio, span, slope))


def _loaded(scale: Scale, rig: Rig) -> list[Values]:
    """Start also from moduli below the declared one: a linear fit lowers it and says little about that of the metal."""
    return [
        {
            "plateau_MPa": strain * part * rig.material.youngs_modulus_GPa * 1e3,
            "plateau_modulus_GPa": 0.1 * part * rig.material.youngs_modulus_GPa,
            "youngs_modulus_GPa": part * rig.material.youngs_modulus_GPa,
        }
        for part in (0.3, 0.6, 1.0)
        for strain in (0.01, 0.02)
    ]


def _sloped(scale: Scale, rig: Rig) -> list[Values]:
    slope = 0.08 * rig.material.youngs_modulus_GPa
    return [{**start, "plateau_modulus_GPa": slope} for start in (*_starts(scale, rig), *_early(scale))]


def _early(scale: Scale) -> list[Values]:
    return [{"plateau_MPa": part * scale.stress_MPa, "unloading_ratio": 0.6} for part in (0.15, 0.3)]


def _starts(scale: Scale, rig: Rig) -> list[Values]:
    return [{"plateau_MPa": part * scale.stress_MPa, "unloading_ratio": r} for part in (0.5, 0.8) for r in (0.5, 0.9)]


def _ending(scale: Scale, rig: Rig) -> list[Values]:
    """Start from an end of the transformation that a deep bend reaches early or late."""
    flat = [{**start, "plateau_modulus_GPa": _FLAT} for start in _starts(scale, rig)]
    starts = (*flat, *_sloped(scale, rig))
    return [{**start, "transformation_strain": span} for start in starts for span in (0.03, 0.06, 0.12)]


def _flag(f: Floats, curve: CurveContext, values: Values) -> Floats:
    """Change the slope beyond an onset; on the way back the change ends later than it began."""
    return f + values["part"] * transformed(f, values["onset_deg"], values["loop_deg"])


_CURVE = CurveForm(
    (
        RelativeParameter("onset_deg", "angle", 0.05, 1.0, 0.01),
        RelativeParameter("loop_deg", "angle", 0.0, 0.4, 0.01),
        RelativeParameter("part", "-", -0.95, 3.0, 0.01),
    ),
    tuple({"onset_deg": onset, "loop_deg": 0.1, "part": part} for onset in (0.3, 0.6) for part in (-0.1, 0.1)),
    backbone=_flag,
)

EFFECT = Effect(
    name="superelastic_plateau",
    seen="the slope changes beyond a bend, with a loop away from the centre",
    physics="Beyond about 1 % of strain Nitinol transforms at a nearly constant stress, and comes back at a lower one "
    "(flag-shaped law; Auricchio, Taylor, Lubliner 1997, doi 10.1016/S0045-7825(96)01232-7).",
    distinguished_by="Record a larger amplitude. Notches that close curve the other way.",
    rig_forms=(
        RigForm((PLATEAU, UNLOADING), _starts, rig=_rig, needs=frozenset({"wheel"})),
        RigForm((PLATEAU, UNLOADING, SLOPE), _sloped, rig=_rig, needs=frozenset({"wheel"})),
        RigForm((PLATEAU, UNLOADING, SLOPE, STRAIN), _ending, rig=_rig, needs=frozenset({"wheel"}), refines=True),
        RigForm((PLATEAU, SLOPE), _loaded, rig=_rig, needs=frozenset({"force"})),
    ),
    curve_forms=(_CURVE,),
)

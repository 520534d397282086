"""The metal's table: superelastic Nitinol where a rig does not state its own law, with ranges and source."""

from __future__ import annotations

from collections.abc import Mapping

_PLATEAUS = (
    "plateaus at 37 C and 6.52 MPa/K, GitHub confluentmedical/nitinol-design-concepts, 115-open-frame-shape-set; "
    "10 to 37 C"
)
METAL_RANGES: Mapping[str, tuple[float, float, str]] = {
    "superelastic.plateau_MPa": (280.0, 520.0, _PLATEAUS),
    "superelastic.unloading_plateau_MPa": (30.0, 260.0, _PLATEAUS),
    "superelastic.transformation_strain": (0.03, 0.06, "0.046 in the same source; +-0.015 assumed"),
    "superelastic.plateau_modulus_GPa": (0.0, 5.0, "flat, up to what wrists were fitted with: wrists.md"),
}
"""Least and largest value of each constant of the law, by its name in a rig file, and their source.

The values themselves are the defaults of :class:`fem_models.rig.effects.Superelastic`.
"""

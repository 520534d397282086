"""Discretisation error from three meshes: Richardson's value, observed order and grid convergence index (GCI).

The procedure is that of ASME V&V 20 and of Celik et al. (J. Fluids Eng. 130, 2008, doi 10.1115/1.2960953).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

SAFETY = 1.25
"""Factor of safety of the index for studies with three meshes or more (Celik et al., eq. 7)."""


@dataclass(frozen=True)
class Convergence:
    """What three meshes say about the converged value.

    Parameters
    ----------
    order
        Observed order of convergence.
    value
        Richardson's extrapolation to vanishing mesh size.
    error_percent
        Of the finest mesh against ``value``, signed.
    gci_percent
        Half width of the interval around the finest mesh's result in which the converged value is expected.
    asymptotic_ratio
        1 where the index falls from the middle to the finest mesh by the observed order: in the asymptotic range.
    """

    order: float
    value: float
    error_percent: float
    gci_percent: float
    asymptotic_ratio: float


def richardson(sizes: tuple[float, float, float], values: tuple[float, float, float]) -> Convergence:
    """Extrapolate from three meshes, the finest first.

    Parameters
    ----------
    sizes
        Mesh sizes, growing; of unstructured meshes the cube root of volume over elements.
    values
        Results on these meshes.

    Raises
    ------
    ValueError
        Sizes that do not grow, or values that do not converge monotonically: no order can be had of them.
    """
    if not 0 < sizes[0] < sizes[1] < sizes[2]:
        raise ValueError(f"sizes = {sizes}: expected above 0 and growing, the finest mesh first")
    fine, coarse = values[1] - values[0], values[2] - values[1]
    if fine == 0 or coarse / fine <= 0:
        raise ValueError(f"values = {values}: expected monotonic convergence")
    r21, r32 = sizes[1] / sizes[0], sizes[2] / sizes[1]
    order = _order(r21, r32, coarse / fine)
    value = values[0] - fine / (r21**order - 1)
    gci_fine = SAFETY * abs(fine / values[0]) / (r21**order - 1)
    gci_coarse = SAFETY * abs(coarse / values[1]) / (r32**order - 1)
    return Convergence(
        order=order,
        value=value,
        error_percent=100 * (values[0] / value - 1),
        gci_percent=100 * gci_fine,
        asymptotic_ratio=gci_coarse / (r21**order * gci_fine),
    )


def _order(r21: float, r32: float, ratio: float) -> float:
    """Solve p ln r21 = ln ratio + ln((r21^p - 1)/(r32^p - 1)), eq. 5 of Celik et al., by bisection."""

    def excess(p: float) -> float:
        return (r32**p - 1) / (1 - r21**-p) - ratio  # change from coarse to middle over that from middle to fine

    low, high = 1e-6, 1.0
    if excess(low) >= 0:
        raise ValueError(
            f"changes between the meshes in the ratio {ratio:.3g}: expected above {excess(low) + ratio:.3g}"
        )
    while excess(high) < 0:
        high *= 2
        if high > 1e3:
            raise ValueError("no order of convergence below 1000 fits the values")
    while high - low > 1e-12 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0 else (low, middle)
    assert math.isfinite(high)
    return high

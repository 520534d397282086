"""Rigs of notched tubes for tests: the paper's manipulator, slots in pairs, and a one-sided wrist."""

import numpy as np
from scipy.integrate import quad

from fem_models.joint.section import cut_height_mm
from fem_models.rig import Rig
from fem_models.rig.joints import Notch, NotchedTube, Tube
from fem_models.rig.rig import Material, Tendon, Wheel

YOUNG = 60e3  # N/mm^2
SHEAR = YOUNG / (2 * 1.33)


def make_rig(
    shape: str = "v_pair",
    *,
    outer: float = 6.0,
    inner: float = 5.4,
    depth: float = 2.72,
    width: float = 1.2,
    root: float | None = 0.6,
    arm: float = 2.62,
    count: int = 14,
) -> Rig:
    """The paper's manipulator with dimensions that fit it; keywords change one."""
    tendon = Tendon(EA_N=9000.0, moment_arm_mm=arm, free_length_mm=150.0)
    return Rig(
        name="test",
        material=Material(youngs_modulus_GPa=60.0, poissons_ratio=0.33),
        tendon_a=tendon,
        tendon_b=tendon,
        wheel=Wheel(10.0),
        preload_N=20.0,
        joint=NotchedTube(
            Tube(outer, inner), Notch(shape, count, depth, width, 1.4, root if shape == "v_pair" else None)
        ),
    )


V = make_rig()
PAIR = make_rig("rectangular_pair")
WRIST = make_rig("rectangular", outer=1.62, inner=1.40, depth=1.40, width=0.8, arm=0.6, count=5)  # the '150' wrist


def planar(rig: Rig, z: float) -> tuple[float, float, float]:
    """Area, centroid and second moment of the tube cut by planes, by quadrature over chords: no sectors in it."""
    outer, inner = rig.joint.tube.outer_diameter_mm / 2, rig.joint.tube.inner_diameter_mm / 2
    high = float(cut_height_mm(rig.joint, z))
    low = -outer if rig.joint.notch.shape == "rectangular" else -high

    def moment(power: int) -> float:
        def chord(x: float) -> float:
            wall = np.sqrt(max(outer**2 - x**2, 0)) - np.sqrt(max(inner**2 - x**2, 0))
            return 2 * x**power * wall

        inside = [x for x in (-inner, inner) if low < x < high]
        return quad(chord, low, high, points=inside or None, epsabs=1e-12, limit=200)[0]

    area, first, second = (moment(k) for k in range(3))
    return area, first / area, second - first**2 / area

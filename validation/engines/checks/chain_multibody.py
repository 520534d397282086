"""Chain against multibody model: the same rig in both engines, each mechanism alone and all together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fem_models.chain import solve_chain
from fem_models.load import LoadProgram, triangle
from fem_models.multibody import solve_multibody
from fem_models.rig import Rig, preset
from fem_models.rig.effects import (
    Backlash,
    Closure,
    Creep,
    Drag,
    Eccentricity,
    Fatigue,
    Gravity,
    PreloadLoss,
    Slack,
    Stribeck,
    Superelastic,
    TipLoad,
    TipMass,
    TipStop,
)
from fem_models.rig.rig import Friction
from hysteresis.records.metrics import loop_width

_LINEAR_TENDON = replace(preset("du2018-full-widths").tendon_a, toe_N=0.0)
_LOSSLESS = replace(
    preset("du2018-full-widths"),
    friction=Friction(),
    material=replace(preset("du2018-full-widths").material, loop_share=0.0),
    tendon_a=_LINEAR_TENDON,
    tendon_b=_LINEAR_TENDON,
)
_LEAST_LOOP_DEG = 0.02

EFFECTS: dict[str, dict[str, object]] = {
    "slack": {"slack": Slack(tendon_b_mm=0.15)},
    "backlash": {"backlash": Backlash(width_mm=0.1)},
    "preloaded play": {"backlash": Backlash(width_mm=0.4, takes_up_N=5.0)},
    "eccentricity": {"eccentricity": Eccentricity(amplitude_mm=0.1, phase_deg=40.0)},
    "superelastic": {
        "superelastic": Superelastic(plateau_MPa=450.0, unloading_plateau_MPa=200.0, transformation_strain=0.04)
    },
    "closure": {"closure": Closure(stiffness_Nmm_per_rad=20_000.0, angle_deg=2.5)},
    "gravity": {"gravity": Gravity(ring_mass_g=2.0, direction_deg=-90.0)},
    "tip_stop": {"tip_stop": TipStop(y_mm=10.0, stiffness_N_per_mm=5.0)},
    "tip_load": {"tip_load": TipLoad(force_N=0.2, direction_deg=-60.0)},
    "tip_mass": {"tip_mass": TipMass(mass_g=20.0, direction_deg=60.0)},
    "stribeck": {"stribeck": Stribeck(rise=0.6, speed_mm_per_s=0.1)},
    "creep": {"creep": Creep(fraction=0.5, time_s=20.0)},
    "drag": {"drag": Drag(sheath_N_s_per_mm=15.0, joint_Nmm_s_per_rad=500.0)},
    "preload_loss": {"preload_loss": PreloadLoss(fraction=0.4, cycles=1.0)},
    "fatigue": {"fatigue": Fatigue(loop_loss=0.7, residual_deg=0.2, cycles=1.0)},
}
"""Fields of the rig by effect; each changes the angle of the default rig at 20 N by more than 0.15 deg (tested)."""


def comparison_rigs(preload_N: float) -> dict[str, Rig]:
    """Rigs by name: the lossless rig with each mechanism alone, the default rig, and that with all effects."""
    lossless, default = replace(_LOSSLESS, preload_N=preload_N), preset("du2018-full-widths", preload_N=preload_N)
    tendon = default.tendon_a
    rigs = {
        "elastic tendons": lossless,
        "toe region": replace(lossless, tendon_a=tendon, tendon_b=tendon),
        "capstan friction": replace(lossless, friction=Friction(capstan_coefficient=0.1, rest_wrap_deg=30.0)),
        "guide and sheath friction": replace(lossless, friction=Friction(guide_N=0.05, sheath_N=1.0)),
        "material loop": replace(lossless, material=default.material),
    }
    for name, on in EFFECTS.items():  # alone, but for the friction that velocity weakens
        alone = rigs["capstan friction"] if name == "stribeck" else lossless
        rigs[f"{name} alone"] = replace(alone, **on)  # type: ignore[arg-type]
    rigs["du2018"] = default
    everything: dict[str, object] = {key: value for on in EFFECTS.values() for key, value in on.items()}
    rigs["all on"] = replace(default, **everything)  # type: ignore[arg-type]
    return rigs


def comparison_program(cycles: int = 2) -> LoadProgram:
    """Load program of the paper's static test, with one second a sample so that creep and drag act."""
    steps = triangle(2.2, cycles=cycles)
    return replace(steps, time_s=np.arange(steps.drive_mm.size, dtype=float))


@dataclass(frozen=True)
class ChainAgreement:
    """Differences between the engines for one rig over the whole program."""

    name: str
    preload_N: float
    max_difference_deg: float
    width_multibody_deg: float
    width_chain_deg: float
    max_tension_difference_N: float

    @property
    def width_difference_percent(self) -> float | None:
        """Loop width of the chain against the multibody model; None for a loop below 0.02 deg."""
        if abs(self.width_multibody_deg) < _LEAST_LOOP_DEG:
            return None
        return 100 * (self.width_chain_deg / self.width_multibody_deg - 1)


def compare_chain(name: str, rig: Rig, steps: LoadProgram) -> ChainAgreement:
    """Run a rig in both engines.

    Raises
    ------
    SolverError, RigError
        From the engines.
    """
    chain, multibody = solve_chain(rig, steps), solve_multibody(rig, steps)
    widths = [loop_width(r.drive, r.angle_deg, r.cycle).max_deg for r in (multibody.record, chain.record)]
    return ChainAgreement(
        name=name,
        preload_N=rig.preload_N,
        max_difference_deg=float(np.abs(chain.record.angle_deg - multibody.record.angle_deg).max()),
        width_multibody_deg=widths[0],
        width_chain_deg=widths[1],
        max_tension_difference_N=float(np.abs(chain.segment_tensions_N - multibody.segment_tensions_N).max()),
    )


def comparisons() -> list[ChainAgreement]:
    """Compare all rigs at both preloads of the paper."""
    return [
        compare_chain(name, rig, comparison_program())
        for preload in (10.0, 20.0)
        for name, rig in comparison_rigs(preload).items()
    ]

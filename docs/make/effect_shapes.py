"""Draws what each effect adds to the angle into ``docs/images/effects.png``: ``python -m docs.make.effect_shapes``."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.pages import IMAGES, png
from fem_models.chain import simulate_chain
from fem_models.load import sine
from fem_models.rig import preset
from hysteresis import Record
from hysteresis.arrays import Floats
from hysteresis.files import write_files
from validation.tracing import catalogue
from validation.tracing.effect import Effect, SampleInputs, Values

PICTURE = IMAGES / "effects.png"
RIG = preset("du2018-full-widths", preload_N=15.0)
PROGRAM = sine(2.2, 0.1, cycles=4, samples_per_cycle=120)
SIZES: Mapping[str, Values] = {
    "backlash": {"width_mm": 0.15},
    "camera_misalignment": {"gain": 0.02, "perspective_per_deg": 5e-4},
    "drive_gain": {"error": 0.02},
    "functional_fatigue": {"loop_loss": 0.5, "residual_deg": 0.05, "cycles": 1.5},
    "gravity": {"ring_mass_along_g": 0.0, "ring_mass_across_g": 5.0},
    "guide_friction": {"base_capstan": 0.1},
    "notch_closure": {"angle_deg": 2.9, "stiffness_Nmm_per_rad": 300.0},
    "position_friction": {"growth_per_mm": 0.2},
    "preload_loss": {"fraction": 0.4, "cycles": 1.5},
    "preloaded_play": {"free_width_mm": 0.45, "takes_up_N": 7.5},
    "run_in": {"excess": 0.8, "cycles": 1.5},
    "stribeck_friction": {"rise": 0.8, "speed_mm_per_s": 0.4},
    "superelastic_plateau": {"plateau_MPa": 400.0, "unloading_ratio": 0.5},
    "tendon_creep": {"fraction": 0.5, "time_s": 10.0},
    "tendon_slack": {"slack_mm": 0.2},
    "tendon_stiffening": {"toe_N": 20.0},
    "thermal_drift": {"deg_per_s": 0.01},
    "time_delay": {"delay_s": 0.1},
    "tip_contact": {"y_mm": 10.0, "stiffness_N_per_mm": 0.1},
    "tip_load": {"force_across_N": 0.1},
    "unequal_tendons": {"arm_ratio": 1.04},
    "viscous_drag": {"sheath_N_s_per_mm": 1.0},
    "wheel_eccentricity": {"sine_mm": 0.04, "cosine_mm": 0.04},
}
"""Sizes that are drawn. Not drawn are effects of a second plane, of a single tendon and of a declared plateau."""

_COLUMNS = 4


def added_deg(effect: Effect, without: Record, values: Values) -> Floats:
    """Angle of the rig with the effect, less that without it, shape (m,), deg."""
    form = next(one for one in effect.rig_forms if {p.name for p in one.parameters} == set(values))
    run = without if form.rig is None else simulate_chain(form.rig(RIG, values), PROGRAM)
    assert PROGRAM.time_s is not None
    assert PROGRAM.cycle is not None
    inputs = SampleInputs(PROGRAM.drive_mm, PROGRAM.time_s, PROGRAM.cycle, timed=True)
    angle = run.angle_deg if form.observe is None else form.observe(run.angle_deg, inputs, values)
    return angle - without.angle_deg


def figure() -> Figure:
    """One panel an effect: what it adds to the angle over the drive, the first cycle light, the last one dark."""
    effects = {effect.name: effect for effect in catalogue()}
    without = simulate_chain(RIG, PROGRAM)
    rows = -(-len(SIZES) // _COLUMNS)
    drawn = Figure(figsize=(10.0, 1.75 * rows), layout="constrained")
    panels = drawn.subplots(rows, _COLUMNS, sharex=True, squeeze=False).ravel()
    for panel, (name, values) in zip(panels, SIZES.items(), strict=False):
        _draw(panel, added_deg(effects[name], without, values))
        panel.set_title(name, fontsize=9, loc="left")
    for panel in panels[len(SIZES) :]:
        panel.set_visible(False)
    for panel in panels[len(SIZES) - _COLUMNS : len(SIZES)]:
        panel.set_xlabel("drive, mm", fontsize=8)
        panel.tick_params(labelbottom=True)
    for panel in panels[::_COLUMNS]:
        panel.set_ylabel("deg", fontsize=8)
    return drawn


def _draw(panel: Axes, added: Floats) -> None:
    assert PROGRAM.cycle is not None
    last = int(PROGRAM.cycle.max())
    for cycle in range(1, last + 1):
        there = np.flatnonzero(PROGRAM.cycle == cycle)
        there = np.append(there[0] - 1, there)
        shade = 0.75 * (1.0 - (cycle - 1) / (last - 1))
        panel.plot(PROGRAM.drive_mm[there], added[there], color=(shade, 0.3 + 0.6 * shade, 0.65 + 0.3 * shade), lw=1.2)
    panel.axhline(0.0, color="#9aa0a8", lw=0.6, zorder=0)
    panel.tick_params(labelsize=7)


if __name__ == "__main__":
    write_files({PICTURE: png(figure(), dpi=110)})

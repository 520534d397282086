"""Effects that only a rig with more declared than most can have, traced whole: a plateau, a single tendon.

No practice case has them. The rigs are those of a rig file.
"""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import read_rig
from fem_models.rig.effects import Slack
from hysteresis.records.record import Record
from validation.tracing import trace_records

NOISE_DEG = 0.04
TUBE = """
preload_N = 20.0
[tube]
outer_diameter_mm = 6.0
inner_diameter_mm = 5.4
[notch]
shape = "rectangular_pair"
count = 10
depth_mm = 2.6
width_mm = 0.8
spacing_mm = 1.2
[material]
youngs_modulus_GPa = 60.0
poissons_ratio = 0.33
loop_share = 0.1
loop_angle_deg = 1.5
[wheel]
radius_mm = 8.0
[friction]
sheath_N = 0.5
capstan_coefficient = 0.04
[tendon]
EA_N = 9000.0
moment_arm_mm = 2.5
free_length_mm = 120.0
"""
WITH_PLATEAU = TUBE + "[superelastic]\nplateau_MPa = 380.0\nunloading_plateau_MPa = 180.0\n"
OF_ONE_TENDON = "tendons = 1\n" + TUBE


def loops(amplitude_mm, rate_Hz, one_sided):
    """Three cycles; a single tendon is pulled from zero and let go."""
    turns = np.arange(241) / 80
    wave = 0.5 * (1 - np.cos(2 * np.pi * turns)) if one_sided else np.sin(2 * np.pi * turns)
    cycle = np.maximum(np.ceil(turns), 1).astype(int)
    return LoadProgram(np.round(amplitude_mm * wave, 4), np.round(turns / rate_Hz, 6), cycle)


def records(folder, text, change, amplitude_mm, preloads_N, seed):
    """Four records of the declared rig with a change: two preloads, two rates, two amplitudes.

    True friction, stiffness and material loop are drawn within 30 % of what is declared. The practice page has what
    seeds 100 to 109 gave.
    """
    (folder / "rig.toml").write_text(text)
    rig, rng = read_rig(folder / "rig.toml"), np.random.default_rng(seed)

    def near(value):
        return value * float(rng.uniform(0.7, 1.3))

    EA = near(rig.tendon_a.EA_N)
    tendons = {name: replace(t, EA_N=EA) for name in ("tendon_a", "tendon_b") if (t := getattr(rig, name))}
    material = replace(
        rig.material, loop_share=near(rig.material.loop_share), loop_angle_deg=near(rig.material.loop_angle_deg)
    )
    dry = replace(
        rig.friction, sheath_N=near(rig.friction.sheath_N), capstan_coefficient=near(rig.friction.capstan_coefficient)
    )
    true = replace(rig, material=material, friction=dry, **tendons)
    high, low = preloads_N
    out = []
    for preload, rate, size in ((high, 0.1, 1.0), (low, 0.1, 1.0), (high, 1.0, 1.0), (low, 0.1, 0.5)):
        program = loops(size * amplitude_mm, rate, one_sided="tendon_b" not in tendons)
        angle = simulate_chain(change(replace(true, preload_N=preload)), program).angle_deg
        angle = np.round(angle + rng.normal(0, NOISE_DEG, angle.size) + rng.normal(0, 0.1), 4)
        known = {"file": "rig.toml", "preload_N": preload}
        times = {"time_s": program.time_s, "cycle": program.cycle}
        out.append(Record(program.drive_mm, angle, rig=known, source=str(folder / "bench.csv"), **times))
    return out


def warmer(kelvin):
    def change(rig):
        law = rig.superelastic
        return replace(rig, superelastic=replace(law, temperature_C=law.temperature_C + kelvin))

    return change


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "change", "driven", "effect", "name", "value", "within"),
    [
        (WITH_PLATEAU, warmer(8.0), (1.6, (20.0, 10.0)), "temperature", "warmer_K", 8.0, 0.8),
        (OF_ONE_TENDON, lambda rig: replace(rig, slack=Slack(0.02, 0.0)), (2.0, (3.0, 1.5)), "tendon_engagement",
         "engages_after_mm", 0.02, 0.002),
    ],
    ids=["warmer metal", "late tendon"],
)  # fmt: skip
def test_an_effect_of_a_declared_rig_is_named_with_its_size(
    text, change, driven, effect, name, value, within, tmp_path
):
    trace = trace_records(records(tmp_path, text, change, *driven, seed=102))
    assert trace.verdict == "effect"
    assert trace.augmented.names == (effect,)
    assert trace.augmented.model.values(trace.augmented.x)[1][0][name] == pytest.approx(value, abs=within)
    assert trace.augmented.heldout_rmse_deg < 1.2 * NOISE_DEG


@pytest.mark.parametrize(
    ("text", "driven"), [(WITH_PLATEAU, (1.6, (20.0, 10.0))), (OF_ONE_TENDON, (2.0, (3.0, 1.5)))],
    ids=["plateau", "one tendon"],
)  # fmt: skip
def test_a_clean_declared_rig_has_the_verdict_none(text, driven, tmp_path):
    assert trace_records(records(tmp_path, text, lambda rig: rig, *driven, seed=102)).verdict == "none"

"""Play of the drive that no rig file declares, on records that friction of the sheath explains nearly as well."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from fem_models.rig.effects import Backlash
from hysteresis import Record
from validation.separation import calibrate_rig

pytestmark = pytest.mark.slow
PLAY_MM, NOISE_DEG = 0.15, 0.05


def test_play_is_not_taken_for_friction():
    records = []
    for preload in (20.0, 10.0):
        rig = replace(preset("du2018", preload_N=preload), backlash=Backlash(PLAY_MM))
        run = simulate_chain(rig, triangle(2.2, step_mm=0.15, cycles=2))
        noise = np.random.default_rng(int(preload)).normal(0, NOISE_DEG, run.drive.size)
        records.append(Record(run.drive, run.angle_deg + noise, rig={"preset": "du2018", "preload_N": preload}))
    found = calibrate_rig(records).parameters
    play, sheath = found["backlash_mm"], found["sheath_N"]
    assert play.low <= PLAY_MM <= play.high
    assert sheath.low <= preset("du2018").friction.sheath_N <= sheath.high

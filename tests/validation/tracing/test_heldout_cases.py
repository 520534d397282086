"""Cases in which the right effect once left more than the noise in a held-out record, with the cause that was fixed."""

import numpy as np
import pytest

from fem_models.load import sine
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record
from validation.practice import draw_case
from validation.tracing import trace_records
from validation.tracing.baseline.samples import kept_samples
from validation.tracing.effect import catalogue

CASES = {
    (
        "known",
        "backlash",
        1,
    ): "play and friction at the base compensate for each other, and the fit ended in that valley",
    ("known", "unequal_tendons", 9): "the tendon differs along its whole length, not only in its free length",
    ("known", "thermal_drift", 7): "the drift takes longer than the shortest record",
    ("unknown", "tendon_slack", 4): "the guides have some friction, which the equivalent rig lacked",
}


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "label", "number"), CASES, ids=[f"{kind} {label}" for kind, label, _ in CASES])
def test_the_right_effect_predicts_a_heldout_record_to_the_noise(kind, label, number):
    """Cases of a retired set of the score (docs/validation/practice.md), at 1.3 to 1.6 times the noise before."""
    case = draw_case("score-3", kind, label, number)
    trace = trace_records(case.records, effects=[effect for effect in catalogue() if effect.name == label])
    assert trace.augmented.names == (label,)
    assert trace.augmented.heldout_rmse_deg < 1.2 * case.truth.noise_deg


def test_thinned_samples_keep_the_first_of_every_cycle():
    """Effects of the cycle number change there; without it, fatigue of unknown rigs left 1.6 times the noise."""
    program = sine(1.0, 0.1, cycles=5, samples_per_cycle=88)
    record = Record(drive=program.drive_mm, angle_deg=20 * program.drive_mm)  # its cycles are found from the reversals
    keep = kept_samples(record.drive, 100, cycle_index(record))
    assert keep.size < 130
    assert set(np.flatnonzero(np.diff(program.cycle)) + 1) <= set(keep.tolist())

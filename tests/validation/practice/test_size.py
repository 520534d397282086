"""Size of injected effects over the noise, and effects of the rig and of the observation."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain, solve_chain
from fem_models.rig.effects import Backlash
from validation.practice.catalogue import CATALOGUE
from validation.practice.injected import Family, Injected, observed
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.protocols import BaselineRuns, draw_baseline
from validation.practice.size import TOLERANCE, OutOfReachError, baseline_tangent, size_over_noise, solve_size
from validation.practice.smallest.search import short


@pytest.fixture(scope="module")
def baseline() -> BaselineRuns:
    return draw_baseline(np.random.default_rng(3), measured_joints=False)


def test_size_ignores_what_the_baseline_parameters_absorb(baseline: BaselineRuns) -> None:
    """A small change of a baseline parameter has nearly no size, unless the tangent is left out."""
    absorbed = baseline_tangent(baseline)

    def more_sheath(rig):
        return replace(rig, friction=replace(rig.friction, sheath_N=1.05 * rig.friction.sheath_N))

    injected = Injected({}, rig=more_sheath)
    zeros_alone = absorbed[:, -4:]
    assert size_over_noise(baseline, injected, absorbed) < 0.1 * size_over_noise(baseline, injected, zeros_alone)
    zero = Injected({}, observe=lambda index, record, angle: angle + 0.3 * index)
    assert size_over_noise(baseline, zero, absorbed) < 1e-6


def test_an_unknown_rig_takes_more_than_a_known_one(baseline: BaselineRuns) -> None:
    """A wrong moment arm, a drive that is off by a gain and a cubic are no effects there; a delay is, in either."""
    known, unknown = (baseline_tangent(baseline, kind) for kind in ("known", "unknown"))
    assert unknown.shape[1] > known.shape[1]

    def wider(rig):
        a, b = (replace(one, moment_arm_mm=1.01 * one.moment_arm_mm) for one in rig.tendons)
        return replace(rig, tendon_a=a, tendon_b=b)

    def bent(index, program):
        return replace(program, drive_mm=program.drive_mm * (1.01 + 0.004 * (program.drive_mm / baseline.full_mm) ** 2))

    for taken in (Injected({}, rig=wider), Injected({}, drive=bent)):
        assert size_over_noise(baseline, taken, unknown) < 0.1 * size_over_noise(baseline, taken, known)
    late = CATALOGUE["time_delay"](np.random.default_rng(1), baseline).at(0.02)
    assert size_over_noise(baseline, late, unknown) > 0.5 * size_over_noise(baseline, late, known)


def test_size_is_in_units_of_the_noise(baseline: BaselineRuns) -> None:
    """White noise of n times the noise loses only (10 columns)/(samples) of its size."""
    n, rng = 5.0, np.random.default_rng(0)
    noise = [n * baseline.protocol.noise_deg * rng.normal(size=run.record.angle_deg.size) for run in baseline.runs]
    injected = Injected({}, observe=lambda index, record, angle: angle + noise[index])
    samples = sum(map(len, noise))
    # standard deviation of an RMS of m normal values: 1/sqrt(2 m)
    assert size_over_noise(baseline, injected, baseline_tangent(baseline)) == pytest.approx(
        n, rel=5 / np.sqrt(2 * samples)
    )


def test_rig_effects_reach_the_engine(baseline: BaselineRuns) -> None:
    """Injected backlash is the backlash of the rig."""
    loading = baseline.protocol.loadings[1]
    backlash = Injected({}, rig=lambda rig: replace(rig, backlash=Backlash(0.1)))
    expected = simulate_chain(replace(baseline.protocol.rig_at(10.0), backlash=Backlash(0.1)), loading.program)
    np.testing.assert_array_equal(observed(baseline.protocol, [backlash])[1], expected.angle_deg)


@pytest.mark.parametrize("label", ["time_delay", "camera_misalignment", "thermal_drift", *OUTSIDE_CATALOGUE])
def test_observed_effects_vanish_with_their_size(label: str, baseline: BaselineRuns) -> None:
    """Continuity: at a millionth of its bound an effect adds almost nothing."""
    family = {**CATALOGUE, **OUTSIDE_CATALOGUE}[label](np.random.default_rng(1), baseline)
    for added, run in zip(observed(baseline.protocol, [family.at(1e-6)]), baseline.runs, strict=True):
        assert np.abs(added - run.record.angle_deg).max() < 1e-3


def test_delay_shifts_the_angle_in_time(baseline: BaselineRuns) -> None:
    """theta(t - tau) of a sampled angle at tau of one sample is the sample before."""
    family = CATALOGUE["time_delay"](np.random.default_rng(1), baseline)
    time = baseline.protocol.loadings[2].program.time_s
    injected = family.at(float(time[1]) / 0.2)
    angle = solve_chain(baseline.protocol.rig_at(20.0), baseline.protocol.loadings[2].program).record.angle_deg
    np.testing.assert_allclose(observed(baseline.protocol, [injected])[2][1:], angle[:-1], atol=2e-3)  # times to 1 us


def test_a_size_that_was_asked_for_is_met_or_out_of_reach(baseline: BaselineRuns) -> None:
    """An offset of the angle of at most four times the noise: moderate, but not six times."""
    noise, nothing = baseline.protocol.noise_deg, baseline_tangent(baseline)[:, :0]

    def at(size: float) -> Injected:
        return Injected({}, observe=lambda index, record, angle: angle + 4.0 * size * noise)

    family = Family(at, least=1e-3)
    _, largest = solve_size(baseline, family, nothing, 6.0)
    assert largest == pytest.approx(4.0)
    with pytest.raises(OutOfReachError):
        solve_size(baseline, family, nothing, 6.0, exact=True)
    assert solve_size(baseline, family, nothing, 2.0, exact=True)[1] == pytest.approx(2.0, rel=TOLERANCE)


def test_no_drift_is_drawn_that_settles_within_a_cycle() -> None:
    """The tracer names none; the short records of the smallest sizes have two cycles."""
    short_records = draw_baseline(np.random.default_rng(3), measured_joints=False, change=short)
    program = short_records.protocol.loadings[0].program
    first, second = np.flatnonzero(program.drive_mm == program.drive_mm.max())[:2]
    cycle = program.time_s[second] - program.time_s[first]
    drifts = [CATALOGUE["thermal_drift"](np.random.default_rng(k), short_records).at(1.0).numbers for k in range(40)]
    settling = [drift["time_s"] for drift in drifts if drift["saturates"]]
    assert len(settling) > 10
    assert min(settling) > 0.99 * cycle
    assert max(settling) > 1.5 * cycle

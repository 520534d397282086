"""Rigs in series: closed forms and an energy balance that they must meet, and cases that are repeatable."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.rig.of_record import rig_of
from hysteresis import read_record
from validation.practice.benchmark.sources import LEARNT, SOURCES, draw_simulated
from validation.practice.beyond import beyond, size_for
from validation.practice.cases import write_case
from validation.practice.draw import CLEAN
from validation.practice.outcome import Outcome
from validation.practice.series import SeriesRig, simulate_series
from validation.practice.series.cases import draw_protocol, draw_rig, draw_series_case, draw_series_noiseless
from validation.practice.series.effects import (
    DOMINANT,
    DOMINANT_SIZES,
    SERIES_LABELS,
    SIZES,
    UNDECLARED,
    effects,
    effects_of,
    labels_of,
)
from validation.practice.series.rig import Flexures, pulled
from validation.practice.spoiled.draw import draw_labelled
from validation.practice.summary import exact_interval
from validation.tracing import catalogue

JOINTS, SPRING = 8, 60.0  # Nmm/rad of the whole chain while it slides
YIELDS = np.array([0.8, 1.5, 3.0])


def flexures(yields=YIELDS):
    ones = np.ones((JOINTS, 3))
    return Flexures(3 * JOINTS * SPRING * ones, 4 * JOINTS * SPRING * ones, np.asarray(yields) * ones)


RIG = SeriesRig(flexures())
ELASTIC = replace(RIG, flexures=flexures(np.zeros(3)), base_friction=0.0)
ARM = RIG.arm_mm[0]
TENDON = 1.0 / (1.0 / RIG.stiff_N_per_mm[0] + 1.0 / RIG.soft_N_per_mm[0])


def program(amplitude=1.5, samples=100, cycles=3):
    k = np.arange(1, samples * cycles + 1)
    return amplitude * np.sin(2 * np.pi * k / samples), k * 0.05 * 100 / samples


def test_without_losses_the_angle_is_that_of_springs_in_series():
    # moments: 2 k r (x - r theta) = K theta while both tendons are taut, 1/k = 1/stiff + 1/soft, 1/K the sum of all
    drive, time = program()
    exact = 2 * TENDON * ARM * drive / (SPRING + 2 * TENDON * ARM**2)
    assert simulate_series(ELASTIC, drive, time).turn_rad == pytest.approx(exact, abs=1e-9)


def test_a_single_tendon_bends_under_its_preload():
    # r (T0 + k (x - r theta)) = K theta
    drive, time = program(amplitude=1.0)
    exact = ARM * (5.0 + TENDON * drive) / (SPRING + TENDON * ARM**2)
    run = simulate_series(replace(ELASTIC, pair=False, preload_N=5.0), drive, time)
    taut = run.bending_N[:, 0] > 0.01
    assert taut.sum() > 150
    assert run.turn_rad[taut] == pytest.approx(exact[taut], abs=1e-9)
    assert not run.bending_N[:, 1].any()


def test_slack_is_a_dead_zone():
    rest = ELASTIC.preload_N / TENDON
    rig = replace(ELASTIC, slack_mm=(rest + 0.2, rest + 0.2))
    drive, time = program(amplitude=0.19)
    assert simulate_series(rig, drive, time).turn_rad == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(simulate_series(rig, *program(amplitude=0.6)).turn_rad) > 0.1


def test_loop_of_jenkins_elements_has_the_area_of_the_closed_form():
    # a unit that turns by +-q loses 4 y (q - y / k) a cycle; at the moment M it turns by q = (M - y) / K
    samples = 400
    rig = replace(RIG, base_friction=0.0)
    run = simulate_series(rig, *program(samples=samples))
    most = float(np.max(ARM * (run.bending_N[-samples:, 0] - run.bending_N[-samples:, 1])))
    units = rig.flexures
    turn = (most - units.yield_Nmm) / units.spring_Nmm_per_rad
    exact = float(np.sum(4 * units.yield_Nmm * (turn - units.yield_Nmm / units.jenkins_Nmm_per_rad)))
    assert run.lost_mJ[-1] - run.lost_mJ[-1 - samples] == pytest.approx(exact, rel=1e-3)


def test_a_slipping_tendon_has_the_ratio_of_tensions_of_the_bush():
    # |T1 - T2| = mu (T1 + T2) / 2, so T2 / T1 = (1 - mu/2) / (1 + mu/2) where a is pulled in, at every preload
    kept = (1 - RIG.base_friction / 2) / (1 + RIG.base_friction / 2)
    for preload in (10.0, 20.0):
        run = simulate_series(replace(RIG, preload_N=preload), *program(samples=100))
        rising = 210  # in the third cycle, well after the reversal at 175
        ratio = run.bending_N[rising] / run.wheel_N[rising]
        assert ratio == pytest.approx([kept, 1 / kept], rel=1e-9)
    stuck = simulate_series(RIG, *program(samples=400))  # just after a reversal
    assert kept < stuck.bending_N[902, 0] / stuck.wheel_N[902, 0] < 1 / kept


@pytest.mark.parametrize(
    "with_effect",
    [{}, {"contact_mm": 5.0, "contact_N_per_mm15": 20.0}, {"tip_force_N": (0.6, -0.8)}, {"toe_mm": 0.1}],
    ids=["plain", "contact", "tip load", "toe"],
)
def test_work_of_the_wheel_is_what_bush_and_sliders_take(with_effect):
    # over a closed loop springs, the contact and a dead force give back what they took
    samples = 400
    run = simulate_series(replace(RIG, **with_effect), *program(samples=samples))
    loop = slice(2 * samples - 1, 3 * samples)

    def area(force, way):
        return float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(way, axis=0)))

    work = area(run.wheel_N[loop], run.pulled_mm[loop])
    bush = area((run.wheel_N - run.bending_N)[loop], run.slipped_mm[loop])
    sliders = run.lost_mJ[loop][-1] - run.lost_mJ[loop][0]
    assert min(bush, sliders) > 0.1 * work
    assert bush + sliders == pytest.approx(work, rel=2e-3)


def test_drag_takes_more_where_the_drive_is_faster():
    drive, time = program()
    widths = []
    for rate in (1.0, 8.0):
        turn = simulate_series(replace(RIG, drag_N=0.5), drive, time / rate).turn_rad
        widths.append(turn[249] - turn[299])
    still = simulate_series(RIG, drive, time).turn_rad
    assert widths[1] - (still[249] - still[299]) > 2 * (widths[0] - (still[249] - still[299])) > 0


def test_steps_do_not_matter_without_drag_and_converge_in_proportion_with_it():
    drive, time = program(samples=40, cycles=1)

    def turn(rig, substeps):
        return simulate_series(replace(rig, substeps=substeps), drive, time).turn_rad

    assert turn(RIG, 1) == pytest.approx(turn(RIG, 8), abs=1e-8)
    drive, time = drive[:20], time[:20]
    dragged = replace(RIG, drag_N=2.0)
    fine = turn(dragged, 512)
    errors = [float(np.sqrt(np.mean((turn(dragged, n) - fine) ** 2))) for n in (16, 32)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(
        orders > 0.8
    )  # backward differences in time; below 16 steps the layer after a reversal is not resolved


def test_a_force_at_the_tip_bends_a_cantilever_of_joints():
    # small: joint j turns by F (n - j) pitch / K_j; the tendon is slack on that side
    rig = replace(ELASTIC, pair=False, preload_N=0.0, tip_force_N=(0.0, 1e-3))
    turn = simulate_series(rig, np.zeros(3), np.arange(3.0)).turn_rad[-1]
    levers = rig.pitch_mm * np.arange(JOINTS, 0, -1)
    assert turn == pytest.approx(1e-3 * np.sum(levers / rig.flexures.slid_Nmm_per_rad), rel=1e-4)


def test_an_obstacle_gives_by_the_depth_of_hertz():
    drive, time = program()
    free = simulate_series(RIG, drive, time)
    soft, hard = (
        simulate_series(replace(RIG, contact_mm=5.0, contact_N_per_mm15=k), drive, time).tip_mm.max()
        for k in (1.0, 1000.0)
    )
    assert free.tip_mm.max() > soft > hard > 5.0
    assert hard == pytest.approx(5.0, abs=0.05)


def test_an_eccentric_wheel_winds_in_what_its_centre_moves():
    # to first order the centre's way to the guides, e [cos(phi + p) - cos p], with opposite signs for the two tendons
    drive, _ = program(amplitude=6.0)
    rig = replace(RIG, wheel_radius_mm=4.0, run_out_mm=1e-3, run_out_rad=0.7)
    way = rig.run_out_mm * (np.cos(drive / 4.0 + 0.7) - np.cos(0.7))
    wound = pulled(rig, drive)
    assert wound[:, 0] == pytest.approx(drive - way, abs=1e-6)
    assert wound[:, 1] == pytest.approx(-drive + way, abs=1e-6)


def test_readings_of_camera_logger_and_drift():
    drive, time = np.linspace(0.0, 1.5, 200), np.linspace(0.0, 10.0, 200)  # a ramp of an elastic rig is a ramp
    plain = simulate_series(ELASTIC, drive, time).turn_rad

    def read(**of_sensor):
        return np.radians(simulate_series(replace(ELASTIC, **of_sensor), drive, time).angle_deg)

    assert np.tan(read(view_rad=0.5)) == pytest.approx(np.cos(0.5) * np.tan(plain), abs=1e-12)
    for delay in (0.4, 0.01):  # longer and shorter than the 0.05 s between samples
        late = np.interp(time - delay, time, plain)[50:]
        assert read(delay_s=delay)[50:] == pytest.approx(late, abs=1e-9)
    assert (read(drift_rad=0.2, drift_s=10.0) - plain)[-1] == pytest.approx(0.1)


def test_creep_is_that_of_andrade():
    # held at rest the tensions fall by k A T t^(1/3): eight times the time, twice the fall
    time = np.array([0.0, 7.0, 63.0])  # 1, 8 and 64 s after the preload
    run = simulate_series(replace(ELASTIC, creep_mm_per_N=1e-6, substeps=2000), np.zeros(3), time)
    fall = ELASTIC.preload_N - run.bending_N[:, 0]
    assert fall[0] == pytest.approx(TENDON * 1e-6 * ELASTIC.preload_N, rel=1e-2)
    assert fall[1:] / fall[:-1] == pytest.approx([2.0, 2.0], rel=1e-2)


def test_two_hundred_rigs_have_finite_angles():
    for seed in range(200):
        rng = np.random.default_rng(seed)
        rig = draw_rig(rng, single=seed % 4 == 3)
        made = replace(draw_protocol(rig, rng).records[seed % 2], cycles=1, samples_per_cycle=60)
        label = SERIES_LABELS[seed % len(SERIES_LABELS)]
        rig = replace(rig, preload_N=made.preload_N)
        effect = effects(rng, 8.0).get(label, lambda rig, size: rig)
        drive, time, _ = made.drive()
        angle = simulate_series(effect(rig, 0.5 * float(rng.random())), drive, time).angle_deg
        assert np.isfinite(angle).all()
        assert 3.0 < np.ptp(angle) < 200.0


def test_a_case_is_the_same_again_and_another_seed_is_not(tmp_path):
    one, again, other = (draw_series_case(seed, "known", CLEAN, 0) for seed in (5, 5, 6))
    assert all((a.angle_deg == b.angle_deg).all() for a, b in zip(one.records, again.records, strict=True))
    assert not np.array_equal(one.records[0].angle_deg, other.records[0].angle_deg)
    assert len({record.rig["preload_N"] for record in one.records}) == 3
    paths = write_case(one, tmp_path)
    record = read_record(paths[1])
    assert record.angle_deg.tolist() == one.records[1].angle_deg.tolist()
    rig = rig_of(record)
    assert rig.joints == one.records[1].rig["joints"]
    assert not any("friction" in path.with_suffix(".toml").read_text() for path in paths)


SLOWER = [one for one in SERIES_LABELS if one not in (CLEAN, DOMINANT, "camera_misalignment", "backlash")]


def test_unknown_geometry_tells_the_preload_alone():
    drawn = [draw_series_case(3, "unknown", CLEAN, number) for number in range(8)]
    assert all(set(record.rig) == {"preload_N"} for case in drawn for record in case.records)
    pulled_alone = [case for case in drawn if min(record.drive.min() for record in case.records) >= 0.0]
    assert 0 < len(pulled_alone) < 8  # rigs with a single tendon


@pytest.mark.parametrize(
    "label",
    [
        "camera_misalignment",
        "backlash",
        *(pytest.param(label, marks=pytest.mark.slow) for label in SLOWER),
        pytest.param(DOMINANT, marks=pytest.mark.slow),
    ],
)
def test_every_effect_has_the_size_that_was_asked_for(label):
    case, _ = draw_series_noiseless(5, "known", label, 0)
    assert case.truth.effects == effects_of(label)
    least, most = DOMINANT_SIZES if label == DOMINANT else SIZES
    assert 0.9 * least < case.truth.ratios[0] < 1.1 * most


def test_labels_are_of_the_catalogue():
    names = {effect.name for effect in catalogue()}
    assert {name for label in SERIES_LABELS for name in effects_of(label)} <= names
    assert {*UNDECLARED} <= names
    assert {*SERIES_LABELS} - {*labels_of("unknown")} == {"drive_gain", DOMINANT}
    with pytest.raises(ValueError, match="wear: expected one of backlash"):
        draw_series_case(1, "known", "wear", 0)


def test_friction_at_the_base_counts_neither_way():
    case, describes = draw_labelled("series", 5, "known", CLEAN, 0)
    assert (case.truth.effects, describes) == ((), UNDECLARED)

    def outcome(*named, truth=(), verdict="effect", confusable=()):
        common = {"noise_deg": 0.1, "before_deg": None, "after_deg": None, "seconds": 0.0, "describes": describes}
        return Outcome(label="x", truth=truth, verdict=verdict, named=named, confusable=confusable, **common)

    assert not outcome("guide_friction").names_falsely
    assert outcome("guide_friction", "gravity").names_falsely
    both = outcome("guide_friction", "backlash", truth=("backlash",))
    assert (both.first_right, both.within_set, both.column) == (True, True, "guide_friction")
    assert not outcome("gravity", "backlash", truth=("backlash",)).first_right
    assert outcome("guide_friction", truth=("backlash",), confusable=("backlash",)).within_set


def test_what_a_tangent_may_take_is_bounded():
    # twice a column: unbounded it is taken whole, of the bound 0.5 three quarters are left
    column = np.sin(np.arange(40.0))
    plain, changed = [np.zeros(40)], [2 * column]
    tangent = column[:, None]
    assert beyond(tangent, plain, changed) == pytest.approx(0.0, abs=1e-12)
    left = beyond(tangent, plain, changed, np.array([0.5]))
    assert left == pytest.approx(1.5 * float(np.sqrt(np.mean(column**2))), rel=1e-9)
    size, ratio = size_for(lambda size: 10 * size**2, 10.0, 4.0)
    assert (ratio, 10 * size**2) == pytest.approx((4.0, 4.0), rel=0.05)
    assert size_for(lambda size: size, 1.0, 4.0) is None


def test_exact_interval():
    # by hand: of 0 of n the upper bound is 1 - 0.025^(1/n); 8 of 10 from tables of Clopper and Pearson
    assert exact_interval(0, 59) == pytest.approx((0.0, 1 - 0.025 ** (1 / 59)))
    assert exact_interval(59, 59) == pytest.approx((0.025 ** (1 / 59), 1.0))
    assert exact_interval(8, 10) == pytest.approx((0.4439, 0.9748), abs=1e-4)


def test_a_twin_is_the_same_rig_without_the_effect():
    hidden, _ = draw_series_noiseless(11, "known", "camera_misalignment", 0)
    twin, _ = draw_series_noiseless(11, "known", "camera_misalignment", 0, twin=True)
    assert (twin.truth.effects, twin.truth.noise_deg) == ((), hidden.truth.noise_deg)
    for one, other in zip(hidden.records, twin.records, strict=True):
        assert (one.rig, one.drive.tolist()) == (other.rig, other.drive.tolist())
        assert 0.01 < float(np.abs(one.angle_deg - other.angle_deg).max()) < 20.0


def test_nothing_learns_from_rigs_in_series():
    assert set(SOURCES) - set(LEARNT) == {"series", "real"}
    drawn = draw_simulated("series", 3, 0)
    assert (drawn.source, drawn.effects, drawn.describes) == ("series", (), UNDECLARED)

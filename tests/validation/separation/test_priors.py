"""Priors of a declared rig: what z makes of its numbers, and the laws that its metal may have."""

from dataclasses import replace

import numpy as np
import pytest

from fem_models.chain import simulate_chain
from fem_models.load import triangle
from fem_models.rig import RigError, preset
from fem_models.rig.effects import Backlash
from fem_models.rig.joints import Notch
from fem_models.rig.presets import PRESETS
from fem_models.rig.rig import with_notch
from hysteresis import Record
from hysteresis.records.record import RecordError
from hysteresis.records.record_file import read_record, write_record
from hysteresis.sensors.readings import cleaned
from validation.separation import calibrate_rig
from validation.separation.priors import FLAG, LOOP, PLAY, PRIORS, drawn, laws_of, stated_values, with_values
from validation.separation.rig_calibration import _laws, _loop, _possible, _Problem

RIG = preset("du2018", preload_N=20.0)


@pytest.mark.parametrize("name", PRESETS)
def test_the_middle_of_the_prior_is_the_stated_rig(name):
    rig = preset(name)
    assert with_values(rig, stated_values(rig)) == rig
    law, *_ = laws_of(rig)
    values, stated = law.values(np.zeros(len(law.coordinates))), stated_values(rig)
    assert values == pytest.approx({key: stated[key] or PRIORS[key].unstated[0] for key in values})


def test_spreads_are_those_of_the_table():
    law, *_ = laws_of(RIG)
    rng, p = np.random.default_rng(0), len(law.coordinates)
    drawn_values = [law.values(z) for z in rng.standard_normal((4000, p))]
    stated = {name: at for name, at in stated_values(RIG).items() if not name.startswith("backlash")}
    assert set(stated) == set(law.coordinates)
    for name, at in stated.items():
        values, prior = np.array([one[name] for one in drawn_values]), PRIORS[name]
        shapes = {"log": np.log, "logit": lambda share: np.log(share / (1 - share)), "plain": np.asarray}
        spread = shapes[prior.shape](values)
        assert spread.std() == pytest.approx(prior.spread, rel=0.05), name
        assert np.median(values) == pytest.approx(at, rel=0.06), name


def test_a_metal_without_a_stated_law_may_have_the_flag():
    laws = laws_of(RIG)
    assert [law.name for law in laws] == ["linear", "linear", "flag", "flag"]
    linear, _, flag, _ = laws
    assert set(FLAG) <= set(flag.coordinates)
    assert not set(LOOP) & set(flag.coordinates)
    found = flag.rig_at(np.zeros(len(flag.coordinates)), RIG)
    assert found.superelastic.plateau_MPa == pytest.approx(400.0)  # 280 to 520
    assert found.material.loop_share == 0
    assert found.preload_N == RIG.preload_N
    assert {law.name for law in laws_of(preset("notched-wrist-90"))} == {"flag"}  # it states its own
    rng = np.random.default_rng(0)
    assert {drawn((linear, flag), rng)[0].name for _ in range(20)} == {"linear", "flag"}


def test_a_number_stated_as_zero_is_open_where_no_drawing_has_it():
    smooth = replace(RIG, friction=replace(RIG.friction, sheath_N=0.0, guide_N=0.0))
    law, *_ = laws_of(smooth)
    assert law.coordinates["sheath_N"].middle == PRIORS["sheath_N"].unstated[0]
    assert "guide_N" not in law.coordinates


def test_what_is_stated_as_zero_may_be_there_or_not():
    """Play by itself, and the other numbers together; what the rig states is in all laws."""
    play = {PLAY, "backlash_takes_up_N"}
    laws = laws_of(replace(RIG, friction=replace(RIG.friction, sheath_N=0.0)))[:4]
    has = [(bool(play & set(law.coordinates)), "sheath_N" in law.coordinates) for law in laws]
    assert has == [(False, True), (True, True), (False, False), (True, False)]
    assert all("EA_N" in law.coordinates for law in laws)
    rigs = [law.rig_at(np.zeros(len(law.coordinates)), RIG) for law in laws]
    assert [rig.backlash is not None for rig in rigs] == [False, True, False, True]
    stated = laws_of(replace(RIG, backlash=Backlash(0.1)))
    assert all(PLAY in law.coordinates and "backlash_takes_up_N" not in law.coordinates for law in stated)
    assert laws_of(RIG, {PLAY: 0.01})[0].coordinates[PLAY].middle == 0.01  # it is there: how much, the sidecar says


def test_notches_that_differ_are_moved_alike():
    notch = Notch("v_pair", count=3, depth_mm=(2.7, 2.8, 2.75), width_mm=1.4, spacing_mm=1.2, root_width_mm=0.8)
    rig = with_values(with_notch(RIG, notch), {"depth_mm": 2.71})
    assert rig.joint.notch.depth_mm == pytest.approx((2.71, 2.81, 2.76))


def test_a_stated_tolerance_takes_the_place_of_the_prior():
    law, *_ = laws_of(RIG, {"EA_N": 170.0, "depth_mm": 0.002, "loop_share": 0.024})
    assert law.coordinates["EA_N"].spread == pytest.approx(np.sqrt(np.log1p(0.01**2)))  # of a log-normal number
    (wide, *_) = laws_of(RIG, {"EA_N": 3e4})
    assert wide.coordinates["EA_N"].middle == RIG.tendon_a.EA_N  # a wide tolerance does not move the value
    assert law.coordinates["depth_mm"].spread == 0.002
    z = 1e-4 * np.eye(len(law.coordinates))[list(law.coordinates).index("loop_share")]
    assert (law.values(z)["loop_share"] - 0.4) / 1e-4 == pytest.approx(0.024, rel=1e-3)
    for wrong in ({"width_mm": 0.1}, {"EA_N": 0.0}, {"EA_N": "10 %"}, {"EA_N": 10**400}, {"loop_share": 1.0}):
        with pytest.raises(RigError, match=r"rig\.tolerance\."):
            laws_of(RIG, wrong)


def record(amplitude_mm=2.2, **rig):
    run = simulate_chain(RIG, triangle(amplitude_mm, step_mm=amplitude_mm / 20, cycles=1))
    return Record(run.drive, run.angle_deg, rig={"preset": "du2018", "preload_N": 20.0, **rig}, source="a.csv")


def test_the_sidecar_states_tolerances(tmp_path):
    one = record(tolerance={"EA_N": 170.0})
    write_record(one, tmp_path / "one.csv")
    assert "[rig.tolerance]\nEA_N = 170.0" in (tmp_path / "one.toml").read_text()
    assert read_record(tmp_path / "one.csv") == one
    assert one.to_xarray().attrs["rig_tolerance_EA_N"] == 170.0
    (tmp_path / "one.toml").write_text((tmp_path / "one.toml").read_text().replace("170.0", "-1"))
    with pytest.raises(RecordError, match=r"rig\.tolerance"):
        read_record(tmp_path / "one.csv")
    with pytest.raises(RigError, match=r"a\.csv: rig\.tolerance\.width_mm"):
        calibrate_rig([record(tolerance={"width_mm": 0.1})])


def test_a_metal_far_below_the_plateau_is_linear():
    for amplitude_mm, names in ((2.2, ["linear", "flag"]), (0.05, ["linear"])):  # 130 MPa are the thrust's
        loop = _loop(cleaned(record(amplitude_mm)))
        assert list(dict.fromkeys(law.name for law in _possible(_laws(record(), RIG), [loop]))) == names


@pytest.mark.parametrize("k", range(3))  # linear without and with play, and the flag
def test_derivatives_are_those_of_runs(k):
    """Rigs moved along the steps of a rig, against rigs that are run by themselves."""
    loop = _loop(cleaned(record()))
    problem = _Problem(laws_of(RIG)[k], (loop,), 0.05)
    z, step = np.full(len(problem.law.coordinates), 0.1), 1e-3
    columns = problem.columns(z)
    for i, name in enumerate(problem.law.coordinates):
        runs = [problem.residual(z + sign * step * np.eye(z.size)[i]) for sign in (-1, 1)]
        by_runs = (runs[1] - runs[0]) / (2 * step)
        off = np.linalg.norm(columns[:, i] - by_runs)
        assert off <= 0.1 * np.linalg.norm(by_runs), name  # a fibre begins to slip between two samples

"""One case: its key, its program, and its quantities by engine."""

import math

import numpy as np
import pytest

from fem_models.chain import solve_chain
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.rig import RigError, preset
from fem_models.rig.checks import SolverError
from fem_models.rig.rig_file import rig_of_tables
from hysteresis.records.metrics import loop_width
from studies.sweep.cases import Outcome, evaluate, evaluate_all, program_of_table
from studies.sweep.inputs import FIELDS, CaseInputs, CaseTables, ProgramTable, key_of, keys_of, with_values


def test_key_is_of_values_not_of_their_writing():
    base = CaseTables(preset("du2018").to_dict(), ProgramTable(amplitude_mm=2))
    same_numbers = with_values(base, {"preload_N": 20, "program.amplitude_mm": 2.0})
    assert key_of(of(same_numbers)) == key_of(of(base))
    other = with_values(base, {"preload_N": math.nextafter(20.0, 21.0)})
    assert key_of(of(other)) != key_of(of(base))


def test_key_is_of_the_other_inputs_too():
    base = CaseTables(preset("du2018").to_dict(), ProgramTable(amplitude_mm=2))
    different = [of(base), of(base, groups=("loop",)), of(base, seed=1), of(base, engine="analytic")]
    assert len({key_of(inputs) for inputs in different}) == 4


def of(tables: CaseTables, engine: str = "chain", groups: tuple[str, ...] = (), seed: int = 0) -> CaseInputs:
    return CaseInputs(tables.rig, tables.program, engine, groups, seed)


def test_derived_numbers():
    """Wall: (outer - inner)/2. Angle of a V: each flank leans half of it; a sharp V of 90 deg: width 2 depth."""
    base = CaseTables(preset("du2018").to_dict(), ProgramTable())
    rig = with_values(base, {"tube.wall_mm": 0.3, "tube.outer_diameter_mm": 6.0}).rig
    assert rig["tube"]["inner_diameter_mm"] == pytest.approx(5.4)
    rig = with_values(base, {"notch.angle_deg": 90.0, "notch.depth_mm": 1.0, "notch.root_width_mm": 0.0}).rig
    assert rig["notch"]["width_mm"] == pytest.approx(2.0)
    with pytest.raises(RigError, match="v_pair"):
        with_values(CaseTables(preset("notched-wrist-90").to_dict(), ProgramTable()), {"notch.angle_deg": 20.0})


def test_tendon_stands_for_both():
    rig = with_values(CaseTables(preset("du2018").to_dict(), ProgramTable()), {"tendon.EA_N": 1e4}).rig
    assert rig["tendon_a"]["EA_N"] == rig["tendon_b"]["EA_N"] == 1e4
    assert FIELDS["notch.count"]


@pytest.mark.parametrize("rate", [None, 2.0])
def test_program_of_one_tendon_pulls_only(rate):
    table = ProgramTable(1.0, 2, rate_Hz=rate, step_mm=0.1 if rate is None else None)
    program = program_of_table(table, one_way=True)
    drive = program.drive_mm
    assert drive.min() == pytest.approx(0, abs=1e-12)
    assert drive.max() == 1.0
    assert [drive[program.cycle == k][-1] for k in (0, 1, 2)] == pytest.approx([1.0, 1.0, 1.0])
    if rate is not None:  # the way out is half a period
        assert program.time_s[-1] == pytest.approx(2.5 / rate)


def outcome(engine: str, values: dict[str, float], groups: tuple[str, ...], name: str = "du2018", **program):
    table = ProgramTable(**{"amplitude_mm": 2.2, "cycles": 1, "step_mm": 0.2, **program})
    tables = with_values(CaseTables(preset(name).to_dict(), table), values)
    return evaluate("k", of(tables, engine, groups))


def test_analytic_engine_has_no_loop():
    found = outcome("analytic", {"material.loop_share": 0.0}, ("loop", "strain"))
    assert found.status == "ok"
    assert math.isnan(found.quantities["loop_width_max_deg"])
    assert math.isnan(found.quantities["dissipated_mJ"])
    dry = {f"friction.{name}": 0.0 for name in ("sheath_N", "guide_N", "capstan_coefficient")}
    chain = outcome("chain", {**dry, "material.loop_share": 0.0}, ("loop",))
    # they differ by friction and the loop of the material alone
    assert found.quantities["full_scale_angle_deg"] == pytest.approx(chain.quantities["full_scale_angle_deg"], rel=2e-3)


def test_slack_is_reached_at_little_preload():
    assert outcome("chain", {"preload_N": 1.0}, ("loop",)).quantities["slack_reached"] == 1
    assert outcome("chain", {"preload_N": 20.0}, ("loop",)).quantities["slack_reached"] == 0


def test_one_tendon():
    found = outcome("chain", {}, ("loop", "strain"), "notched-wrist-90", amplitude_mm=0.5, step_mm=0.05)
    assert found.status == "ok"
    assert found.quantities["tension_max_N"] > 0


def by_its_record(tables: CaseTables) -> dict[str, float]:
    """Quantities of the groups loop, strain and notches, from the record and the strains of a simulation."""
    rig = rig_of_tables(tables.rig, f"rig {tables.rig['name']}")
    found = solve_chain(rig, program_of_table(tables.program, one_way=rig.tendon_b is None))
    record, tensions = found.record, found.segment_tensions_N[:, : len(rig.tendons)]
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    fatigue, plateau, most = limits_passed(record.drive, found.peak_strain, strain_limits(rig))
    bent = int(np.abs(record.angle_deg).argmax())
    notches, begin = (
        record.notches_deg[bent] * np.sign(record.angle_deg[bent]),
        np.flatnonzero(record.cycle == 2)[0] - 1,
    )
    return {
        "full_scale_angle_deg": record.full_scale_deg,
        "loop_width_at_zero_deg": width.at_zero_deg,
        "loop_width_max_deg": width.max_deg,
        "dissipated_mJ": found.wheel_work_mJ[-1] - found.wheel_work_mJ[begin],
        "tension_max_N": tensions.max(),
        "tension_min_N": tensions.min(),
        "slack_reached": float(tensions.min() <= 0.01 * rig.preload_N),
        "peak_strain_percent": 100 * most.largest,
        "superelastic_margin": most.limit.strain / most.largest,
        "plateau_margin": plateau.limit.strain / plateau.largest,
        "fatigue_margin": fatigue.limit.strain / fatigue.largest,
        "notch_angle_max_deg": notches.max(),
        "notch_angle_spread_deg": np.ptp(notches),
        "notch_angle_gradient_deg": notches[-1] - notches[0],
    }


MIXED = [
    ("du2018", {"preload_N": 12.3, "notch.depth_mm": 2.77}),
    ("du2018", {"preload_N": 2.0, "program.amplitude_mm": 1.1}),
    ("du2018", {"notch.depth_gradient_mm": 0.04}),
    ("notched-wrist-90", {"preload_N": 0.4, "program.amplitude_mm": 0.4}),
    ("du2018", {"notch.depth_mm": 3.2}),
    ("du2018", {"preload_N": 1e3}),
    ("du2018", {"position_friction.growth_per_mm": 400.0}),
]
"""The last three fail: a tube cut in two, a tube that buckles, and no equilibrium."""


@pytest.mark.parametrize(("name", "values"), MIXED, ids=[",".join(values) for _, values in MIXED])
def test_a_case_has_the_quantities_and_the_failure_of_its_record(name, values):
    """To the last bit, although a case makes no record, and remembers the program and its loops."""
    tables = with_values(CaseTables(preset(name).to_dict(), ProgramTable(1.0, 2, step_mm=0.1)), values)
    found = evaluate("k", of(tables, groups=("loop", "strain", "notches")))
    if (name, values) in MIXED[-3:]:
        with pytest.raises((RigError, SolverError)) as refused:
            by_its_record(tables)
        assert (found.status, found.message) == ("failed", str(refused.value))
        assert all(math.isnan(value) for value in found.quantities.values())
    else:
        assert (found.status, found.message) == ("ok", "")
        assert found.quantities == by_its_record(tables)


def test_a_batch_gives_what_its_cases_give_alone():
    """To the last bit and in their order, amid others that fail; so does a case behind another."""
    base = {name: CaseTables(preset(name).to_dict(), ProgramTable(1.0, 2, step_mm=0.1)) for name, _ in MIXED}
    cases = [of(with_values(base[name], values), groups=("loop", "strain", "notches")) for name, values in MIXED]
    cases += [of(base["du2018"], "analytic", ("loop",)), *cases[:2]]
    together = evaluate_all([(str(k), one) for k, one in enumerate(cases)])
    alone = [evaluate(str(k), one) for k, one in enumerate(cases)]
    assert [found.status for found in together].count("failed") == 3
    assert [as_bits(found) for found in together] == [as_bits(found) for found in alone]


def as_bits(found: Outcome) -> tuple[str, str, str, dict[str, str]]:
    return found.key, found.status, found.message, {name: value.hex() for name, value in found.quantities.items()}


VARIED = [
    ("du2018", {"preload_N": 12.5, "notch.depth_mm": 2.7}),
    ("du2018", {"notch.count": 9.0, "program.amplitude_mm": 1.5, "program.cycles": 3}),
    ("du2018", {"tendon.EA_N": 1e4, "tendon_b.moment_arm_mm": 2.5, "backlash.width_mm": -0.0}),
]


@pytest.mark.parametrize(("name", "values"), VARIED, ids=[",".join(values) for _, values in VARIED])
def test_keys_by_the_text_around_their_numbers_are_the_keys(name, values):
    base = of(CaseTables(preset(name).to_dict(), ProgramTable(1.0, 2, step_mm=0.1)), groups=("loop",))
    quick = keys_of(base, list(values))
    for factor in (1.0, 2.0):
        point = {field: factor * value for field, value in values.items()}
        assert quick(point) == key_of(of(with_values(base, point), groups=("loop",)))


def test_keys_of_derived_numbers_and_of_a_rig_that_looks_like_a_mark_are_not_by_text():
    base = CaseTables(preset("du2018").to_dict(), ProgramTable(1.0, 2, step_mm=0.1))
    assert keys_of(of(base), ["notch.depth_gradient_mm"]) is None
    named = CaseTables({**base.rig, "name": f"{float(2**52)}"}, base.program)
    assert keys_of(of(named), ["preload_N"]) is None


def test_numbers_that_a_record_refuses_are_refused(monkeypatch):
    """With its message; nothing that a study may vary brings numbers so far."""
    monkeypatch.setattr("studies.sweep.cases.MAX_MAGNITUDE", 1e-3)
    monkeypatch.setattr("hysteresis.records.record.MAX_MAGNITUDE", 1e-3)
    found = outcome("chain", {"program.amplitude_mm": 1e-3, "program.step_mm": 1e-3}, ("loop",))
    assert found.status == "failed"
    assert found.message.startswith("record: tension_a_N: magnitude ")


def test_optional_groups():
    """Shares add up to 1; the law saturates at (A/(beta + gamma))^(1/n), Mech. Sci. 9, 2018, section 3."""
    q = outcome("chain", {"preload_N": 10.0}, ("loop", "contributions", "bouc-wen"), step_mm=0.1).quantities
    assert sum(
        q[f"{part}_share"] for part in ("friction", "tendon_elasticity", "material", "interaction")
    ) == pytest.approx(1)
    level = abs(q["bouc_wen_A"]) / (q["bouc_wen_beta"] + q["bouc_wen_gamma"])
    assert q["saturation_deg"] == pytest.approx(level ** (1 / q["bouc_wen_n"]), rel=1e-6)


@pytest.mark.slow
def test_solid_engine():
    """The solid against the joint of the analytic model, some per cent from it (docs/validation/notches.md)."""
    pytest.importorskip("gmsh", reason="gmsh, which meshes the solid notch, is not installed")
    found = outcome("solid", {}, ("joint", "strain"))
    assert found.status == "ok", found.message
    from fem_models.joint.flexure import flexure

    assert found.quantities["bending_Nmm_per_rad"] == pytest.approx(
        flexure(preset("du2018")).bending_Nmm_per_rad, rel=0.15
    )
    assert found.quantities["peak_strain_percent"] > outcome("chain", {}, ("strain",)).quantities["peak_strain_percent"]


def test_gradient_of_the_depth_makes_notches_deeper_towards_the_tip():
    base = CaseTables(preset("du2018").to_dict(), ProgramTable(amplitude_mm=1.0, cycles=1, step_mm=0.1))
    depths = with_values(base, {"notch.depth_gradient_mm": 0.04, "notch.depth_mm": 2.8}).rig["notch"]["depth_mm"]
    np.testing.assert_allclose(depths, np.linspace(2.78, 2.82, 14), atol=1e-12)
    angled = with_values(base, {"notch.depth_gradient_mm": 0.04, "notch.angle_deg": 12.0}).rig["notch"]
    flank = 2 * np.array(angled["depth_mm"]) * np.tan(np.radians(6.0))
    np.testing.assert_allclose(angled["width_mm"], 0.8 + flank, atol=1e-12)
    for count in (1, 10**6):
        with pytest.raises(RigError, match="expected 2 to 1,000 notches"):
            with_values(base, {"notch.depth_gradient_mm": 0.04, "notch.count": count})


def test_notches_bend_alike_at_some_gradient():
    """Friction takes tension on the way to the tip: equal notches bend less there, deeper ones more."""
    base = CaseTables(preset("du2018").to_dict(), ProgramTable(amplitude_mm=2.2, cycles=1, step_mm=0.1))
    found = []
    for gradient in (0.0, 0.01, 0.02):
        tables = with_values(base, {"notch.depth_gradient_mm": gradient})
        outcome = evaluate("k", of(tables, groups=("notches",)))
        assert outcome.status == "ok", outcome.message
        found.append(outcome.quantities)
    slopes = [one["notch_angle_gradient_deg"] for one in found]
    assert slopes[0] < slopes[1] < 0 < slopes[2]
    assert found[1]["notch_angle_spread_deg"] < found[0]["notch_angle_spread_deg"]
    assert all(one["notch_angle_spread_deg"] >= abs(one["notch_angle_gradient_deg"]) - 1e-12 for one in found)

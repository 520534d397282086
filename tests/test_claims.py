"""Every row of docs/validation/claims.md: the figure is computed here, the bound is taken from the row."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from closed_branch import branch_closed_form

from fem_models.analytic import theory_curve
from fem_models.chain.solve import ChainSettings, simulate_chain, solve_chain
from fem_models.joint.flexure import beam
from fem_models.joint.mechanics import joint_mechanics
from fem_models.joint.paper_elements import element_rotations
from fem_models.load import LoadProgram, triangle
from fem_models.load_control import run_load_control
from fem_models.multibody.quasi_static import MultibodySolution, solve_multibody
from fem_models.rig import preset
from fem_models.rig.joints import Notch
from fem_models.rig.rig import Friction, with_notch
from fem_models.rig.rig_file import read_rig
from hysteresis import Fit, identify
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.records.metrics import LoopWidth, errors, loop_width
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_record, write_record
from validation.measured.predicted_wrists import AUTHORS, predicted
from validation.separation import loop_program, separate
from validation.tracing import Trace, trace_records

PAGE = Path(__file__).parents[1] / "docs" / "validation" / "claims.md"
YORK = PAGE.with_name("york2015.toml")
PAPER = BoucWen(A=1.895, beta=0.315, gamma=0.2606, n=1.176)  # eq. 10


LOSSLESS = replace(preset("du2018"), friction=Friction(), material=replace(preset("du2018").material, loop_share=0.0))


def bounds() -> dict[str, float]:
    """The last column of the table, in whatever unit the row has."""
    lines = PAGE.read_text().split("| claim |")[1].split("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("| ").split("|")] for line in lines]
    return {name: float(within.split()[0]) for name, _, _, _, within in rows}


@cache
def loop(preload_N: float) -> MultibodySolution:
    return solve_multibody(preset("du2018", preload_N=preload_N), triangle(2.2, cycles=3))


@cache
def frictionless() -> Record:
    return solve_multibody(LOSSLESS, triangle(2.2)).record


def width(record: Record) -> LoopWidth:
    return loop_width(record.drive, record.angle_deg, record.cycle)


def frictionless_angle() -> float:
    record = frictionless()
    return float(np.abs(theory_curve(LOSSLESS, record.drive).angle_deg - record.angle_deg).max())


def energy_balance() -> float:
    def gap(solution: MultibodySolution) -> float:
        end = solution.record.cycle == 3
        first, last = np.flatnonzero(end)[[0, -1]] - [1, 0]
        loss = solution.friction_loss_mJ + solution.material_loss_mJ
        work = solution.wheel_work_mJ[last] - solution.wheel_work_mJ[first]
        return abs(loss[last] - loss[first] - work) / work

    return 100 * max(gap(loop(10.0)), gap(loop(20.0)))


def capstan() -> float:
    rig = preset("du2018")
    tendon = replace(rig.tendon_a, toe_N=0.0)
    rig = replace(rig, tendon_a=tendon, tendon_b=tendon, friction=Friction(capstan_coefficient=0.2, rest_wrap_deg=20.0))
    solution = solve_multibody(rig, LoadProgram(np.linspace(0, 2.2, 23)))
    pulled, released = solution.segment_tensions_N[-1]
    half = 0.5 * np.abs(np.radians(solution.record.notches_deg[-1]))  # a chord stands at half of the joint's angle
    wrap = half + np.concatenate([[np.radians(20.0)], half[:-1]])
    ratios = np.concatenate([pulled[:-1] / pulled[1:], released[1:] / released[:-1]])
    return float(np.abs(ratios / np.tile(np.exp(0.2 * wrap), 2) - 1).max())


def slot_element() -> float:
    rig = with_notch(preset("du2018"), Notch("rectangular_pair", 14, 2.86, 1.0, 1.6))
    return 100 * abs(element_rotations(rig, 1.0).theta_kd_rad * beam(rig).bending_Nmm_per_rad - 1)


def joint_stiffness() -> float:
    rig = preset("du2018")
    return 100 * abs(element_rotations(rig, 1.0, n_elements=512).theta_kd_rad * beam(rig).bending_Nmm_per_rad - 1)


def bouc_wen_kernel() -> float:
    worst = 0.0
    for n in (1.0, 1.176, 1.5, 2.0, 2.7, 3.0):
        model = replace(PAPER, n=n, h0_deg=-1.0)
        h = hysteresis(np.linspace(0.0, 20.0, 41), model)[-1]
        worst = max(worst, abs(h / branch_closed_form(-1.0, 0.0, 20.0, model) - 1))
    return worst


def paper_element() -> float:
    rig = preset("du2018")
    return 100 * abs(element_rotations(rig, 1.0).theta_kd_rad * beam(rig).bending_Nmm_per_rad - 1)


def layer_du2018() -> float:
    def worst(preload_N: float) -> float:
        rig = preset("du2018", preload_N=preload_N)
        fit = identify(loop(preload_N).record, lambda x: theory_curve(rig, x).angle_deg)
        smaller = [simulate_chain(rig, triangle(a, step_mm=0.05, cycles=2)) for a in (1.1, 0.55)]
        return max(errors(r.angle_deg, fit.predict(r.drive)).rmse_deg for r in smaller)

    return max(worst(10.0), worst(20.0))


def twins() -> float:
    def difference(preload_N: float) -> float:
        chain = simulate_chain(preset("du2018", preload_N=preload_N), triangle(2.2, cycles=3))
        return float(np.abs(chain.angle_deg - loop(preload_N).record.angle_deg).max())

    return max(difference(10.0), difference(20.0))


def chain_energy() -> float:
    steps = triangle(2.2, step_mm=0.001)
    s = solve_chain(preset("du2018"), steps, ChainSettings(max_step_mm=0.001))
    start = np.flatnonzero(steps.cycle == 1)[0] - 1
    loss = s.friction_loss_mJ + s.material_loss_mJ
    return float(abs((loss[-1] - loss[start]) / (s.wheel_work_mJ[-1] - s.wheel_work_mJ[start]) - 1))


def ratio(fit: Fit) -> float:
    return fit.heldout.rmse_deg / fit.baseline_heldout.rmse_deg


@cache
def traced() -> Trace:
    """Two loops of a rig whose tendon b has an arm 5 % shorter, of which their sidecars say nothing."""
    records = []
    for preload in (20.0, 10.0):
        rig = preset("du2018", preload_N=preload)
        assert rig.tendon_b is not None
        b = replace(rig.tendon_b, moment_arm_mm=0.95 * rig.tendon_b.moment_arm_mm)
        run = simulate_chain(replace(rig, tendon_b=b), triangle(2.2, cycles=2))
        noise = np.random.default_rng(int(preload)).normal(0, 0.05, run.angle_deg.size)
        declared = {"preset": "du2018", "preload_N": preload}
        records.append(Record(run.drive, run.angle_deg + noise, cycle=run.cycle, rig=declared))
    return trace_records(records)


def traced_arm() -> float:
    found = traced()
    assert found.verdict == "effect"
    return abs(found.augmented.model.values(found.augmented.x)[1][0]["arm_ratio"] - 0.95)


def parts_close() -> float:
    found = separate(preset("du2018", preload_N=20.0), loop_program(-2.2, 2.2))
    return abs(found.closure_percent)


def record_round_trip(folder: Path) -> float:
    record = loop(20.0).record
    write_record(record, folder / "loop.csv")
    again = read_record(folder / "loop.csv")
    return float(np.abs(again.angle_deg - record.angle_deg).max() + np.abs(again.tip_mm - record.tip_mm).max())


def york_angle() -> float:
    """Tip at the largest published force; AUTHORS are constants of the paper, none of which was fitted here."""
    tip = run_load_control(predicted(read_rig(YORK), AUTHORS), np.linspace(0.0, 4.2, 43)).angle_deg[-1]
    return abs(float(tip) - 144.0)


def closure(folder: Path, tube: str) -> float:
    """Closure by geometry against the largest bend that any notch was measured at."""
    record = read_record(folder / f"notched-wrist-{tube}.csv")
    by_geometry = np.degrees(joint_mechanics(preset(f"notched-wrist-{tube}")).closure_angle_rad)
    assert record.notches_deg is not None
    return abs(float(np.abs(record.notches_deg).max()) - by_geometry)


CLAIMS: dict[str, Callable[[], float]] = {
    "frictionless-angle": frictionless_angle,
    "no-friction-no-loop": lambda: abs(width(frictionless()).max_deg),
    "energy-balance": energy_balance,
    "capstan": capstan,
    "width-10N": lambda: abs(width(loop(10.0).record).max_deg - 2 * 3.52),
    "width-20N": lambda: abs(width(loop(20.0).record).max_deg - 2 * 2.21),
    "widest-place": lambda: max(abs(width(loop(p).record).at_drive) for p in (10.0, 20.0)),
    "full-scale": lambda: abs(float(np.abs(loop(20.0).record.angle_deg).max()) - 45),
    "slot-element": slot_element,
    "joint-stiffness": joint_stiffness,
    "bouc-wen-kernel": bouc_wen_kernel,
    "bouc-wen-saturation": lambda: abs(PAPER.saturation_deg - 2.754),
    "layer-du2018": layer_du2018,
    "paper-element": paper_element,
    "twins": twins,
    "chain-energy": chain_energy,
    "traced-arm": traced_arm,
    "traced-heldout": lambda: traced().augmented.heldout_rmse_deg / 0.05,
    "parts-close": parts_close,
    "york-angle": york_angle,
}


@pytest.mark.parametrize("name", CLAIMS)
def test_claim(name):
    assert CLAIMS[name]() <= bounds()[name]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "file"),
    [("layer-surgical", "surgical-manipulator-0-80.csv"), ("layer-tee-probe", "tee-probe-antero-posterior.csv")],
)
def test_claim_on_measured_data(name, file, measured):
    assert ratio(identify(read_record(measured / file))) < bounds()[name]


@pytest.mark.parametrize("tube", ["90", "150"])
def test_claim_on_measured_closure(tube, measured):
    assert closure(measured, tube) <= bounds()[f"closure-{tube}"]


def test_claim_of_the_round_trip(tmp_path):
    assert record_round_trip(tmp_path) <= bounds()["record-round-trip"]


def test_every_row_is_tested():
    measured = {"layer-surgical", "layer-tee-probe", "closure-90", "closure-150"}
    assert set(bounds()) == {*CLAIMS, *measured, "record-round-trip"}

"""Sensitivity and Pareto search: known answers on known functions, the same again with the same seed."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from how_made import MADE, printed

from studies.commands import call
from studies.results.study import Sample
from studies.sweep import read_study, run_study
from studies.sweep.cases import Outcome
from studies.sweep.pareto import front, pareto
from studies.sweep.plan import on_axes, unit_points
from studies.sweep.sensitivity import indices, saltelli_plan
from studies.sweep.study_file import Axis, Sensitivity

SEARCH = """schema = 1
title = "t"
engine = "chain"
seed = 3
[rig]
preset = "du2018"
[program]
amplitude_mm = 2.2
step_mm = 0.2
[vary]
preload_N = [10, 20, 30]
"notch.depth_mm" = [2.75, 2.85]
"material.poissons_ratio" = [0.30, 0.35]
"""
ISHIGAMI = [Axis(name, (), -math.pi, math.pi, False) for name in ("x1", "x2", "x3")]


def ishigami(rows: np.ndarray) -> np.ndarray:
    """Ishigami and Homma, ISUMA 1990, doi 10.1109/ISUMA.1990.151285, with a = 7, b = 0.1."""
    x1, x2, x3 = rows.T
    return np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)


def of_ishigami(count: int, seed: int = 0):
    asked = Sensitivity(count, ("y",), 0.95, 100, seed)
    return indices(ISHIGAMI, ishigami(saltelli_plan(ISHIGAMI, asked).rows), asked)


def test_indices_of_the_ishigami_function():
    """Its variance integrates by hand: V = a^2/8 + b pi^4/5 + b^2 pi^8/18 + 1/2, V1 = (1 + b pi^4/5)^2/2, V2 = a^2/8,
    V13 = b^2 pi^8 (1/18 - 1/50), V3 = 0."""
    a, b = 7.0, 0.1
    v1, v2, v13 = (1 + b * math.pi**4 / 5) ** 2 / 2, a**2 / 8, b**2 * math.pi**8 * (1 / 18 - 1 / 50)
    v = v1 + v2 + v13
    first, total = {"x1": v1 / v, "x2": v2 / v, "x3": 0.0}, {"x1": (v1 + v13) / v, "x2": v2 / v, "x3": v13 / v}
    found = of_ishigami(1024)
    assert found.variance == pytest.approx(v, rel=0.02)
    for name, row in found.indices.items():
        assert row.first.value == pytest.approx(first[name], abs=0.02)
        assert row.total.value == pytest.approx(total[name], abs=0.02)
        assert row.first.low <= first[name] <= row.first.high
        assert row.total.low <= total[name] <= row.total.high


def test_indices_again_with_the_same_seed():
    assert of_ishigami(64, seed=5) == of_ishigami(64, seed=5)
    assert of_ishigami(64, seed=5) != of_ishigami(64, seed=6)


def test_failed_cases_leave_out_their_block():
    asked = Sensitivity(64, ("y",), 0.95, 100, 0)
    values = ishigami(saltelli_plan(ISHIGAMI, asked).rows)
    values[[3, 4, 17]] = np.nan  # two blocks of 5
    assert indices(ISHIGAMI, values, asked).blocks == 62
    assert indices(ISHIGAMI, np.full_like(values, 2.0), asked) is None


def test_whole_numbers_come_up_equally_often():
    axis = Axis("notch.count", (), 10.0, 14.0, True)
    values, counts = np.unique(on_axes([axis], unit_points(Sample("sobol", 4096, 0), 1)), return_counts=True)
    assert values.tolist() == [10, 11, 12, 13, 14]
    assert np.ptp(counts) <= 2  # 4096 points of a net, cut in fifths


def test_sensitivity_of_the_rig(tmp_path):
    """The preload rules the tension, which is linear in it; Poisson's ratio enters only the shear, which is small."""
    text = SEARCH.replace("du2018", "du2018-full-widths")  # of less friction, which adds to the tension
    text += '[sensitivity]\ncount = 32\nquantities = ["tension_max_N", "loop_width_max_deg", "slack_reached"]\n'
    (tmp_path / "s.toml").write_text(text)
    run_study(read_study(tmp_path / "s.toml"), tmp_path / "out", workers=1)
    result = json.loads((tmp_path / "out" / "sensitivity.json").read_text())
    assert result["cases"] == 32 * 5
    rows = result["quantities"]["tension_max_N"]["indices"]
    assert rows["preload_N"]["total"]["value"] > 0.95
    assert abs(rows["material.poissons_ratio"]["total"]["value"]) < 0.01
    assert result["without_indices"] == ["slack_reached"]  # none of these preloads lets the tendon go
    again = run_study(read_study(tmp_path / "s.toml"), tmp_path / "out", workers=1)
    assert again.computed == 0
    repeated = json.loads((tmp_path / "out" / "sensitivity.json").read_text())
    assert repeated["quantities"] == result["quantities"]
    assert (repeated["computed"], repeated["from_store"]) == (0, 160)


def test_front_of_a_known_set():
    """Of four points in a plane, (2, 2) is beaten by (1, 1), and (3, 0.5) by none."""
    assert front(np.array([[1.0, 1.0], [2.0, 2.0], [0.5, 3.0], [3.0, 0.5]])).tolist() == [0, 2, 3]


PARETO = (
    SEARCH
    + """[pareto]
population = 16
generations = 12
variables = ["preload_N", "notch.depth_mm"]
[pareto.objectives]
tension_max_N = "min"
loop_width_max_deg = "min"
[pareto.limits]
full_scale_angle_deg = { min = 0.2 }
"""
)


def schaffer(points):
    """Schaffer's first problem, x^2 and (x - 2)^2 over -1 to 3: its front is 0 <= x <= 2. The second is worse."""
    out = []
    for p in points:
        x, y = 4 * (p["preload_N"] - 10) / 20 - 1, 10 * (p["notch.depth_mm"] - 2.75)
        goals = {"tension_max_N": x**2 + y, "loop_width_max_deg": (x - 2) ** 2 + y, "full_scale_angle_deg": x}
        out.append(Outcome("k", "failed" if y > 0.9 else "ok", "", 0.0, goals))
    return out


def test_front_of_a_known_problem(tmp_path):
    """On the front y = 0 and 0 <= x <= 2; the limit x >= 0.2 cuts it, and what fails is never on it."""
    (tmp_path / "s.toml").write_text(PARETO)
    asked = read_study(tmp_path / "s.toml")
    result = pareto(asked, schaffer)
    x = np.array([design["full_scale_angle_deg"] for design in result.front])
    y = np.array([design["notch.depth_mm"] for design in result.front]) - 2.75
    assert len(x) >= 10
    assert x.min() >= 0.2
    assert x.max() <= 2.05
    assert np.median(y) < 0.01
    assert result.fixed == {"material.poissons_ratio": pytest.approx(0.325)}
    assert pareto(asked, schaffer) == result


@pytest.mark.slow
def test_pareto_search_of_the_rig(tmp_path, capsys):
    """No design of the front beats another, all keep the limit; with the same seed again all comes from the store."""
    file = tmp_path / "s.toml"
    file.write_text(PARETO.replace("min = 0.2", "min = 44.0").replace("generations = 12", "generations = 3"))
    assert call(["study", str(file), "--out", str(tmp_path / "out"), "--workers", "1", "--json"]) == 0
    shown = json.loads(capsys.readouterr().out)
    assert shown["pareto"] == "pareto.json"
    summary, page = tmp_path / "out" / "study.json", (tmp_path / "out" / "report.html").read_text()
    printed(summary, page, ["study", file, "--out", tmp_path / "out", "--workers", 1])
    assert shown["made"] == json.loads(summary.read_text())["made"]
    text = (tmp_path / "out" / "pareto.json").read_text()
    designs = json.loads(text)["front"]
    goals = np.array([[d["tension_max_N"], d["loop_width_max_deg"]] for d in designs])
    assert front(goals).tolist() == list(range(len(goals)))
    assert all(d["full_scale_angle_deg"] >= 44.0 for d in designs)
    assert run_study(read_study(file), tmp_path / "out", workers=1, made=MADE).computed == 0
    assert json.loads(summary.read_text())["made"]["command"] == MADE.command  # of the latest call
    assert (tmp_path / "out" / "pareto.json").read_text() == text
    # more tension, less width: the trade that the paper shows
    order = np.argsort(goals[:, 0])
    assert (np.diff(goals[order, 1]) < 0).all()


def test_limits_that_nothing_keeps(tmp_path, capsys):
    file = Path(tmp_path / "s.toml")
    file.write_text(PARETO.replace("min = 0.2", "min = 400").replace("generations = 12", "generations = 1"))
    assert call(["study", str(file), "--out", str(tmp_path / "out"), "--workers", "1", "--quiet"]) == 2
    assert "pareto.limits" in capsys.readouterr().err

"""``[require]`` of a study: its cases are judged by these bounds, in place of the limits of Nitinol."""

import json

import pytest
import xarray as xr
from small_study import GRID, study_file

from studies.report.parts.feasible import feasibility
from studies.sweep import StudyError, read_study

REQUIRE = "[require]\npeak_strain_percent = { max = 2 }\nloop_width_max_deg = { min = 1, max = 3 }\n"


def study_of(**require):
    data = xr.Dataset(
        {
            "status": ("case", ["ok", "ok", "ok", "failed"]),
            "peak_strain_percent": ("case", [1.0, 3.0, 1.5, 0.5]),
            "fatigue_margin": ("case", [2.0, 2.0, 0.5, 2.0]),
        }
    )
    return data.assign_attrs({"require": json.dumps(require)} if require else {})


def test_bounds_of_a_study_file(tmp_path):
    study = read_study(study_file(tmp_path, GRID + REQUIRE))
    assert [(one.quantity, one.low, one.high) for one in study.require] == [
        ("peak_strain_percent", None, 2.0),
        ("loop_width_max_deg", 1.0, 3.0),
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[require]\npeak_strain_percent = 2\n", "require.peak_strain_percent = 2: expected { min = }"),
        ("[require]\nmass_g = { max = 2 }\n", "require.mass_g"),
        ("[require]\npeak_strain_percent = { most = 2 }\n", "require.peak_strain_percent.most"),
    ],
)
def test_bad_bound_is_refused(tmp_path, text, words):
    with pytest.raises(StudyError, match=words.replace("{", "\\{").replace("}", "\\}")):
        read_study(study_file(tmp_path, GRID + text))


def test_cases_are_judged_by_them():
    found = feasibility(study_of(peak_strain_percent={"min": None, "max": 2.0}))
    assert (found.kept, found.cases) == (2, 3)
    assert [limit.words for limit in found.limits] == ["peak strain at most 2 %"]


def test_without_them_the_limits_of_nitinol_hold():
    found = feasibility(study_of())
    assert found.kept == 2
    assert "fatigue" in found.limits[0].words

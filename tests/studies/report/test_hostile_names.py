"""Names in results are text: in a browser nothing of them is evaluated, opens a dialog or becomes an element."""

import json
import re
import shutil

import numpy as np
import pytest
import xarray as xr
from browser import chromium, keep_picture, listen
from results_folder import ERRORS, copy_results

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.record import RecordError
from studies.commands.cli import call
from studies.report import write_report
from studies.report.trace_page import trace_page
from studies.results.fit import WHAT
from studies.results.trace_samples import TraceSamples
from validation.tracing.fitting.ranking import RankedModel
from validation.tracing.result import (
    CandidateReport,
    FoldErrors,
    NoiseReport,
    ResidualReport,
    SampleCount,
    SmoothReport,
    TraceReport,
)

NAME = "{{7*7}}<img src=x onerror=alert(1)><script>alert(2)<svg onload=alert(3)>`${alert(4)}`'\"$\\frac{$"
"""A name that a file, a column or a variable can have: a slash would be a folder."""
TEXT = f"</script></title></svg>{NAME}<a href='javascript:alert(5)'>it</a>"
PLACES = {
    "run/run.json": [
        "versions.notchbend", "rig.0.name", "rig.0.source", "rig.0.note", "loops.0.title", "loops.1.title",
        "loops.0.strain_limits.0.name", "loops.0.strain_limits.0.kind", "loops.0.strain_limits.0.source",
        "crosscheck.0.rig", "crosscheck.1.rig", "fits.0.title", "separations.0.label", "separations.0.command",
        "picture.caption", "picture.missing",
    ],
    "run/identify-du2018-20N.json": [
        "kinematics", "drive_unit", "warnings.0", "heldout_by", "parameters.A.unit",
    ],
    "run/separate-du2018-20N.json": ["rig.name", "engine", "inseparable"],
    "trace/trace.json": [
        "verdict", "records.0", "effects.0.name", "effects.0.parameters.width_mm.unit", "effects.0.confusable_with.0",
        "candidates.0.name", "next_experiment", "figures.0.caption",
    ],
    "study/pareto.json": ["engine", "objectives.full_scale_angle_deg.units"],
    "study/sensitivity.json": ["engine", "quantities.full_scale_angle_deg.units"],
    "study/study.json": ["versions.numpy", "state"],
}  # fmt: skip
"""The texts of stored results that are taken as they are, by file."""


def put(values, keys, text):
    *way, last = (int(key) if key.isdigit() else key for key in keys.split("."))
    for key in way:
        values = values[key]
    values[last] = text


def hostile_study(folder):
    """Give every name in the dataset of a study to the attacker: title, axes, quantities, units, messages."""
    with xr.open_zarr(folder / "study.zarr", consolidated=False) as opened:
        data = opened.load()
    names = {"full_scale_angle_deg": f"q{NAME}", "preload_N": f"x{NAME}", "notch.depth_mm": f"y{NAME}"}
    data = data.rename(names)
    for variable in (data[f"q{NAME}"], data["peak_strain_percent"], data[f"x{NAME}"], data[f"y{NAME}"]):
        variable.attrs |= {"units": TEXT, "long_name": TEXT}
    data["message"] = data["message"].astype(object).where(data["status"] != "failed", TEXT)
    data["message"] = data["message"].astype(np.dtypes.StringDType())
    data.attrs |= {"title": TEXT, "engine": TEXT}
    for variable in data.variables.values():
        variable.encoding.clear()
    shutil.rmtree(folder / "study.zarr")
    data.to_zarr(folder / "study.zarr", mode="w", zarr_format=3, consolidated=False)


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    """The pages of a run, a trace and a study whose names are hostile, in that order; and that of the trace alone."""
    top, out = tmp_path_factory.mktemp("hostile"), {}
    copy_results(tmp_path_factory, top)
    for file, places in PLACES.items():
        values = json.loads((top / file).read_text())
        for keys in places:
            put(values, keys, TEXT)
        (top / file).write_text(json.dumps(values))
    figure = top / "trace" / "trace-residual.csv"
    quoted = NAME.replace('"', '""')
    figure.write_text(figure.read_text().replace("drive_mm,before_deg", f'"{quoted}","b{quoted}"'))
    hostile_study(top / "study")
    for name in ("run", "trace", "study"):
        out[name] = write_report(top / name)
    out["trace alone"] = top / "alone.html"
    out["trace alone"].write_text(trace_page(*hostile_trace()))
    return out


def hostile_trace():
    """A result of ``notchbend trace`` with a hostile text wherever it has one, and its samples."""
    drive = np.concatenate([np.linspace(-1, 1, 20), np.linspace(1, -1, 20)] * 2)
    samples = TraceSamples(
        drive_unit=TEXT, clock="time_s", record=np.ones(80, dtype=int), cycle=np.repeat([1, 2], 40), drive=drive,
        time=np.arange(80.0), angle_deg=20 * drive, baseline_deg=20 * drive + 0.5, augmented_deg=20 * drive,
    )  # fmt: skip
    report = TraceReport(
        schema=1, records=(NAME,), noise_floor_deg=0.05, before=FoldErrors(ERRORS, ERRORS), verdict="unexplained",
        explained_share=None, noise=NoiseReport(0.05, 0.05, TEXT), reference=(), effects=(),
        after=FoldErrors(ERRORS, ERRORS), detection_limits=(), multibody=None,
        candidates=(CandidateReport(TEXT, 0.1, 5.0),), next_experiment=TEXT, rig_known=True, model=TEXT,
        heldout_by=TEXT, declared={NAME: Parameter(1.0, 0.9, 1.1, TEXT)}, words=(TEXT,),
        smooth=SmoothReport((TEXT,), 0.1), residual=ResidualReport((), None), samples=SampleCount(80, 40.0),
        multibody_words=TEXT, alike=10.0, seconds=None, seed=0, samples_file=NAME, held_out=(False,),
        ranking=tuple(RankedModel(who, 0.2, 0.1, 0.3, bic, chosen=False) for who, bic in ((TEXT, 0.0), ("", 9.0))),
    )  # fmt: skip
    return report, samples


@pytest.fixture(scope="module")
def running():
    with chromium() as browser:
        yield browser


@pytest.mark.parametrize(
    "name", [*(pytest.param(name, marks=pytest.mark.slow) for name in ("run", "trace")), "study", "trace alone"]
)
def test_names_are_shown_as_they_are(name, pages, running):
    page = running.new_context(viewport={"width": 1280, "height": 900}).new_page()
    heard, dialogs = listen(page), []
    page.on("dialog", lambda dialog: (dialogs.append(dialog.message), dialog.dismiss()))
    page.goto(pages[name].as_uri())
    page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
    page.wait_for_timeout(300)
    assert (dialogs, heard.errors, heard.hosts) == ([], [], [])
    assert page.locator("[onerror], [onload], img[src=x], [href^='javascript']").count() == 0
    assert NAME in page.locator("main").inner_text()
    keep_picture(page, f"hostile-{name.replace(' ', '-')}", full_page=True)
    page.close()


def test_every_hostile_text_is_escaped(pages):
    """Without a browser: outside of scripts no tag is made of a name, and no script ends before its end."""
    for page in pages.values():
        html = page.read_text()
        assert "<img src=x" not in html
        assert "<svg onload" not in html
        assert "<script>alert" not in html
        bare = re.sub(r"<(script|style)\b.*?</\1>", "", html, flags=re.S)
        assert "{{7*7}}" in bare  # not 49


def test_the_name_of_a_fit_may_have_slashes(tmp_path, tmp_path_factory, capsys):
    """A name that is no file is refused in one line; ``Path.with_name`` made it a traceback."""
    folder = copy_results(tmp_path_factory, tmp_path)["run"]
    values = json.loads((folder / "run.json").read_text())
    put(values, "fits.0.name", TEXT)
    (folder / "run.json").write_text(json.dumps(values))
    assert call(["report", str(folder)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert len(error) < 300 + len(str(folder))
    with pytest.raises(RecordError, match=WHAT):
        write_report(folder)

"""The front door: what it exports, what it loads, and that it does the work of the commands."""

import json
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from how_made import printed
from matplotlib.figure import Figure

import notchbend as nb
from fem_models.rig import Rig
from fem_models.rig.of_record import rig_of
from hysteresis.own import marked_values
from studies.bench_record import SHIPPED
from studies.commands import separation
from studies.commands.cli import call
from studies.engines import ENGINES
from studies.report import write_report

ROOT = Path(__file__).parents[1]
HEAVY = ("exudyn", "pyvista", "gmsh", "matplotlib", "pandas", "xarray", "zarr", "distributed", "typer", "cma", "skfem")
"""Libraries that some functions need, and the import must not load; exudyn and pyvista need the system's libGL."""
STUDY = """\
schema = 1
title = "two preloads"
engine = "chain"
[rig]
preset = "du2018"
[program]
amplitude_mm = 1.0
cycles = 1
[vary]
preload_N = [10, 20]
[quantities]
groups = ["loop"]
"""


@pytest.fixture(scope="module")
def record() -> nb.Record:
    return nb.simulate(nb.preset("du2018"), nb.triangle(2.2, cycles=2), engine="chain")


@pytest.fixture(scope="module")
def fit(record: nb.Record) -> nb.Fit:
    return nb.identify(record)


# --- what is exported --------------------------------------------------------------------------------------------


def test_every_name_is_there_and_documented() -> None:
    for name in nb.__all__:
        assert getattr(nb, name) is not None, name
        assert getattr(nb, name).__doc__ or name == "__version__", name
    assert nb.__version__.count(".") == 2
    assert nb.Rig is Rig


def test_the_example_of_the_module_runs() -> None:
    lines = [line.strip().removeprefix(">>> ") for line in nb.__doc__.splitlines() if line.startswith(">>>")]
    names: dict[str, object] = {}
    exec("\n".join(lines), names)
    assert isinstance(names["figure"], Figure)


def test_import_loads_nothing_heavy() -> None:
    code = f"import sys, notchbend; print([name for name in {HEAVY} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_without_exudyn_all_but_the_multibody_model_works(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "exudyn", None)  # as on a machine without libGL: its import fails
    program = nb.triangle(1.0, step_mm=0.25)
    assert nb.simulate(nb.preset("du2018"), program, engine="analytic").kind == "simulated"
    with pytest.raises(nb.MissingError, match="exudyn cannot be imported"):
        nb.simulate(nb.preset("du2018"), program)


# --- the same as the commands ------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", ENGINES)
def test_simulate_is_the_engine(engine: str) -> None:
    rig, program = nb.preset("du2018"), nb.triangle(1.0, step_mm=0.25)
    assert nb.simulate(rig, program, engine=engine) == ENGINES[engine](rig, program)


def test_an_unknown_engine_is_named() -> None:
    with pytest.raises(ValueError, match="engine = 'solid': expected one of multibody, chain, analytic"):
        nb.simulate(nb.preset("du2018"), nb.triangle(1.0), engine="solid")


def without_time(values: Mapping[str, object]) -> dict[str, object]:
    """Values of a fit; a file carries the mark of its maker, and how it was made, too."""
    return {key: value for key, value in values.items() if key not in ("seconds", "maker", "made")}


@pytest.mark.slow
def test_identify_gives_the_numbers_of_the_command(record: nb.Record, tmp_path: Path) -> None:
    """Of a record in memory and of its file: the rig's analytic kinematics, and no warning for lack of them."""
    path = tmp_path / "loop.csv"
    nb.write_record(record, path)
    assert call(["identify", str(path), "--out", str(tmp_path / "fit"), "--quiet"]) == 0
    stored = json.loads((tmp_path / "fit" / "identify.json").read_text())
    assert without_time(nb.identify(nb.read_record(path)).to_dict()) == without_time(stored)
    in_memory = nb.identify(record).to_dict()
    assert in_memory["kinematics"] == "analytic"
    assert without_time(in_memory) | {"records": [str(path)]} == without_time(stored)


@pytest.mark.slow
def test_identify_of_several_records_and_settings_is_that_of_the_command(record: nb.Record, tmp_path: Path) -> None:
    low = nb.simulate(nb.preset("du2018", preload_N=10.0), nb.triangle(2.2, cycles=2), engine="chain")
    paths = [tmp_path / "20N.csv", tmp_path / "10N.csv"]
    for one, path in zip((record, low), paths, strict=True):
        nb.write_record(one, path)
    options = ["--elements", "0", "--seed", "3", "--out", str(tmp_path / "fit"), "--quiet"]
    assert call(["identify", *map(str, paths), *options]) == 0
    fit = nb.identify(
        [nb.read_record(path) for path in paths], settings=nb.IdentifySettings(elements=None, law="auto", seed=3)
    )
    assert without_time(fit.to_dict()) == without_time(json.loads((tmp_path / "fit" / "identify.json").read_text()))
    table = np.genfromtxt(tmp_path / "fit" / "identify-2.csv", delimiter=",", names=True)
    for name, column in fit.to_dataframe(1).items():
        np.testing.assert_array_equal(table[name], column)


@pytest.mark.slow
def test_compensate_gives_the_drive_of_the_command(record: nb.Record, fit: nb.Fit, tmp_path: Path) -> None:
    nb.write_record(record, tmp_path / "loop.csv")
    reference = 20 * np.sin(np.linspace(0, 6, 25))
    np.savetxt(tmp_path / "wanted.csv", reference, header="angle_deg", comments="")
    files = [str(tmp_path / "loop.csv"), "--reference", str(tmp_path / "wanted.csv"), "--out", str(tmp_path / "d.csv")]
    assert call(["compensate", *files, "--elements", "1", "--quiet"]) == 0
    found = nb.compensate(record, reference, settings=nb.IdentifySettings(elements=1))
    table = np.genfromtxt(tmp_path / "d.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(found.drive, table["drive_mm"])
    assert list(found.to_dataframe()) == list(table.dtype.names)
    assert repr(found).startswith("Compensation(25 samples, drive ")
    assert json.loads(json.dumps(found.to_dict()))["samples"] == 25
    with pytest.raises(nb.RecordError, match=r"reference:2: column 'angle_deg' = 90"):
        nb.compensate(fit, [90.0, 0.0])


def test_separate_refuses_with_records_what_a_rig_alone_takes():
    record = nb.simulate(nb.preset("du2018"), nb.triangle(1.0), engine="chain")
    for given in ({"amplitude_mm": 1.0}, {"engine": "multibody"}, {"members": [nb.preset("du2018")]}):
        with pytest.raises(nb.RecordError, match="with records"):
            nb.separate(record, **given)


@pytest.mark.slow
def test_separate_gives_the_result_of_the_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert call(["separate", "--preset", "du2018", "--amplitude", "1", "--out", str(tmp_path), "--quiet"]) == 0
    found = nb.separate(nb.preset("du2018"), amplitude_mm=1.0)
    stored = json.loads((tmp_path / "separate.json").read_text())
    words = ["separate", "--preset", "du2018", "--amplitude", "1", "--out", tmp_path]
    again = printed(tmp_path / "separate.json", write_report(tmp_path).read_text(), words)
    divided = []
    monkeypatch.setattr(separation, "separate_rig", lambda *given, **_: divided.append(given) or found)
    assert call([*again, "--quiet"]) == 0  # as printed; found above, which takes seconds
    assert divided == [(nb.preset("du2018"), 1.0)]
    assert json.loads((tmp_path / "separate.json").read_text()) | {"made": stored["made"]} == stored
    del stored["made"]
    assert json.loads(json.dumps(marked_values(found.to_dict()))) == stored
    assert len(repr(found)) < 250
    assert "tendon elasticity" in found._repr_html_()
    figure = nb.plot(found)
    assert figure_has_lines(figure)
    figure.draw_without_rendering()
    legend, title = figure.axes[0].get_legend(), figure.axes[0]._left_title
    assert not legend.get_window_extent().overlaps(title.get_window_extent())


def test_study_gives_the_folder_of_the_command(tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(STUDY)
    found = nb.study(tmp_path / "two.toml", tmp_path / "out", workers=1)
    assert found.report.read_text().startswith("<!doctype html>")
    assert marked_values(found.to_dict()) == json.loads((tmp_path / "out" / "study.json").read_text())
    assert repr(found) == f"StudyResult('two preloads', 2 cases, 0 failed, finished, in {tmp_path / 'out'})"
    assert "loop_width_max_deg" in found._repr_html_()
    assert found.to_xarray()["loop_width_max_deg"].attrs["units"] == "deg"
    assert found.to_dataframe()["preload_N"].tolist() == [10.0, 20.0]
    assert figure_has_lines(nb.plot(found))
    again = nb.study(tmp_path / "two.toml", tmp_path / "out", workers=1)
    assert (again.summary.computed, again.summary.from_store) == (0, 2)


def test_a_ready_study_and_an_unknown_one() -> None:
    with pytest.raises(nb.StudyError, match="expected a study file in TOML, or one of notch-geometry, preload"):
        nb.study("nothing", "out")


# --- figures -----------------------------------------------------------------------------------------------------


def figure_has_lines(figure: Figure) -> bool:
    return all(axes.lines or axes.patches or axes.collections for axes in figure.axes if axes.get_visible())


def test_loops_of_one_record_and_of_several(record: nb.Record) -> None:
    axes = nb.plot(record).axes[0]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), record.angle_deg)
    assert axes.get_xlabel() == "drive, mm"
    axes = nb.plot([record, nb.read_record(SHIPPED)]).axes[0]
    assert axes.get_legend().get_texts()[0].get_text() == record.title
    with pytest.raises(TypeError, match="Rig beside records"):
        nb.plot([record, nb.preset("du2018")])
    with pytest.raises(TypeError, match="drives in mm and N: expected one unit"):
        nb.plot([record, nb.Record([0, 1, 0], [0, 1, 0], drive_unit="N")])


def test_fit_shows_record_model_and_residual(record: nb.Record, fit: nb.Fit) -> None:
    loop, less_backbone, residual = nb.plot(fit).axes
    np.testing.assert_array_equal(loop.lines[2].get_ydata(), fit.predict(record.drive))
    opened = fit.predict(record.drive) - fit.plain(record.drive)
    np.testing.assert_array_equal(less_backbone.lines[1].get_ydata(), opened)
    np.testing.assert_array_equal(residual.lines[0].get_ydata(), record.angle_deg - fit.predict(record.drive))


def test_trace_shows_the_residual_of_each_record(record: nb.Record) -> None:
    trace = nb.trace(record)
    assert trace.verdict == "none"
    assert "\n" not in repr(trace)
    assert trace._repr_html_()
    (axes,) = nb.plot(trace).axes
    assert [line.get_label() for line in axes.lines][:2] == ["baseline", "2 x noise floor"]
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), trace.baseline.residuals[0])


@pytest.mark.parametrize("name", ["du2018", "notched-wrist-90"])
def test_side_view_of_a_rig(name: str) -> None:
    """The outline has four corners a cut, and each end of the tube; the tendons are at their moment arms."""
    rig = nb.preset(name)
    (axes,) = nb.plot(rig, view="side").axes
    outline, *tendons = axes.lines
    assert len(outline.get_xdata()) == 2 * (4 * rig.joints + 2) + 1
    assert outline.get_xdata().max() == pytest.approx(rig.joints * rig.pitch_mm)
    assert [line.get_ydata()[0] for line in tendons] == [2.58, -2.58] if name == "du2018" else [0.6]


def test_program_and_measured_joints() -> None:
    assert nb.plot(nb.sine(1.0, 0.5)).axes[0].get_xlabel() == "time, s"
    assert nb.plot(nb.triangle(1.0)).axes[0].get_xlabel() == "sample"
    measured = {
        "joints": 10,
        "moment_arm_mm": 2.6,
        "flexure_stiffness_Nmm_per_rad": 520.0,
        "tendon_EA_N": 9000.0,
        "tendon_free_length_mm": 150.0,
        "pitch_mm": 2.6,
        "preload_N": 10.0,
    }
    rig = rig_of(nb.Record([0, 1, 0], [0, 1, 0], rig=measured))
    axis, joints, *tendons = nb.plot(rig, view="side").axes[0].lines
    assert len(joints.get_xdata()) == 10
    assert axis.get_xdata().tolist() == [0, 26]
    assert [line.get_ydata()[0] for line in tendons] == [2.6, -2.6]


def test_a_figure_shows_itself_once_and_other_things_are_refused(fit: nb.Fit) -> None:
    import matplotlib.pyplot as plt

    assert nb.plot(fit)._repr_png_().startswith(b"\x89PNG")
    assert plt.get_fignums() == []  # pyplot would show it a second time
    with pytest.raises(TypeError, match="what = 3: expected a record, records, a rig"):
        nb.plot(3)


# --- representations of what goes in -----------------------------------------------------------------------------


def test_rig_and_program_print_in_one_line() -> None:
    assert repr(nb.preset("du2018")) == "Rig('du2018', 14 notches, 2 tendons, preload 20 N)"
    assert repr(nb.preset("notched-wrist-90")).endswith("1 tendon, preload 0 N, superelastic, closure)")
    assert repr(nb.sine(1.0, 0.5)) == "LoadProgram(samples 126, drive -1 to 1 mm, time 0 to 2.5 s, cycles 0 to 1)"
    assert "EA_N = 17000.0" in nb.preset("du2018")._repr_html_()
    assert "-1 to 1 mm" in nb.triangle(1.0)._repr_html_()
    assert list(nb.triangle(1.0).to_dict()) == ["drive_mm", "cycle"]

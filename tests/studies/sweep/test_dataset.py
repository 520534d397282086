"""The dataset of a study: its numbers, its units, and how it is written."""

import dataclasses
import json
import math
import tracemalloc
import warnings

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st
from small_study import GRID, HEAD, PROGRAM, same, study_file

from fem_models.chain.solve import solve_chain
from fem_models.load import triangle
from fem_models.rig import preset
from fem_models.rig.rig import with_notch
from hysteresis.records.metrics import loop_width
from studies.sweep import dataset, open_study, read_study
from studies.sweep.cases import evaluate
from studies.sweep.plan import cases, plan_of
from studies.sweep.store import open_store


def test_quantities_are_those_of_the_engine(finished):
    """A case of the dataset, beside the chain called by hand and measured by the loop metrics."""
    data = open_study(finished[0] / "out").sel({"preload_N": 15.0, "notch.depth_mm": 2.8})
    rig = preset("du2018", preload_N=15.0)
    rig = with_notch(rig, dataclasses.replace(rig.joint.notch, depth_mm=2.8))
    solution = solve_chain(rig, triangle(2.2, cycles=2))
    record = solution.record
    width = loop_width(record.drive, record.angle_deg, record.cycle)
    assert data.full_scale_angle_deg == np.abs(record.angle_deg).max()
    assert data.loop_width_max_deg == width.max_deg
    assert data.loop_width_at_zero_deg == width.at_zero_deg
    assert data.tension_max_N == solution.segment_tensions_N.max()
    assert data.peak_strain_percent == 100 * np.abs(solution.peak_strain).max()
    assert data.superelastic_margin == pytest.approx(6 / data.peak_strain_percent)  # ASTM F2516: 6 %
    # a closed loop gives back what it stores: the wheel's work is what friction and material have lost
    last = record.cycle == 2
    lost = sum(np.ptp(loss[last]) for loss in (solution.friction_loss_mJ, solution.material_loss_mJ))
    assert data.dissipated_mJ == pytest.approx(lost, rel=0.03)  # the work is summed in steps of 0.1 mm


def test_the_dataset_opens_with_xarray_alone_without_a_warning(finished):
    """The file contract: no option, no word; in Zarr's format 3 only consolidated metadata do that."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with xr.open_zarr(finished[0] / "out" / "study.zarr") as opened:
            widths = opened.loop_width_max_deg.values
    assert np.array_equal(widths, open_study(finished[0] / "out").loop_width_max_deg, equal_nan=True)


def test_more_preload_less_hysteresis(finished):
    """The paper's trend (Mech. Sci. 9, 2018): 3.52 deg at 10 N, 2.21 deg at 20 N, half widths."""
    width = open_study(finished[0] / "out").loop_width_max_deg.sel({"notch.depth_mm": 2.825})
    assert (np.diff(width) < 0).all()
    assert width.sel(preload_N=10.0) == pytest.approx(7.04, rel=0.05)
    assert width.sel(preload_N=20.0) == pytest.approx(4.42, rel=0.05)


def test_failed_cases_are_kept_and_the_rest_goes_on(finished):
    folder, summary = finished
    data = open_study(folder / "out")
    bad = data.sel({"notch.depth_mm": 3.2})
    assert (bad.status == "failed").all()
    assert all("notch.depth_mm = 3.2" in m and "below 3.1" in m for m in bad.message.values)
    assert np.isnan(bad.loop_width_max_deg).all()
    assert (bad.wall_s > 0).all()
    assert (data.sel({"notch.depth_mm": [2.8, 2.825]}).status == "ok").all()
    assert summary.failures.count == 4


def test_dataset_says_what_it_is(finished):
    folder, _ = finished
    data = open_study(folder / "out")
    assert dict(data.sizes) == {"preload_N": 4, "notch.depth_mm": 3}
    assert data.preload_N.attrs["units"] == "N"
    assert data["notch.depth_mm"].attrs["units"] == "mm"
    assert all({"units", "long_name"} <= set(data[n].attrs) for n in data.data_vars if n not in ("status", "message"))
    assert data.attrs["study"] == GRID
    assert data.attrs["schema"] == 1
    assert json.loads(data.attrs["versions"])["numpy"] == np.__version__
    assert (folder / "out" / "inputs" / "s.toml").read_text() == GRID
    assert set(json.loads(data.attrs["inputs_sha256"])) == {"s.toml"}
    assert json.loads((folder / "out" / "study.json").read_text())["cases"] == 12


def test_numbers_read_back_to_the_last_bit(finished):
    """The case run here against what went through worker, store and Zarr."""
    folder, _ = finished
    asked = read_study(folder / "s.toml")
    data = open_study(folder / "out")
    for case in list(cases(asked, plan_of(asked).points()))[:2]:
        mine = evaluate(case.key, case.inputs)
        for name, value in mine.quantities.items():
            assert data[name].sel(case.values).item() == value


@pytest.mark.slow
def test_the_dataset_is_written_block_by_block(finished, tmp_path, monkeypatch):
    """Of any block size the same, and memory depends on the block, not on the number of cases."""
    folder, _ = finished
    asked = read_study(folder / "s.toml")
    monkeypatch.setattr(dataset, "BLOCK", 5)
    (tmp_path / "out").mkdir()
    with open_store(folder / "out") as store:
        overview = dataset.write_dataset(asked, plan_of(asked), store, tmp_path / "out")
    same(open_study(tmp_path / "out"), open_study(folder / "out"))
    assert overview.status == {"ok": 8, "failed": 4, "pending": 0}
    angle = open_study(tmp_path / "out").full_scale_angle_deg
    assert overview.extremes["full_scale_angle_deg"].max.value == angle.max()
    assert angle.sel(overview.extremes["full_scale_angle_deg"].min.at) == angle.min()

    monkeypatch.setattr(dataset, "BLOCK", 100)
    peaks = []
    for count in (300, 1500):
        text = HEAD + PROGRAM + f"[vary]\npreload_N = {{ from = 5, to = 40, count = {count} }}\n"
        wide = read_study(study_file(tmp_path, text))
        with open_store(tmp_path / "empty") as store:
            tracemalloc.start()
            dataset.write_dataset(wide, plan_of(wide), store, tmp_path / "empty")
            peaks.append(tracemalloc.get_traced_memory()[1])
            tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1200 * 40  # the values of the axis; whole it would be 13 numbers and 2 texts a case


@given(st.lists(st.integers(1, 9), min_size=1, max_size=4), st.integers(1, 40))
def test_blocks_make_up_the_grid_in_the_order_of_its_cases(shape, most):
    numbers = np.arange(math.prod(shape)).reshape(shape)
    found = [numbers[block].ravel() for block in dataset.blocks(tuple(shape), most)]
    assert np.array_equal(np.concatenate(found), numbers.ravel())
    assert max(map(len, found)) <= most

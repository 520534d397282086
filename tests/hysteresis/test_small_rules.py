"""Rules of files, folds, intervals and kernels on the smallest cases that show them."""

import math
import signal
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.files import folder_beside, write_files
from hysteresis.fitting import identification, law_choice, model_choice, response, search
from hysteresis.fitting.form import Form
from hysteresis.fitting.samples import Samples
from hysteresis.fitting.uncertainty import Parameter, Reader, _Blocks, coordinates
from hysteresis.laws.backbone import given_backbone
from hysteresis.laws.bouc_wen import BoucWen, hysteresis
from hysteresis.laws.classical import force_batch
from hysteresis.laws.elements import EVERYWHERE, LAWS, _stops_named, _stops_rows
from hysteresis.laws.stops import follow_stops
from hysteresis.records.backbone import backbone_of, is_thin
from hysteresis.records.folds import _block_masks
from hysteresis.records.metrics import _repeats, noise_floor
from hysteresis.records.record import Record, RecordError
from hysteresis.records.record_file import column_names, read_records, read_whole_records, write_record


def test_folders_of_a_file_are_made_with_those_above(tmp_path):
    path = tmp_path / "a" / "b" / "c.txt"
    write_files({path: "d"})
    assert path.read_text() == "d"
    write_files({path: "e"})
    assert path.read_text() == "e"


def test_a_folder_of_parts_is_removed_by_the_next_process_where_its_own_was_killed(tmp_path):
    path = tmp_path / "report.pdf"
    script = (
        "import os, signal, sys\nfrom pathlib import Path\nfrom hysteresis.files import folder_beside\n"
        "with folder_beside(Path(sys.argv[1])) as folder:\n"
        "    (folder / 'half').write_text('x')\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(path)], check=False)
    assert done.returncode == -signal.SIGKILL
    (left,) = tmp_path.iterdir()
    assert left.name == f".report.pdf.{left.name.split('.')[3]}.part"
    with folder_beside(path) as folder:
        assert list(tmp_path.iterdir()) == [folder]
    assert list(tmp_path.iterdir()) == []
    left.mkdir()
    write_files({path: "whole"})
    assert list(tmp_path.iterdir()) == [path]


def test_records_of_one_plane_are_given_once_and_move_one_wheel(tmp_path):
    """A second wheel that moves is refused where a model of one plane reads the record."""
    drive = np.array([0.0, 1.0, 0.0, -1.0, 0.0])
    still, moves = (Record(drive, 10 * drive, angle_2_deg=drive, drive_2=part * drive) for part in (0.0, 0.5))
    for name, one in (("still", still), ("moves", moves)):
        write_record(one, tmp_path / f"{name}.csv")
    assert len(read_records([tmp_path / "still.csv"])) == 1
    with pytest.raises(RecordError, match=r"moves\.csv"):
        read_records([tmp_path / "still.csv", tmp_path / "moves.csv"])
    assert len(read_whole_records([tmp_path / "still.csv", tmp_path / "moves.csv"])) == 2
    with pytest.raises(RecordError, match=r"still\.csv: given twice"):
        read_whole_records([tmp_path / "still.csv", tmp_path / "moves.csv", tmp_path / "." / "still.csv"])


def test_the_direction_of_a_branch_of_two_samples():
    """Up to the last tenth of the drive and down to the first one; a fold has other tenths up and down."""
    masks = _block_masks(np.array([0.0, 10.0, 0.0]))
    assert [mask.tolist() for mask in masks] == [
        [False, False, True],  # the last tenth on the way up, the first on the way down
        [True, False, False],  # the first tenth on the way up
        [False, True, False],  # the last tenth on the way down, to which the turning point counts
        [False, False, False],
    ]


def test_an_interval_has_the_unit_of_its_value():
    assert str(Parameter(1.5, 1.0, 2.0, "deg")) == "1.5 (1 to 2) deg"
    assert str(Parameter(1.5, 1.0, 2.0, "-")) == "1.5 (1 to 2)"
    assert str(Parameter(1.5, None, None, "deg")) == "1.5 deg"


def test_a_reader_follows_one_entry():
    reader = Reader(None, 4, (np.full(4, -1.0), np.full(4, 1.0)))
    assert reader.along(2).tolist() == [0, 0, 1, 0]
    assert reader.along(0, -2.0).tolist() == [-2, 0, 0, 0]


@pytest.mark.parametrize("n", [1.0, 2.5])
@pytest.mark.parametrize("gamma_share", [0.0, 0.8])
def test_a_saturated_loop_stays_saturated(n, gamma_share):
    """Far beyond saturation, in one step or in many small ones, the state is the saturation."""
    path = np.r_[0.0, 1e5, 1e5 + 1e-3 * np.arange(1, 50)]
    beta = 1.0 - 0.5 * gamma_share
    h = hysteresis(path, BoucWen(2.0, beta, 1.0 - beta, n))
    np.testing.assert_allclose(h[1:], h[1], rtol=0, atol=1e-12)
    assert h[1] == pytest.approx((2.0 / 1.0) ** (1 / n), rel=1e-12)


def test_the_first_stop_is_as_wide_as_the_law_is_there():
    """A law that starts saturated begins at b(f) times its saturation: skew and bow are not alike, nor f the centre."""
    skew, bow, centre, half, first = 0.3, -0.2, 1.0, 5.0, 4.0
    x = (first - centre) / half
    h = follow_stops(np.array([first, 4.5]), np.array([[0.9, 2.0, 0.6, 0.2, skew, bow, 1.0]]), centre, half)[0]
    assert h[0] == pytest.approx(2.0 * math.exp(skew * x + bow * x**2), rel=1e-9)


def test_steps_of_a_bootstrap_of_a_mean_scatter_as_its_standard_error():
    """A model of one constant, the scale of its column being 3: blocks of equal length, errors that add up to 0.

    A draw of k blocks moves the constant by the mean of what it drew: its variance is that of the block means over k.
    The weight (1 - 1/k)^-1/2 of a block's residual makes it unbiased.
    """
    k, length, slope = 40, 25, 3.0
    means = np.random.default_rng(2).normal(0, 0.7, k)
    means -= means.mean()
    column = np.full((length, 1), slope)
    blocks = _Blocks.of([column] * k, [np.full(length, slope * mean) for mean in means])
    steps = blocks.steps(np.random.default_rng(3))[:, 0]
    expected = means.std() / np.sqrt(k) * (1 - 1 / k) ** -0.5
    assert steps.mean() == pytest.approx(0.0, abs=4 * expected / np.sqrt(steps.size))
    assert steps.std() == pytest.approx(expected, rel=4 / np.sqrt(2 * steps.size))


def test_a_loop_is_thin_below_a_part_of_the_angle_s_range():
    """A parallelogram 20 deg high around the line 10 x: thin where the loop is narrower than 3 deg."""
    drive = np.concatenate([np.linspace(-1, 1, 201), np.linspace(1, -1, 201)[1:]] * 2)
    way = np.sign(np.gradient(drive))
    for half, thin in ((1.3, True), (1.8, False)):
        record = Record(drive, 10.0 * drive - half * way * (np.abs(drive) < 0.99))
        middle = backbone_of(record)
        assert middle is not None
        inner = np.abs(drive) < 0.9
        np.testing.assert_allclose(middle[inner], 10.0 * drive[inner], atol=0.02)
        assert is_thin(record, middle) is thin
    assert backbone_of(Record(np.zeros(5), np.arange(5.0))) is None


def test_a_turning_point_amid_the_range_is_of_the_branch_that_ends_there():
    """Up to 6, back to 4, up to 10 and down: 4 deg at the turn at 6, 8 deg at that at 4, 0 elsewhere.

    At 6 two rising samples have 4 and 0 deg, one falling sample 0: their middle is 1. At 4 it is half of 8 and 0, 2.
    """
    drive = np.r_[0:7, 5:3:-1, 5:11, 9:-1:-1].astype(float)
    angle = np.zeros(drive.size)
    angle[[6, 8]] = 4.0, 8.0
    middle = backbone_of(Record(drive, angle, cycle=np.ones(drive.size, dtype=int)))
    assert middle is not None
    expected = np.where(drive == 6, 1.0, np.where(drive == 4, 2.0, 0.0))
    np.testing.assert_allclose(middle, expected, atol=1e-12)


def test_a_wide_approach_gives_no_part_of_the_curve():
    """A first stroke over the whole range, numbered 0, is 5 deg off the loops that follow it."""
    approach, down = np.linspace(-1, 1, 41), np.linspace(1, -1, 41)[1:]
    drive = np.concatenate([approach, down, approach[1:]])
    cycle = np.repeat([0, 1], [approach.size, drive.size - approach.size])
    middle = backbone_of(Record(drive, 10.0 * drive + np.where(cycle == 0, 5.0, 0.0), cycle=cycle))
    assert middle is not None
    inner = (cycle == 1) & (np.abs(drive) < 0.9)
    np.testing.assert_allclose(middle[inner], 10.0 * drive[inner], atol=1e-9)


def test_a_law_of_stops_without_a_slope_has_no_saturation():
    law = LAWS["generalised-prandtl-ishlinskii"]
    values = np.array([np.log(2.0), np.log(0.7), *(constant.play for constant in law.constants), 0.0])
    assert law.element(0.0, values, EVERYWHERE).saturation_deg == 0.0
    assert law.element(-1.0, values, EVERYWHERE).saturation_deg > 0.0


@pytest.mark.parametrize(("longest_delay_s", "timed"), [(0.0, False), (0.2, True)])
def test_what_first_strokes_cost_is_found_with_the_times_where_there_is_a_delay(monkeypatch, longest_delay_s, timed):
    """A delay of less than a second is one, too."""
    seen = list[bool]()
    monkeypatch.setattr(identification, "join", lambda records, used, timed: seen.append(timed))
    monkeypatch.setattr(identification, "rmse", lambda samples, form, point: point)
    form = SimpleNamespace(longest_delay_s=longest_delay_s)
    kept, left_out = SimpleNamespace(form=form, point=1.0), SimpleNamespace(form=form, point=0.1)
    assert identification._costs([], [], kept, left_out)
    assert seen == [timed]


def test_blocks_are_weighted_by_the_root_of_what_their_hat_matrix_leaves():
    """Cluster-robust errors of Bell and McCaffrey (2002): W = (1 - H)^-1/2 of a block, here by its eigenvectors."""
    rng = np.random.default_rng(4)
    common = rng.normal(size=(40, 1))
    jacobians = np.split(common + 0.5 * rng.normal(size=(40, 3)), 4)  # columns that are much alike
    residuals = list(rng.normal(size=(4, 10)))
    blocks = _Blocks.of(jacobians, residuals)
    whole = np.linalg.inv(sum(j.T @ j for j in jacobians))
    for i, (j, e) in enumerate(zip(jacobians, residuals, strict=True)):
        left, vectors = np.linalg.eigh(np.eye(10) - j @ whole @ j.T)
        once = (vectors / np.sqrt(left)) @ vectors.T @ j / blocks.size
        np.testing.assert_allclose(blocks.gradients[i], once.T @ e, rtol=1e-9)
        np.testing.assert_allclose(blocks.weighted[i], once.T @ once, rtol=1e-9)


def test_columns_of_a_csv_have_the_names_of_its_header(tmp_path):
    (tmp_path / "a.csv").write_text("drive_mm, angle_deg\n0,1\n2,3\n")
    assert column_names(tmp_path / "a.csv") == ["drive_mm", "angle_deg"]


def test_noise_of_cycles_counts_the_last_sample_of_a_branch():
    """Two cycles that differ at one turning point alone, by 1 deg: 0.5 deg from their mean, in two samples of many."""
    way = np.r_[np.linspace(0, 1, 6), np.linspace(1, -1, 11)[1:], np.linspace(-1, 0, 6)[1:]]
    drive = np.r_[way, way[1:]]
    cycle = np.repeat([1, 2], [way.size, way.size - 1])
    angle = 10.0 * drive
    angle[np.flatnonzero(drive == 1.0)[1]] += 1.0
    repeats = _repeats(Record(drive, angle, cycle=cycle))
    assert len(repeats) == 2
    samples = sum(part.stop - part.start for part in repeats[0])
    tops = sum(int((drive[part] == 1.0).sum()) for part in repeats[0])
    squares = tops * 2 * 0.5**2
    expected = (squares / (samples * 2 * (1 - 1 / 2))) ** 0.5
    assert noise_floor(Record(drive, angle, cycle=cycle)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("errors", "agreeing"), [((0.5, 0.504, 0.506), 2), ((3.0, 3.02, 3.04), 2), ((0.0, 0.0), 2)])
def test_searches_agree_within_one_percent_of_the_best(monkeypatch, errors, agreeing):
    left = iter(errors)
    monkeypatch.setattr(model_choice, "explore", lambda samples, form, effort: (["best", "next"], 1))
    monkeypatch.setattr(model_choice, "_polish_all", lambda samples, form, points: (points, 2))
    monkeypatch.setattr(model_choice, "rmse", lambda samples, form, point: next(left) if point == "best" else 1.0)
    monkeypatch.setattr(model_choice, "_nearest", lambda samples, form, points: points[::2])
    samples = SimpleNamespace(span_deg=lambda: 1e-9)
    found = model_choice._search(samples, None, [SimpleNamespace(fitness="rmse")] * len(errors))
    assert (found.seeds_agreeing, found.evaluations, len(found.points)) == (agreeing, 3 * len(errors), len(errors))


def test_a_backbone_averages_samples_within_a_hundredth_of_the_range():
    """A ripple of four hundredths loses what the mean over a quarter of its period takes: sin(pi/4)/(pi/4) is left."""
    up = np.linspace(-1, 1, 8001)
    drive = np.concatenate([up, up[::-1][1:]] * 2)
    middle = backbone_of(Record(drive, np.cos(2 * np.pi * drive / 0.08)))
    assert middle is not None
    centres = np.abs(drive / 0.02 - np.round(drive / 0.02)) < 1e-6
    inner = centres & (np.abs(drive) < 0.95)
    left = math.sin(math.pi / 4) / (math.pi / 4)
    np.testing.assert_allclose(middle[inner], left * np.cos(2 * np.pi * drive[inner] / 0.08), atol=0.01)


def test_parameters_of_a_second_element_end_in_its_number():
    law = SimpleNamespace(constants=(SimpleNamespace(name="n"),), size=3)
    assert coordinates(SimpleNamespace(base_law=law, elements=2)) == [
        ("A", 0), ("saturation_deg", 1), ("n", 2), ("A_2", 3), ("saturation_deg_2", 4), ("n_2", 5),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("law", "elements", "fine"), [("bouc-wen", 1, True), ("bouc-wen", 2, False), ("asymmetric-bouc-wen", 1, False)]
)
def test_one_bouc_wen_element_is_fitted_to_a_finer_tolerance(monkeypatch, law, elements, fine):
    asked = []
    monkeypatch.setattr(model_choice, "polish", lambda *given, tolerance: (asked.append(tolerance), 1))
    monkeypatch.setattr(model_choice, "_nearest", lambda samples, form, points: points)
    base = model_choice.BOUC_WEN if law == "bouc-wen" else law
    model_choice._polish_all(None, SimpleNamespace(base_law=base, elements=elements), ["point", "other"])
    assert asked == [model_choice.FINE if fine else model_choice.COARSE] * 2
    assert model_choice.FINE < model_choice.COARSE


def test_the_fitness_of_the_paper_is_the_mean_residual_over_the_range():
    """Eq. 8 of the paper, with h = 0: the mean of the angle less f, over the range of the angle."""
    drive = np.linspace(-1, 1, 41)
    angle = 3.0 * drive + 0.7
    form = Form((given_backbone(lambda x: 3.0 * x, drive, angle, "mm"),))
    samples = Samples(drive, angle, np.ones(41, dtype=bool))
    genes = np.zeros((1, 1 + form.searched))  # sign 0: no hysteresis
    found = search._score(samples, form, np.zeros(1), "paper-signed-mean")(genes)
    assert found == pytest.approx([-0.7 / 6.0], rel=1e-9)


def test_a_search_counts_the_points_that_it_scored(monkeypatch):
    monkeypatch.setattr(search, "without_hysteresis", lambda form, samples: SimpleNamespace(c=None, q=np.zeros(3)))
    monkeypatch.setattr(search, "rmse", lambda *given: 1.0)
    monkeypatch.setattr(search, "_score", lambda *given: lambda genes: np.zeros(len(genes)))

    def evolve(method, counted, genes, bounds, **more):
        for batch in (genes, genes[:3]):
            counted(batch)
        return genes

    monkeypatch.setattr(search, "evolve", evolve)
    form = SimpleNamespace(searched=2, bounds=lambda samples: (np.zeros(3), np.ones(3)))
    effort = search.Effort("ga", "paper-signed-mean", 1, 10, 5, lambda: None)
    assert search.explore(None, form, effort)[1] == 13


def test_a_law_of_stops_is_saturated_beyond_its_largest_threshold():
    """From rest, h has its saturation from the largest threshold on, and less before it."""
    law = LAWS["generalised-prandtl-ishlinskii"]
    for A, saturation in ((-0.5, 2.0), (-2.0, 0.3)):
        values = np.zeros(law.size)
        values[:4] = math.log(-A), math.log(saturation), math.log(0.6), 0.2
        largest = _stops_named(-1.0, values)["largest_threshold_deg"][0]
        rows = _stops_rows(np.array([-1.0]), values[np.newaxis])
        h = follow_stops(np.array([0.0, 0.99 * largest, 1.001 * largest, 5.0 * largest]), rows, 0.0, 1e9)[0]
        assert abs(h[1]) < 0.999 * saturation
        assert abs(h[2:]) == pytest.approx([saturation] * 2, rel=1e-6)


def test_constants_of_stops_as_a_reader_knows_them():
    """All weight at R: it is S/|A|. The width b at an end, x = -1 or 1, is exp(a x + c)."""
    values = np.array([math.log(2.0), math.log(3.0), math.log(0.6), 1.0, 0.3, -0.2, 0.0])
    named = LAWS["generalised-prandtl-ishlinskii"].named(-1.0, values)
    assert {name: value for name, (value, _) in named.items()} == pytest.approx(
        {
            "A": -2.0,
            "chi": -0.4,
            "largest_threshold_deg": 1.5,
            "share_at_largest": 1.0,
            "width_at_low_end": math.exp(-0.5),
            "width_at_high_end": math.exp(0.1),
        }
    )
    plain = LAWS["prandtl-ishlinskii"].named(0.0, values[[0, 1, 2, 3, 6]])
    assert (set(named) - set(plain), plain["largest_threshold_deg"]) == (
        {"width_at_low_end", "width_at_high_end"},
        (0.0, "deg"),
    )


def test_gamma_is_fixed_by_the_width_of_its_interval_beside_beta():
    beta, most = Parameter(0.5, 0.4, 0.6, "-"), 2 * (1 - 1 / response._FIXED) * 0.5
    for part, fixed in ((0.99, True), (1.01, False)):
        around = Parameter(0.0, -0.5 * part * most, 0.5 * part * most, "-")
        assert response.is_fixed("gamma", {"beta": beta, "gamma": around}) is fixed
    assert not response.is_fixed("gamma", {"beta": beta, "gamma": Parameter(0.0, None, None, "-")})
    for high, fixed in ((0.99 * response._FIXED, True), (1.01 * response._FIXED, False)):
        assert response.is_fixed("A", {"A": Parameter(-1.0, -high, -1.0, "-")}) is fixed


def test_the_error_of_a_law_is_that_of_all_branches_by_their_samples(monkeypatch):
    """Sums of squares of 1 and 3 deg^2 over ten samples each: the root of 4/20."""
    monkeypatch.setattr(law_choice, "_fold_squares", lambda *given: (np.array([1.0, 3.0]), np.array([10.0, 10.0])))
    monkeypatch.setattr(law_choice, "inner_folds", lambda *given: [SimpleNamespace(by="cycles")])
    monkeypatch.setattr(law_choice, "join", lambda *given, **more: None)
    monkeypatch.setattr(law_choice, "rmse", lambda *given: 0.1)
    monkeypatch.setattr(law_choice, "_timed", lambda found: False)
    monkeypatch.setattr(law_choice, "_reason", lambda *given: "")
    law = SimpleNamespace(form=SimpleNamespace(base_law=SimpleNamespace(name="law", size=4), elements=2), point=None)
    (one,) = law_choice.choose_law([None], [SimpleNamespace(train=None, heldout=None)], {"Law": law}).candidates
    assert (one.inner_rmse_deg, one.constants) == (pytest.approx(0.2**0.5, rel=1e-12), 8)


def test_a_force_of_one_sample_is_refused():
    for time in ([0.0], [0.0, 0.0], [[0.0, 1.0]]):
        with pytest.raises(ValueError, match="expected two rows alike, times increasing"):
            force_batch(time, np.zeros(np.shape(time)), np.ones((1, 9)))

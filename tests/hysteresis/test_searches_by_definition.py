"""Samples, searches and choices of a model by their definitions."""

import math
import random
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from made_loops import LOOP, line, of_records

from hysteresis.fitting import law_choice, model_choice, optimizers, search
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.samples import Samples, join
from hysteresis.laws.backbone import fitted_backbone
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import LAWS, Place
from hysteresis.records.record import Record

# --- samples and searches ------------------------------------------------------------------------------------------


def test_the_range_of_the_angle_is_that_of_the_training_samples():
    samples = Samples(np.arange(4.0), np.array([1.0, 4.0, 9.0, -9.0]), np.array([True, True, False, False]))
    assert samples.span_deg() == 3.0
    assert samples.slices() == [slice(0, 4)]
    assert samples.drives(0.5)[0].tolist() == [0, 1, 2, 3]  # without times there is no delay


def test_samples_of_records_are_joined_with_their_times_only_for_a_delay():
    times = [np.arange(LOOP.size) * 0.5, 7.0 + np.arange(LOOP.size)]
    records = [Record(LOOP, 10 * LOOP, time_s=time) for time in times]
    masks = [np.ones(LOOP.size, dtype=bool)] * 2
    plain = join(records, masks)
    assert (plain.time_s, plain.history, plain.starts) == (None, (), (0, LOOP.size))
    timed = join(records, masks, timed=True)
    assert timed.time_s.tolist() == np.concatenate(times).tolist()
    late = timed.drives(1.0)
    np.testing.assert_allclose(late[0][2:], LOOP[:-2], atol=1e-12)
    np.testing.assert_allclose(late[1], np.append(LOOP[0], LOOP[:-1]), atol=1e-12)


def test_a_score_is_what_no_curve_and_no_zero_can_remove():
    """The residual of the training samples after a regression on 1, on x, and on the second record."""
    rng = np.random.default_rng(6)
    train = np.arange(LOOP.size) % 3 > 0
    angles = [10 * LOOP + rng.normal(size=LOOP.size) for _ in range(2)]
    samples = of_records(*angles, train=train)
    backbone = fitted_backbone(LOOP, 10 * LOOP, 1)
    form = Form((backbone, backbone), groups=(0, 0))
    q = np.array([math.log(0.8), math.log(2.0), 0.0, 0.5, 0.0, 0.25])
    c = np.array([1.0, 18.0])
    genes = np.array([[-1.0, *q], [1.0, *q]])
    f = 1.0 + 9.0 * LOOP
    found = search._score(samples, form, c, "rmse")(genes)
    for sign, score in zip((-1.0, 1.0), found, strict=True):
        laws = [BoucWen(sign * 0.8, 0.8 / 2 / 1.5, 0.4 / 2 / 1.5, 1.0, h0_deg=2.0 * state) for state in (0.0, 0.25)]
        rest = np.concatenate([(f + law.along(f) - angle)[train] for law, angle in zip(laws, angles, strict=True)])
        x = np.tile(LOOP[train], 2)
        columns = np.column_stack([np.ones(x.size), x, np.repeat([0.0, 1.0], train.sum())])
        left = rest - columns @ np.linalg.lstsq(columns, rest, rcond=None)[0]
        assert score == pytest.approx(-np.sqrt(np.mean(left**2)), rel=1e-9)
    means = search._score(samples, form, c, "paper-signed-mean")(genes)
    rest = np.concatenate([(f + law.along(f) - angle)[train] for law, angle in zip(laws, angles, strict=True)])
    span = np.ptp(np.concatenate([angle[train] for angle in angles]))
    assert means[1] == pytest.approx(-abs(rest.mean()) / span, rel=1e-9)


@pytest.mark.parametrize(("flat", "expected"), [("new", 0.8), ("old", 0.8), (None, 0.4)])
def test_slopes_of_all_elements_are_rescaled_unless_a_curve_is_flat(flat, expected):
    samples = of_records(20 * LOOP)
    old, new = (Form((line(0.0 if flat == name else slope),), elements=2) for name, slope in (("old", 10), ("new", 20)))
    q = np.array([math.log(0.8), math.log(1e-9), 0.0, 0.5, math.log(0.1), math.log(1e-9), 0.7, 0.25, 0.0, 0.0])
    moved = search.with_curve_of(new, samples, old, Point(-1.0, q, np.zeros(1)))
    assert np.exp(moved.q[[0, 4]]) == pytest.approx([expected, expected / 8])
    assert moved.q[[1, 2, 3, 5, 6, 7, 8, 9]].tolist() == q[[1, 2, 3, 5, 6, 7, 8, 9]].tolist()
    steep = search.with_curve_of(
        Form((line(1e-2),)), samples, Form((line(10.0),)), Point(-1.0, q[[0, 1, 2, 3, 8]], np.zeros(1))
    )
    assert math.exp(steep.q[0]) == pytest.approx(20.0)  # the bound of the search


def test_a_delay_moves_the_drive_of_the_residual():
    time = np.arange(LOOP.size) * 0.5
    law = BoucWen(-0.8, 0.8 / 2 / 1.5, 0.4 / 2 / 1.5, 1.0)
    late = np.interp(time - 0.3, time, 10 * LOOP)
    train = np.arange(LOOP.size) > 4
    samples = join([Record(LOOP, late + law.along(late) + 2.0, time_s=time)], [train], timed=True)
    form = Form((line(),), longest_delay_s=0.4)
    q = np.array([math.log(0.8), math.log(2.0), 0.0, 0.5, 0.0, 0.3])
    found = search.residual_of(samples, form, -1.0)(np.array([*q, 1.5]))
    np.testing.assert_allclose(found, np.full(train.sum(), -0.5), atol=1e-9)
    q[-1] = 0.0
    assert np.abs(search.residual_of(samples, form, -1.0)(np.array([*q, 1.5])) + 0.5).max() > 0.1


def test_random_numbers_of_others_go_on_as_if_no_search_had_been():
    random.seed(4)
    np.random.seed(4)  # noqa: NPY002
    first = random.random(), np.random.random()  # noqa: NPY002
    random.seed(4)
    np.random.seed(4)  # noqa: NPY002

    def spoil():
        with optimizers._random_state_kept():
            random.seed(9)
            np.random.seed(9)  # noqa: NPY002
            raise InterruptedError

    with pytest.raises(InterruptedError):
        spoil()
    assert (random.random(), np.random.random()) == first  # noqa: NPY002


# --- models and their choice ---------------------------------------------------------------------------------------


def test_a_model_starts_from_one_that_it_contains_and_from_both_sides_of_it(monkeypatch):
    """Two further constants: at 0, and each of them at 0.3 and at -0.3; the best end is kept."""
    form, inner = Form((), base_law=LAWS["asymmetric-bouc-wen"]), Form(())
    contained = search.Found(inner, Point(-1.0, np.arange(5.0), np.zeros(1)), 100, 1)
    monkeypatch.setattr(model_choice, "with_curve_of", lambda new, samples, old, point: point)
    seen = []
    monkeypatch.setattr(
        model_choice, "_polish_all", lambda samples, form, points: (seen.extend(points), (["a", "b"], 7))[1]
    )
    found = model_choice._search(None, form, ["effort"] * 3, contained)
    assert found == (["a"], 7, 3)
    more = [[0, 0], [0.3, 0], [0, 0.3], [-0.3, 0], [0, -0.3]]
    assert [point.q.tolist() for point in seen] == [[0, 1, 2, 3, *pair, 4] for pair in more]


def test_a_search_by_the_fitness_of_the_paper_ends_with_its_best_point(monkeypatch):
    monkeypatch.setattr(model_choice, "explore", lambda *given: (["best", "next"], 12))
    effort = SimpleNamespace(fitness="paper-signed-mean")
    assert model_choice._search(None, None, [effort, effort]) == (["best"], 12, 1)


@pytest.mark.parametrize(("samples", "knots"), [(20, [1]), (21, [1]), (24, [1, 2]), (26, [1, 2]), (27, [1, 2, 3])])
def test_slopes_of_a_curve_are_those_that_the_samples_can_afford(monkeypatch, samples, knots):
    """Three samples for each number: the slopes and six more; one slope in any case."""
    few = SimpleNamespace(train=np.ones(samples, dtype=bool), span_deg=lambda: 10.0)
    few.thinned = lambda limit: few
    tried, searched = [], []
    monkeypatch.setattr(model_choice, "join", lambda *given, **more: few)
    monkeypatch.setattr(model_choice, "validate_within", lambda *given: SimpleNamespace(train=None, heldout=None))

    def found(few, form, efforts, contained):
        searched.append(form.backbones)
        return model_choice._Optima(["point"], 5, 1)

    monkeypatch.setattr(model_choice, "_search", found)
    monkeypatch.setattr(
        model_choice, "without_hysteresis", lambda form, few: (tried.append(form.backbones), form.backbones)[1]
    )
    monkeypatch.setattr(model_choice, "with_curve_of", lambda new, few, old, point: 9)
    monkeypatch.setattr(model_choice, "_polish_all", lambda few, form, points: (points, 0))
    monkeypatch.setattr(model_choice, "rmse", lambda fold, form, point: {1: 0.9, 9: 1.0}.get(point, 0.95))
    curves = {number: number for number in (1, 2, 3, 5)}
    chosen = model_choice._choose([None], [SimpleNamespace()], curves, Form(()), [], (1,), None)
    assert (tried, searched, chosen.point) == (knots, knots[-1:], 1)


def test_the_search_for_a_fitted_curve_has_nine_slopes_at_most(monkeypatch):
    few = SimpleNamespace(train=np.ones(1000, dtype=bool), span_deg=lambda: 10.0)
    few.thinned = lambda limit: few
    monkeypatch.setattr(model_choice, "join", lambda *given, **more: few)
    monkeypatch.setattr(model_choice, "validate_within", lambda *given: SimpleNamespace(train=None, heldout=None))

    def search_with(few, form, *more):
        raise InterruptedError(form.backbones)

    monkeypatch.setattr(model_choice, "_search", search_with)
    for most, used in ((17, 9), (5, 5)):
        curves = {number: number for number in (1, 2, 3, 5, 9, 17) if number <= most}
        with pytest.raises(InterruptedError, match=f"^{used}$"):
            model_choice._choose([None], [SimpleNamespace()], curves, Form(()), [], (1,), None)


def of_find_model(monkeypatch, errors, sign=-1.0, significant=True):
    """Stand-ins of a search: points are words, ``errors`` their errors."""
    few = SimpleNamespace(thinned=lambda limit: few)
    asked = []
    monkeypatch.setattr(model_choice, "join", lambda *given, **more: few)
    monkeypatch.setattr(model_choice, "_curves", lambda *given: {0: ("curve",)})
    point = SimpleNamespace(sign=sign, name="found")

    def found(samples, form, efforts, contained):
        asked.append(("search", form.backbones))
        return model_choice._Optima([point], 10, 2)

    def choose(records, splits, curves, form, efforts, wanted, contained):
        asked.append(("choose", wanted))
        return search.Found(form, point, 10, 2)

    monkeypatch.setattr(model_choice, "_search", found)
    monkeypatch.setattr(model_choice, "_choose", choose)
    monkeypatch.setattr(model_choice, "without_hysteresis", lambda form, samples: "baseline")
    monkeypatch.setattr(
        model_choice, "polish", lambda samples, form, start: (f"polished {getattr(start, 'name', start)}", 5)
    )
    monkeypatch.setattr(model_choice, "extended", lambda form, point, law, more: (form, f"extended by {len(more)}"))
    monkeypatch.setattr(model_choice, "rmse", lambda samples, form, point: errors[point])
    monkeypatch.setattr(model_choice, "_is_significant", lambda *given: significant)
    return asked


def test_a_model_is_chosen_by_validation_only_where_several_are_possible(monkeypatch):
    effort, base = [SimpleNamespace(fitness="rmse")], [None]
    for bases, elements, expected in (
        (base, 1, ("search", ("curve",))), (base, 2, ("choose", (2,))), (base, None, ("choose", (1, 2))),
        (None, 1, ("choose", (1,))), (None, None, ("choose", (1, 2))),
    ):  # fmt: skip
        asked = of_find_model(monkeypatch, {})
        found = model_choice.find_model([None], [SimpleNamespace(train=None)], bases, Form(()), effort, elements)
        assert asked == [expected]
        assert (found.point, found.evaluations, found.seeds_agreeing) == ("polished found", 15, 2)
    asked = of_find_model(monkeypatch, {})
    paper = [SimpleNamespace(fitness="paper-signed-mean")]
    found = model_choice.find_model([None], [SimpleNamespace(train=None)], None, Form(()), paper, None)
    assert (asked, found.point.name, found.evaluations) == ([("search", ("curve",))], "found", 10)


def test_hysteresis_that_is_not_significant_is_the_baseline(monkeypatch):
    effort, splits = [SimpleNamespace(fitness="rmse")], [SimpleNamespace(train=None)]
    of_find_model(monkeypatch, {}, significant=False)
    found = model_choice.find_model([None], splits, [None], Form(()), effort, 1)
    assert (found.point, found.evaluations) == ("baseline", 15)
    of_find_model(monkeypatch, {}, sign=0.0)
    found = model_choice.find_model([None], splits, [None], Form(()), effort, 1)
    assert (found.point, found.evaluations) == ("baseline", 10)


@pytest.mark.parametrize(("error", "kept"), [(0.3, "polished found"), (0.31, "polished extended by 2")])
def test_a_wider_law_that_fits_worse_starts_again_from_the_one_it_contains(monkeypatch, error, kept):
    of_find_model(monkeypatch, {"polished found": error, "inner": 0.3})
    inner = search.Found(Form(()), "inner", 0, 1)
    wide = Form((), base_law=LAWS["generalised-prandtl-ishlinskii"])
    found = model_choice.find_model(
        [None], [SimpleNamespace(train=None)], [None], wide, [SimpleNamespace(fitness="rmse")], 1, inner
    )
    assert found.point == kept


@pytest.mark.parametrize(("delay", "timed"), [(0.0, False), (0.4, True)])
def test_samples_keep_their_times_for_any_delay(monkeypatch, delay, timed):
    asked = []
    samples = SimpleNamespace(train=np.ones(27, dtype=bool), angle_deg=np.zeros(27), drive=np.zeros(27))
    samples.thinned = lambda limit: samples

    def joined(records, masks, *, timed):
        asked.append(timed)
        return samples

    for module in (model_choice, law_choice):
        monkeypatch.setattr(module, "join", joined)
    monkeypatch.setattr(model_choice, "_curves", lambda *given: {0: ("curve",)})
    monkeypatch.setattr(model_choice, "_search", lambda *given: model_choice._Optima(["point"], 10, 2))
    form, split = Form((), longest_delay_s=delay), SimpleNamespace(train=None, heldout=None)
    model_choice.find_model([None], [split], [None], form, [SimpleNamespace(fitness="paper-signed-mean")], 1)
    assert asked == [timed]
    monkeypatch.setattr(model_choice, "validate_within", lambda *given: split)
    monkeypatch.setattr(model_choice, "without_hysteresis", lambda *given: "baseline")
    monkeypatch.setattr(model_choice, "rmse", lambda *given: 0.0)
    monkeypatch.setattr(model_choice, "_polish_all", lambda few, form, points: (["end"], 0))
    monkeypatch.setattr(model_choice, "with_curve_of", lambda *given: "moved")
    samples.span_deg = lambda: 1.0
    assert model_choice._choose([None], [split], {0: ("curve",)}, form, [], (1,), None).point == "baseline"
    assert asked == [timed] * 3
    found = SimpleNamespace(
        form=SimpleNamespace(longest_delay_s=delay, angle=lambda *given: np.zeros(27)), point=SimpleNamespace(sign=0.0)
    )
    fold = SimpleNamespace(train=np.ones(27, dtype=bool), heldout=np.zeros(27, dtype=bool))
    law_choice._fold_squares([Record(np.arange(27.0), np.arange(27.0))], [fold], [[fold]], found)
    assert asked == [timed] * 5
    assert law_choice._timed({"a": found}) is timed


# --- the choice of the law -----------------------------------------------------------------------------------------


def of_fit_laws(monkeypatch, wanted, elements=1, sign=-1.0):
    """Laws that are fitted, with the law each starts from; ``sign`` is that of Prandtl-Ishlinskii."""
    asked = []

    def find(records, splits, bases, form, efforts, number, contained=None, near=None):
        inner = None if contained is None else contained.form.base_law.name
        asked.append((form.base_law.name, number, inner))
        assert near is bouc_wen_found.form
        assert (form.groups, form.longest_delay_s, form.place) == ((0, 1), 0.4, (3.0, 2.0))
        return search.Found(replace(form, elements=number), Point(sign, np.zeros(1), np.zeros(1)), 1, 1)

    monkeypatch.setattr(law_choice, "find_model", find)
    form = Form((), elements=elements, groups=(0, 1), longest_delay_s=0.4, place=Place(3.0, 2.0))
    bouc_wen_found = search.Found(form, Point(-1.0, np.zeros(1), np.zeros(1)), 1, 1)
    found = law_choice.fit_laws([], [], None, bouc_wen_found, [], wanted)
    assert found["Bouc-Wen"] is bouc_wen_found
    return asked, list(found)


def test_laws_that_are_fitted_for_a_choice(monkeypatch):
    pi, wide_pi, wide = "prandtl-ishlinskii", "generalised-prandtl-ishlinskii", "asymmetric-bouc-wen"
    all_of_them = [(pi, 1, None), (wide, 1, "bouc-wen"), (wide_pi, 1, pi), ("bouc-wen", 2, None)]
    asked, titles = of_fit_laws(monkeypatch, None)
    assert asked == all_of_them
    assert titles == ["Bouc-Wen", "Prandtl-Ishlinskii", "asymmetric Bouc-Wen", "generalised Prandtl-Ishlinskii",
                      "2 Bouc-Wen elements"]  # fmt: skip
    assert of_fit_laws(monkeypatch, None, elements=2)[0] == [all_of_them[0], all_of_them[2]]
    assert of_fit_laws(monkeypatch, None, sign=0.0)[0] == [all_of_them[0], all_of_them[1], all_of_them[3]]
    assert of_fit_laws(monkeypatch, pi)[0] == all_of_them[:1]
    assert of_fit_laws(monkeypatch, wide)[0] == all_of_them[1:2]
    assert of_fit_laws(monkeypatch, wide_pi)[0] == [all_of_them[0], all_of_them[2]]
    assert of_fit_laws(monkeypatch, "bouc-wen")[0] == []


def test_squares_of_folds_are_added_by_branch(monkeypatch):
    """Two branches in one record, one fold of the other; f alone, 2 deg below the first and 1 above the second."""
    up, down = np.linspace(-1, 1, 5), np.linspace(1, -1, 5)[1:]
    drive = np.r_[up, down]
    records = [Record(drive, 10 * drive + 2.0), Record(drive, 10 * drive - 1.0)]
    first, last = np.arange(9) < 2, np.arange(9) > 6
    whole = SimpleNamespace(train=np.ones(9, dtype=bool))
    folds = [[SimpleNamespace(train=~first, heldout=first), SimpleNamespace(train=~last, heldout=last)],
             [SimpleNamespace(train=~first, heldout=first)]]  # fmt: skip
    form = Form((line(), line()), groups=(0, 0))
    found = search.Found(form, Point(0.0, np.zeros(form.size), np.zeros(1)), 1, 1)
    squares, counts = law_choice._fold_squares(records, [whole, whole], folds, found)
    assert counts.tolist() == [2, 2, 2, 0]
    np.testing.assert_allclose(squares, [2 * 4.0, 2 * 4.0, 2 * 1.0, 0.0], atol=1e-12)
    seen = []

    def refit(few, form, point, tolerance):
        seen.append((few.drive.size, int(few.train.sum()), tolerance))
        return replace(point, sign=0.0, c=np.array([0.5])), 12

    monkeypatch.setattr(law_choice, "polish", refit)
    moved = replace(found, point=replace(found.point, sign=-1.0))
    squares, _ = law_choice._fold_squares(records, [whole, whole], folds, moved)
    np.testing.assert_allclose(squares, [2 * 1.5**2, 2 * 1.5**2, 2 * 1.5**2, 0.0], atol=1e-12)
    assert seen == [(18, 14, search.COARSE), (16, 16, search.COARSE)]

"""Rules of fits by definition: places in the vector of numbers, bounds, thinning, steps and limits, by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_loops import LOOP, line, of_records

from hysteresis.fitting import (
    genetic,
    law_choice,
    optimizers,
    search,
)
from hysteresis.fitting.form import Form, Point, rmse, without_hysteresis
from hysteresis.fitting.samples import join
from hysteresis.fitting.search import extended, polish, split_element, with_curve_of
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import BOUC_WEN, LAWS
from hysteresis.records.record import Record

# --- the vector of numbers -----------------------------------------------------------------------------------------


def test_places_of_numbers_in_q():
    """Two elements of four numbers, then two states a record, amplitudes of two groups, two zeros, and the delay."""
    form = Form((), elements=2, groups=(0, 1, 2), longest_delay_s=0.4)
    assert (form.law, form.state(0), form.state(2)) == (slice(0, 8), slice(8, 10), slice(12, 14))
    assert (form.amplitude(1), form.amplitude(2), form.searched) == (14, 15, 16)
    assert (form.zeros, form.size) == (slice(16, 18), 19)
    q = np.arange(19.0)
    assert form.delay_s(q) == 18.0
    timeless = Form((), elements=2, groups=(0, 1, 2))
    assert (timeless.size, timeless.delay_s(q)) == (18, 0.0)
    assert Form(()).size == Form(()).searched == 5
    assert Form((), base_law=LAWS["prandtl-ishlinskii"], groups=(0, 0)).size == 4 + 2 + 1


def test_an_amplitude_scales_slope_and_saturation_of_its_group():
    form = Form((), elements=2, groups=(0, 1))
    q = np.array([[*range(1, 9), 0.5, 1.5, -2.0, -0.5, 0.25, 7.0]], dtype=float)
    assert form.values(q, 0)[0].tolist() == [[1, 2, 3, 4, 0.5], [5, 6, 7, 8, 1]]
    assert form.values(q, 1)[0].tolist() == [[1.25, 2.25, 3, 4, -1], [5.25, 6.25, 7, 8, -0.5]]
    assert q[0, 0] == 1.0


def test_bounds_are_those_of_their_comments():
    samples = of_records(10 * LOOP, 10 * LOOP)
    form = Form((), groups=(0, 1), longest_delay_s=0.4)
    low, high = form.bounds(samples)
    np.testing.assert_allclose(
        low, [math.log(0.02), math.log(2e-4), 0, -0.95, -1, -1, math.log(0.05), -10, 0], atol=1e-12
    )
    np.testing.assert_allclose(
        high, [math.log(20), math.log(20), math.log(10), 1, 1, 1, math.log(20), 10, 0.4], atol=1e-12
    )
    assert low.shape == high.shape == (form.size,)


def test_an_angle_is_f_with_the_zero_of_its_record_and_all_elements():
    form = Form((line(), line()), elements=2, groups=(0, 0))
    samples = of_records(10 * LOOP, 10 * LOOP)
    laws = [BoucWen(-0.5, 0.3, 0.1, 1.5), BoucWen(-0.4, 0.2, 0.2, 2.0)]
    q = [v for m in laws for v in (math.log(-m.A), math.log(m.saturation_deg), math.log(m.n), m.gamma / m.beta)]
    point = Point(-1.0, np.array([*q, 0, 0, 0, 0, 3.0]), np.array([0.5]))
    f = 10 * LOOP + 0.5
    h = sum(law.along(f) for law in laws)
    np.testing.assert_allclose(form.angle(samples, point), np.r_[f + h, f + 3.0 + h], atol=1e-9)
    for law, other in zip(laws, point.models(form, 1), strict=True):
        assert other.row() == pytest.approx(law.row(), rel=1e-9)
    with pytest.raises(ValueError, match=r"law = prandtl-ishlinskii: expected bouc-wen"):
        point.models(Form((), base_law=LAWS["prandtl-ishlinskii"]))


def test_a_curve_without_hysteresis_is_fitted_to_the_training_samples_of_each_record():
    train = np.arange(LOOP.size) < 30
    spoiled = np.where(train, 0.0, 50.0)
    form = Form((line(), line()), groups=(0, 0), longest_delay_s=0.4)
    samples = of_records(10 * LOOP + 2 + spoiled, 10 * LOOP + 5 + spoiled, train=train)
    plain = without_hysteresis(form, samples)
    assert (plain.sign, plain.c.tolist()) == (0.0, pytest.approx([2.0]))
    assert plain.q.tolist() == pytest.approx([0] * 6 + [3.0, 0.05 * 0.4])
    assert rmse(samples, form, plain) == pytest.approx(0.0, abs=1e-9)
    offset = Point(0.0, plain.q, plain.c + 0.25)
    assert rmse(samples, form, offset) == pytest.approx(0.25)


# --- samples -------------------------------------------------------------------------------------------------------


def test_thinning_keeps_reversals_and_ends_with_the_training_samples():
    """Of 16 samples up to the last one that is fitted, every fourth, the turning point, and the last one."""
    drive = np.concatenate([np.arange(10.0), np.arange(8.0, -1.0, -1.0)])
    train = np.arange(19) < 16
    two = join([Record(drive, 2 * drive, time_s=np.arange(19.0) + k) for k in (0, 100)], [train, train], timed=True)
    few = two.thinned(8)
    assert few.time_s.tolist() == [0, 4, 8, 9, 12, 15, *(100 + k for k in (0, 4, 8, 9, 12, 15))]
    assert few.starts == (0, 6)
    assert [one.tolist() for one in few.train_drives()] == [[0, 4, 8, 9, 6, 3]] * 2
    assert few.blocks.tolist() == two.blocks[[0, 4, 8, 9, 12, 15, 19, 23, 27, 28, 31, 34]].tolist()
    assert two.thinned(32).drive.size == 32  # 16 of either record
    assert few.drives(0.5)[1].tolist() == [0, 3.5, 7.5, 8.5, 6.5, 3.5]  # the whole record's drive, half a second ago
    assert few.drives()[0].tolist() == [0, 4, 8, 9, 6, 3]
    assert few.slices() == [slice(0, 6), slice(6, 12)]


def test_blocks_of_a_bootstrap_are_fifths_of_branches_and_cycles_from_eight_on():
    drive = np.concatenate([np.arange(11.0), np.arange(9.0, -1.0, -1.0)])
    one = Record(drive, drive)
    everything = np.ones(21, dtype=bool)
    expected = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 5, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9]  # 11 k / 5 rounded up; the turn is next
    assert join([one, one], [everything] * 2).blocks.tolist() == [*expected, *(10 + k for k in expected)]
    for cycles, whole in ((8, True), (7, False)):
        number = np.repeat(np.arange(cycles), 3)
        many = Record(np.tile([0.0, 1.0, 0.0], cycles), np.arange(3.0 * cycles), cycle=number)
        blocks = join([many], [np.ones(3 * cycles, dtype=bool)]).blocks
        assert (blocks.tolist() == number.tolist()) is whole


# --- laws and their choice -----------------------------------------------------------------------------------------


def test_searches_beside_that_of_one_element():
    """All laws: Prandtl-Ishlinskii and two elements are searched for; laws that contain another start from it."""
    names = {"auto": 2, "bouc-wen": 0, "asymmetric-bouc-wen": 0, "prandtl-ishlinskii": 1}
    assert {name: law_choice.searches(name) for name in names} == names
    assert law_choice.searches("generalised-prandtl-ishlinskii") == 1


def test_the_error_of_a_ratio_is_that_of_a_mean_for_units_alike():
    """Ten samples each: of d / 10, the standard deviation with k - 1 over the root of k."""
    d = np.array([1.0, 2.0, 6.0, 0.0])
    found = law_choice._standard_error(d, np.array([10.0, 10.0, 10.0, 0.0]))
    assert found == pytest.approx(np.std(d[:3] / 10, ddof=1) / 3**0.5)
    assert law_choice._standard_error(np.array([3.0]), np.array([10.0])) == 0.0


def test_units_are_branches_over_all_records():
    one = Record(np.array([0.0, 1, 2, 1, 0]), np.arange(5.0))
    assert law_choice._units([one, one]).tolist() == [0, 0, 1, 1, 1, 2, 2, 3, 3, 3]


@pytest.mark.parametrize(("gap", "chosen"), [(0.9, "small"), (1.1, "large")])
def test_a_law_of_fewer_constants_is_chosen_within_one_standard_error(monkeypatch, gap, chosen):
    """Three branches of ten samples; the errors differ by 1, 2 and 3 times a unit about the gap."""
    spread = np.array([-1.0, 0.0, 1.0])
    error = np.std(spread, ddof=1) / 3**0.5
    squares = {"large": np.array([5.0, 5.0, 5.0]), "small": 5 + gap * error + spread}
    monkeypatch.setattr(law_choice, "_fold_squares", lambda *given: (squares[given[-1].title], np.full(3, 10.0)))
    monkeypatch.setattr(law_choice, "inner_folds", lambda *given: [SimpleNamespace(by="cycles")])
    monkeypatch.setattr(law_choice, "join", lambda *given, **more: None)
    monkeypatch.setattr(law_choice, "rmse", lambda *given: 0.1)
    laws = {
        title: SimpleNamespace(
            form=SimpleNamespace(
                base_law=SimpleNamespace(name=title, size=size), elements=1, longest_delay_s=0.0
            ),
            point=None, title=title,
        )
        for title, size in (("large", 6), ("small", 4))
    }  # fmt: skip
    found = law_choice.choose_law([None], [SimpleNamespace(train=None, heldout=None)], laws)
    assert (found.chosen.title, [c.title for c in found.candidates]) == (chosen, ["small", "large"])
    small = found.candidates[0]
    assert small.excess == pytest.approx(gap * error / 10)
    assert small.excess_error == pytest.approx(error / 10)
    why = "it has the fewest constants of those within one standard error of the best; not distinguished from it: large"
    assert found.reason.startswith(f"{chosen}: {why if chosen == 'small' else 'it predicts best'}. rmse in cycles ")
    assert found.to_dict()["candidates"][1]["constants"] == 6


# --- global searches -----------------------------------------------------------------------------------------------


class Recorded:
    """A stand-in for pygad that keeps what it was given."""

    def __init__(self, **given):
        self.given, self.population, self.generations_completed = given, given["initial_population"], 0
        Recorded.last = self

    def run(self):
        pass


def operators(monkeypatch, population=40, generations=10):
    monkeypatch.setattr(genetic, "_WholeGenerations", Recorded)
    bounds = np.array([-2.0, 0.0]), np.array([2.0, 10.0])
    genes = np.column_stack([np.ones(population), np.zeros(population), np.full(population, 5.0)])
    genetic.genetic(lambda batch: batch[:, 0], genes, bounds, generations, 7, lambda: None)
    return Recorded.last.given


@pytest.mark.parametrize(("population", "elite"), [(8, 1), (40, 2), (100, 5)])
def test_half_of_a_generation_are_parents_and_a_twentieth_is_kept(monkeypatch, population, elite):
    given = operators(monkeypatch, population)
    assert (given["num_parents_mating"], given["keep_elitism"]) == (population // 2, elite)
    assert (given["fitness_batch_size"], given["num_generations"]) == (population, 10)


def test_tournaments_of_three_and_uniform_crossover(monkeypatch):
    """The best of k wins unless none of three draws meets it; a gene of a child is of either parent as often."""
    given, ga = operators(monkeypatch), Recorded.last
    ga.population = np.arange(10.0)[:, None] * np.ones(2)
    _, best = given["parent_selection_type"](np.arange(10.0), 20000, ga)
    share = 1 - 0.9**3
    assert np.mean(best == 9) == pytest.approx(share, abs=5 * (share * (1 - share) / 20000) ** 0.5)
    parents = np.array([[0.0, 0.0], [1.0, 1.0]])
    child = given["crossover_type"](parents, (20000, 2), ga)
    assert child.mean(axis=0) == pytest.approx([0.5, 0.5], abs=0.02)
    assert np.mean(child[:, 0] != child[:, 1]) == pytest.approx(0.25, abs=0.02)  # other parents, then other genes


@pytest.mark.parametrize(("completed", "size"), [(0, 0.1), (10, 0.002), (5, 0.1 * 0.02**0.5)])
def test_mutations_are_new_draws_or_steps_that_shrink(monkeypatch, completed, size):
    """15 % of the genes; half of these move by a normal step of a part of the range, the others anywhere in it."""
    given, ga = operators(monkeypatch), Recorded.last
    ga.generations_completed = completed
    before = np.column_stack([np.ones(40000), np.zeros(40000), np.full(40000, 5.0)])
    after = given["mutation_type"](before.copy(), ga)
    moved = after[:, 2] != 5.0
    assert moved.mean() == pytest.approx(0.15, abs=0.01)
    steps = np.abs(after[moved, 2] - 5.0) / 10.0
    within = lambda part: 0.5 * math.erf(part / size / 2**0.5) + 0.5 * min(1.0, 2 * part)  # noqa: E731
    for part in (0.5 * size, size):
        assert np.mean(steps < part) == pytest.approx(within(part), abs=0.03)
    assert after[:, 2].min() >= 0.0
    assert after[:, 2].max() <= 10.0
    assert set(np.unique(after[:, 0])) == {-1.0, 1.0}
    # near steps from +1 seldom cross 0; of new draws half are negative
    crossed = 0.15 * 0.5 * (0.5 + 0.5 * (1 - math.erf(1 / (2 * size) / 2**0.5)))
    assert np.mean(after[:, 0] < 0) == pytest.approx(crossed, abs=0.006)


def test_the_method_cma_runs_once_for_each_sign_in_units_of_the_bounds(monkeypatch):
    runs = []

    class Strategy:
        def __init__(self, start, size, options):
            self.start, self.left = start, 3
            self.result = SimpleNamespace(xbest=np.array([1.5, 0.25]))
            runs.append((start.tolist(), size, options))

        def stop(self):
            return self.left == 0

        def ask(self):
            self.left -= 1
            return [self.start, np.array([-1.0, 2.0])]

        def tell(self, points, values):
            told.append(values)

    told, asked, ticks = [], [], []
    monkeypatch.setattr(optimizers, "require_extra", lambda *given: None)
    monkeypatch.setitem(__import__("sys").modules, "cma", SimpleNamespace(CMAEvolutionStrategy=Strategy))

    def score(batch):
        asked.append(batch)
        return -np.abs(batch[:, 1] - 3.0)

    genes = np.array([[-1, 2, 10], [-1, 3, 20], [1, 0, 10], [1, 3.5, 30], [1, 9, 10]] * 2, dtype=float)
    bounds = np.array([1.0, 10.0]), np.array([5.0, 30.0])
    last = optimizers._cma(score, genes, bounds, 7, 11, lambda: ticks.append(1))
    options = {"bounds": [0.0, 1.0], "popsize": 5, "seed": 12, "verbose": -9, "maxiter": 7}
    assert runs == [([0.5, 0.5], 0.25, options), ([0.625, 1.0], 0.25, options)]
    assert last[10:].tolist() == [[-1, 5, 15], [1, 5, 15]]
    assert len(ticks) == 3  # of the first run: both together have as many generations as were asked for
    assert asked[1].tolist() == [[-1, 3, 20], [-1, 1, 30]]
    assert told[0] == [0.0, 2.0]
    optimizers._cma(score, genes[:4][genes[:4, 0] > 0], bounds, 7, 11, lambda: None)
    assert (len(runs), runs[2][2]["popsize"]) == (3, 4)


def test_differential_evolution_gives_signs_of_one_and_the_fittest_first():
    genes = np.column_stack([np.tile([-1.0, 1.0], 8), np.linspace(0, 1, 16)])
    ticks = []
    found = optimizers.evolve(
        "differential-evolution", lambda rows: -((rows[:, 1] - 0.4) ** 2) - 0.1 * (rows[:, 0] > 0), genes,
        (np.zeros(1), np.ones(1)), generations=20, seed=3, tick=lambda: ticks.append(1),
    )  # fmt: skip
    assert found.shape == (17, 2)
    assert set(found[:, 0]) <= {-1.0, 1.0}
    assert found[0].tolist() == pytest.approx([-1.0, 0.4], abs=1e-3)
    assert len(ticks) == 20
    plain = optimizers.evolve(
        "least-squares", lambda rows: rows[:, 1], genes, (np.zeros(1), np.ones(1)), generations=1, seed=3, tick=list
    )
    assert plain[:, 1].tolist() == sorted(genes[:, 1], reverse=True)


def test_rounds_of_a_search_share_its_generations(monkeypatch):
    """Ten generations in three rounds: 4, 3 and 3, each with a seed of its own; then a play of the baseline's error."""
    shares, seeds = [], []
    monkeypatch.setattr(search, "without_hysteresis", lambda *given: SimpleNamespace(c=0.0, q=np.zeros(5)))
    monkeypatch.setattr(search, "rmse", lambda samples, form, point: 0.3 if point.c == 0.0 else abs(point.q[0] - 1.0))
    monkeypatch.setattr(search, "_score", lambda *given: lambda genes: np.zeros(len(genes)))
    monkeypatch.setattr(search, "with_curve_of", lambda new, samples, old, point: Point(point.sign, point.q + 0.125, 1))

    def evolve(method, counted, genes, bounds, *, generations, seed, tick):
        counted(genes[:2])
        shares.append(generations)
        seeds.append(seed)
        given.append(genes.copy())
        out = np.tile([1.0, 0.5, 0.25, 0.25, 0.0, 0.0], (6, 1))
        out[3:, :2] = -1.0, 0.125
        return out

    given = []
    monkeypatch.setattr(search, "evolve", evolve)
    bounds = np.array([0.0, math.log(0.1), 0.0, 0.0, -1.0]), np.array([0.55, 5.0, 1.0, 1.0, 1.0])
    form = SimpleNamespace(searched=5, elements=1, base_law=BOUC_WEN, law=slice(0, 4), bounds=lambda samples: bounds)
    points, count = search.explore(None, form, search.Effort("genetic", "rmse", 40, 6, 10, list))
    assert (shares, seeds, count) == ([4, 3, 3], [40, 41, 42], 6)
    # the fitted f moved log |A| of the best point, 0.5, by 0.125: so are all genes, within the bounds
    assert given[1][:, 1].tolist() == [0.55] * 3 + [0.25] * 3
    assert [(p.sign, p.q[0]) for p in points[:2]] == [(1.0, 0.625), (-1.0, 0.25)]
    play = points[2].q - 0.125
    assert points[2].sign == -1.0
    assert play.tolist() == pytest.approx([0.0, math.log(0.3), math.log(5.0), 0.9, 0.0])


def test_an_element_is_split_into_two_with_its_slope_and_saturation():
    """A/2 each; S/2 times the shares of the path: both saturate together at S, and rise from rest with A."""
    form = Form((), groups=(0, 0))
    point = Point(-1.0, np.array([0.2, 0.4, 0.6, 0.8, 0.1, 0.3, 9.0]), np.array([5.0]))
    two, q = split_element(form, point, 0.5)
    assert two.elements == 2
    half = math.log(0.5)
    expected = [0.2 + half, 0.4 + half + math.log(0.5), 0.6, 0.8, 0.2 + half, 0.4 + half + math.log(1.5), 0.6, 0.8]
    assert q.q.tolist() == pytest.approx([*expected, 0.1, 0.1, 0.3, 0.3, 9.0])


def test_more_constants_come_after_those_of_the_law():
    form, point = Form((), groups=(0, 0)), Point(1.0, np.arange(7.0), np.array([5.0]))
    wider, q = extended(form, point, LAWS["asymmetric-bouc-wen"], (0.25, 0.75))
    assert wider.base_law.name == "asymmetric-bouc-wen"
    assert q.q.tolist() == [0, 1, 2, 3, 0.25, 0.75, 4, 5, 6]


def test_a_slope_is_rescaled_with_the_path_of_f():
    """From f = 10 x to f = 40 x the path is four times as long: a quarter of the slope keeps the shape of h."""
    samples = of_records(40 * LOOP)
    point = Point(-1.0, np.array([math.log(0.8), math.log(1e-9), 0.0, 0.5, 0.0]), np.zeros(1))
    for slope, expected in ((40.0, 0.2), (10.0 * 0.8 / 0.02 * 1.5, 0.02)):  # not below the bound of the search
        moved = with_curve_of(Form((line(slope),)), samples, Form((line(10.0),)), point)
        assert math.exp(moved.q[0]) == pytest.approx(expected)
    assert point.q[0] == math.log(0.8)


def test_least_squares_hold_what_is_held_and_follow_the_rest():
    law = BoucWen(-0.8, 0.3, 0.1, 1.0)
    samples = of_records(10 * LOOP + 0.5 + law.along(10 * LOOP + 0.5))
    form = Form((line(),))
    start = np.array([math.log(0.7), math.log(1.9), 0.0, 0.3, 0.0])
    held = {2: 0.0, 3: 1 / 3, 4: 0.0}
    point, calls = polish(samples, form, Point(-1.0, start, np.array([0.4])), held)
    assert point.q[:2] == pytest.approx([math.log(0.8), math.log(2.0)], abs=1e-6)
    assert (point.q[2:].tolist(), point.c[0]) == ([0.0, 1 / 3, 0.0], pytest.approx(0.5, abs=1e-6))
    assert calls >= 3 * 4  # of three free numbers: each step needs a run and three differences


@pytest.mark.parametrize(
    ("change", "good"),
    [
        ({}, True), ({"population": 8}, True), ({"population": 7}, False), ({"generations": 3}, True),
        ({"generations": 2}, False), ({"seeds": 1}, True), ({"seeds": 0}, False), ({"elements": 2}, True),
        ({"elements": None}, True), ({"elements": 3}, False), ({"elements": 0}, False), ({"law": "auto"}, True),
        ({"law": "auto", "elements": 2}, True), ({"law": "prandtl-ishlinskii"}, True),
        ({"law": "prandtl-ishlinskii", "elements": 2}, False), ({"law": "auto", "fitness": "paper-signed-mean"}, False),
        ({"fitness": "paper-signed-mean"}, True), ({"fitness": "paper-signed-mean", "elements": 2}, False),
        ({"fitness": "other"}, False), ({"law": "other"}, False), ({"method": "other"}, False),
    ],
)  # fmt: skip
def test_settings_that_are_admitted(change, good):
    if good:
        assert IdentifySettings(**change).population == change.get("population", 100)
    else:
        with pytest.raises(ValueError, match="expected"):
            IdentifySettings(**change)

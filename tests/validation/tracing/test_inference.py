"""The score against a dense Gaussian likelihood, the test on draws without an effect, and what it claims of cases."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kstest, multivariate_normal

from validation.practice.clean_makes.learn import SCALES, learnt_prior, pooled_scale
from validation.practice.draw import draw_case
from validation.tracing import trace_records
from validation.tracing.inference import decide
from validation.tracing.inference.autoregression import coloured, gaps, log_determinant, whitened
from validation.tracing.inference.chance import chance_of, drawn, scales_of_rigs
from validation.tracing.inference.decision import _verdict
from validation.tracing.inference.discrepancy import Linearised, orthonormal
from validation.tracing.inference.front_runners import front_runners_of
from validation.tracing.inference.priors import DiscrepancyPrior, discrepancy_priors
from validation.tracing.inference.relevance import Grid, relevant_grid
from validation.tracing.inference.score import (
    RHO_POWER,
    Covariance,
    log_likelihood,
    noise_deg,
    plain_square,
    reduced,
    scored,
)
from validation.tracing.inference.score import (
    SCALES as GROUP_SCALES,
)
from validation.tracing.result import TraceReport, trace_report

PRIOR = DiscrepancyPrior(median=2e-3, spread=1.0, spread_of_effects=0.0, leftover=0.01)


def correlation(gap, rho):
    """Dense correlation matrix, from the places of the samples: rho to the power of their distance in one series."""
    series, at = np.cumsum(gap == 0), np.empty(gap.size)
    for i, own in enumerate(gap):
        at[i] = 0 if own == 0 else at[i - 1] + own
    distance = np.abs(at[:, None] - at[None, :])
    return np.where(series[:, None] == series[None, :], rho**distance, 0.0)


def problem(seed=0, samples=40, groups=("a", "b")):
    """Two series with three parameters, three effects (one of two amounts together, one one-sided) and two groups."""
    rng = np.random.default_rng(seed)
    mask = np.ones(samples // 2 + 3, dtype=bool)
    mask[5:8] = False
    gap = gaps([mask, np.ones(samples // 2, dtype=bool)])
    count = gap.size
    tangent = orthonormal(
        np.column_stack([rng.standard_normal((count, 3)), np.cumsum(gap == 0) == 1, np.cumsum(gap == 0) == 2])
    )

    def beyond(columns):
        left = columns - tangent @ (tangent.T @ columns)
        return left / np.linalg.norm(left, axis=0) * np.sqrt(count)

    smooth = {name: beyond(rng.standard_normal((count, 3))) / np.sqrt(3) for name in groups}
    return Linearised(
        residual=rng.standard_normal(count) * 0.3,
        tangent=tangent,
        gap=gap,
        floor_deg=1e-3,
        half_range_deg=20.0,
        shapes=beyond(rng.standard_normal((count, 5))),
        blocks=np.array([0, 1, 2, 4]),
        effects=np.array([0, 2, 3]),
        one_sided=np.array([True, False, False, True]),
        names=("one", "together", "sided"),
        smooth=smooth,
    )


def dense(linear, g, noise):
    """Covariance of the residual."""
    out = correlation(linear.gap, g.rho) + g.tau**2 * (linear.shapes * linear.shares) @ linear.shapes.T
    for name, scale in g.pattern:
        out += scale**2 * linear.smooth[name] @ linear.smooth[name].T
    return noise**2 * out


@pytest.mark.parametrize("rho", [0.0, 0.3, 0.9])
def test_whitening_is_that_of_the_dense_correlation(rho):
    """Rows are whitened by the inverse of the Cholesky factor, across gaps and the beginnings of series."""
    gap = np.array([0, 1, 1, 4, 1, 0, 1, 2])
    lower = np.linalg.cholesky(correlation(gap, rho))
    rows = np.random.default_rng(1).standard_normal((8, 3))
    assert whitened(rows, gap, rho) == pytest.approx(np.linalg.solve(lower, rows))
    assert whitened(rows[:, 0], gap, rho) == pytest.approx(np.linalg.solve(lower, rows[:, 0]))
    assert coloured(rows, gap, rho) == pytest.approx(lower @ rows)
    assert log_determinant(gap, rho) == pytest.approx(2 * np.log(np.diag(lower)).sum(), abs=1e-12)


def test_gaps_are_the_distances_of_the_samples_that_are_used():
    masks = [np.array([False, True, True, False, True]), np.zeros(3, dtype=bool), np.array([True, True])]
    assert gaps(masks).tolist() == [0, 1, 2, 0, 1]


@pytest.mark.parametrize("pattern", [(), (("a", 1.0),), (("b", 3.0), ("a", 0.3))])
@pytest.mark.parametrize(("rho", "tau"), [(0.0, 0.1), (0.6, 1.0)])
def test_the_score_is_the_marginal_likelihood_of_the_contrasts(rho, tau, pattern):
    """Contrasts beyond the tangent have a Gaussian density, computed densely, at the noise that is most likely."""
    linear, g = problem(), Covariance(rho, pattern, tau)
    space = reduced(linear, rho)
    square = plain_square(space, space.rows(linear.residual[:, None]), g)
    score = float(log_likelihood(space, square, g, PRIOR)[0])
    noise = noise_deg(linear, float(square[0]))
    full = np.linalg.svd(linear.tangent)[0]
    contrasts = full[:, linear.tangent.shape[1] :]
    density = multivariate_normal(cov=contrasts.T @ dense(linear, g, noise) @ contrasts)
    expected = density.logpdf(contrasts.T @ linear.residual) + linear.freedom / 2 * np.log(2 * np.pi)
    priors = float(PRIOR.log_density(np.array(tau * noise / linear.half_range_deg)))
    priors += RHO_POWER * np.log(1 - rho) - len(pattern) * np.log(2 * len(GROUP_SCALES))
    smooth = noise**2 * sum(scale**2 for _, scale in pattern)
    priors -= smooth / 2 / (PRIOR.leftover * linear.half_range_deg / 1.96) ** 2
    assert score == pytest.approx(expected + priors, abs=1e-6)


def test_an_effect_takes_what_least_squares_take():
    """At amounts by generalised least squares, not negative where the shape is one-sided, blocks together."""
    linear, g = problem(3), Covariance(0.4, (("a", 1.0),), 0.3)
    space = reduced(linear, g.rho)
    rows = space.rows(np.column_stack([linear.residual, -linear.residual]))
    found = scored(space, rows, g, PRIOR)
    inverse = np.linalg.inv(dense(linear, g, 1.0))
    x = linear.tangent
    p = inverse - inverse @ x @ np.linalg.solve(x.T @ inverse @ x, x.T @ inverse)
    for column, y in enumerate((linear.residual, -linear.residual)):

        def left(columns, sided, y=y):
            along = columns.T @ p @ y
            if sided and along[0] < 0:
                along = np.zeros(1)
            return float(y @ p @ y - along @ np.linalg.solve(columns.T @ p @ columns, along))

        c = linear.shapes
        squares = [
            min(left(c[:, :1], True), left(c[:, 1:2], False)),
            left(c[:, 2:4], False),
            left(c[:, 4:5], True),
        ]
        expected = log_likelihood(space, np.array(squares), g, PRIOR)
        assert found.with_effect[:, column] == pytest.approx(expected, abs=1e-8)


def test_the_noise_is_no_less_than_the_floor_of_the_sensor():
    linear = replace(problem(), floor_deg=5.0)
    space = reduced(linear, 0.0)
    g = Covariance(0.0, (), 0.1)
    square = plain_square(space, space.rows(linear.residual[:, None]), g)
    assert noise_deg(linear, float(square[0])) == 5.0


def test_draws_have_the_covariance_that_they_are_drawn_from():
    linear, g = problem(2), Covariance(0.8, (("b", 1.0),), 1.0)
    rows = drawn(linear, g, np.full((3, 40_000), g.tau), np.random.default_rng(4))
    expected = dense(linear, g, 1.0)
    assert rows @ rows.T / rows.shape[1] == pytest.approx(expected, abs=0.05 * expected.max())


def test_p_is_uniform_on_draws_without_an_effect():
    """Residuals of the model itself, noise with a little discrepancy: Kolmogorov and Smirnov find no other law."""
    found = []
    for seed in range(200):
        linear = problem(seed, samples=40, groups=())
        rng = np.random.default_rng(seed + 1000)
        prior = DiscrepancyPrior(0.3 * 0.05 / 20.0, 0.5, 0.5, 0.01)
        spaces = {0.0: reduced(linear, 0.0)}
        scales = scales_of_rigs(Grid(linear, prior, [], spaces), 0.05, rng, 1)
        one = replace(linear, residual=0.05 * drawn(linear, Covariance(0.0, (), 0.3), scales, rng)[:, 0])
        grid = Grid(one, prior, [Covariance(0.0, (), tau) for tau in (0.1, 0.3, 1.0)], spaces)
        found.append(chance_of(grid, seed=seed, simulations=99).p)
    assert kstest(found, "uniform").pvalue > 0.01
    assert np.mean(np.array(found) <= 0.05) < 0.12


@pytest.mark.parametrize(("name", "column", "amount", "claimed"), [
    ("one", 1, 0.5, True), ("one", 1, -0.5, True), ("sided", 4, 0.5, True), ("together", 3, -0.5, True),
])  # fmt: skip
def test_an_effect_that_is_there_is_claimed(name, column, amount, claimed):
    linear = problem(7, samples=120)
    rng = np.random.default_rng(3)
    linear = replace(linear, residual=amount * linear.shapes[:, column] + 0.05 * rng.standard_normal(linear.gap.size))
    chance = chance_of(relevant_grid(linear, PRIOR), simulations=99)
    assert (chance.p <= 0.05) == claimed
    assert max(chance.statistics, key=chance.statistics.get) == name


def test_a_negative_amount_of_a_one_sided_effect_takes_nothing():
    linear = problem(7, samples=120)
    linear = replace(linear, residual=-0.5 * linear.shapes[:, 4] + 1e-2 * problem(1, samples=120).residual)
    chance = chance_of(relevant_grid(linear, PRIOR), simulations=19)
    assert chance.statistics["sided"] == pytest.approx(0.0, abs=1e-6)


def test_the_same_seed_gives_the_same_p():
    grid = relevant_grid(problem(5), PRIOR)
    first, again, other = (chance_of(grid, seed=seed, simulations=199) for seed in (1, 1, 2))
    assert first.p == again.p
    assert first.critical == again.critical
    assert first.critical != other.critical


def fit_of(linear, columns):
    """What the comparison reads of a fit: least squares of the tangent and of an effect's columns."""
    jacobian = np.column_stack([linear.tangent, columns])
    left = linear.residual - jacobian @ np.linalg.lstsq(jacobian, linear.residual, rcond=None)[0]
    count = linear.gap.size
    masks = [np.ones(own, dtype=bool) for own in np.diff([*np.flatnonzero(linear.gap == 0), count])]
    bounds = np.full(jacobian.shape[1], -9.0), np.full(jacobian.shape[1], 9.0)
    return SimpleNamespace(
        rows=SimpleNamespace(errors=-left, jacobian=jacobian, train=np.ones(count, dtype=bool)),
        holdout=SimpleNamespace(series_masks=lambda channels: masks),
        model=SimpleNamespace(bounds=lambda: bounds, problem=SimpleNamespace(channels=())),
        x=np.zeros(jacobian.shape[1]),
        noise=SimpleNamespace(unrepeated_deg=0.05),
    )


def compared(seed, amount, alike):
    """Compare an effect that made a residual with one whose shape differs by ``alike``, and with an unlike one."""
    linear, rng = problem(seed, groups=()), np.random.default_rng(seed + 500)
    shape, other = linear.shapes[:, 1], linear.shapes[:, 4]
    near = shape + alike * other
    noise = 0.05 * rng.standard_normal(linear.gap.size)
    linear = replace(linear, residual=amount * shape + noise)
    grid = Grid(linear, PRIOR, [Covariance(0.0, (), 0.1)], {0.0: reduced(linear, 0.0)})
    fits = [fit_of(linear, own) for own in (shape, near, other)]
    found = front_runners_of(grid, fits, seed=seed, simulations=199)
    return [next(one for one in found if one.fitted is fit) for fit in fits]


def test_the_effect_that_made_a_record_stays_in_the_set():
    """In about 95 of 100 records; 60 draws, of which 3 are expected to fall out, and 9 have a chance of 0.4 %."""
    out = [compared(seed, 0.3, 0.05)[0].p <= 0.05 for seed in range(60)]
    assert sum(out) <= 8


def test_models_are_told_apart_as_far_as_their_shapes_differ():
    true, near, unlike = compared(3, 0.5, 1e-3)
    assert near.p > 0.05
    assert unlike.p <= 0.01
    assert min(true.behind, near.behind) == 0.0
    assert unlike.behind > 20
    _, far, _ = compared(3, 0.5, 0.5)
    assert far.p <= 0.05


def test_smooth_functions_that_are_there_are_found_relevant():
    linear = problem(9, samples=120)
    rng = np.random.default_rng(0)
    linear = replace(
        linear, residual=0.05 * (8 * linear.smooth["b"] @ rng.standard_normal(3) + rng.standard_normal(linear.gap.size))
    )
    patterns = {g.pattern for g in relevant_grid(linear, PRIOR).covariances}
    assert any(name == "b" for pattern in patterns for name, _ in pattern)


def test_the_prior_over_rigs_is_learnt_back():
    """Rigs with sharp likelihoods about scales drawn from a log-normal law give its median and spread."""
    rng, logs = np.random.default_rng(0), np.log(SCALES)
    true = np.log(4e-4) + 0.8 * rng.standard_normal(200)
    rows = [-0.5 * ((logs - own) / 0.15) ** 2 for own in true]
    median, spread, _ = learnt_prior(rows)
    assert median == pytest.approx(4e-4, rel=0.2)
    assert spread == pytest.approx(0.8, rel=0.15)
    assert pooled_scale(rows) == pytest.approx(np.exp(true.mean()), rel=0.15)


def test_priors_are_stored_with_how_they_were_learnt():
    priors = discrepancy_priors()
    assert "rig" in priors
    assert all(0 < one.median < 1e-2 and one.spread > 0 for one in priors.values())


def test_scales_of_effects_are_as_large_as_in_clean_rigs():
    """Their logarithms have the sum of both variances; the spread of the effects leaves the mean square of a rig."""
    prior = DiscrepancyPrior(1e-3, 0.7, 0.5, 0.01)
    linear = problem()
    found = scales_of_rigs(Grid(linear, prior, [], {}), 0.05, np.random.default_rng(0), 100_000) * 0.05 / 20.0
    assert np.std(np.log(found)) == pytest.approx(np.hypot(0.7, 0.5), rel=0.01)
    assert np.mean(found**2) == pytest.approx(1e-6 * np.exp(2 * 0.7**2), rel=0.05)


def decision_of(label, number):
    return trace_records(draw_case("work", "known", label, number).records, alpha=0.05).decision


@pytest.mark.slow
def test_a_delay_is_claimed_and_named_and_a_clean_rig_is_not():
    """Cases of the set for development; the delay is 4.8 times the noise."""
    late, clean = decision_of("time_delay", 0), decision_of("clean", 0)
    assert late.p_none <= late.alpha
    assert late.names == ("time_delay",)
    assert ("time_delay",) in late.not_distinguished
    assert late.p_of("time_delay") > late.alpha
    assert clean.p_none > clean.alpha
    assert clean.verdict == "none"
    assert clean.not_distinguished == ()


@pytest.mark.slow
def test_a_decision_repeats_by_its_seed():
    trace = trace_records(draw_case("work", "known", "clean", 1).records)
    first, again, other = (decide(trace, seed=seed) for seed in (3, 3, 4))
    assert first == again
    assert first.critical != other.critical
    assert abs(first.p_none - other.p_none) < 0.1


@pytest.mark.slow
def test_the_verdict_and_the_report_are_those_of_the_test():
    records = draw_case("work", "known", "clean", 1).records
    trace, by_test = (trace_records(records, alpha=alpha) for alpha in (None, 0.2))
    plain, tested = trace_report(trace), trace_report(by_test)
    stored = TraceReport.from_dict(json.loads(json.dumps(tested.to_dict())))
    assert (stored.alpha, stored.simulations) == (0.2, 999)
    assert 0 < stored.p_none <= 1
    assert stored.discrepancy_deg >= 0
    assert stored.verdict == stored.by_test.verdict == by_test.verdict == "none"
    assert "p_none" in by_test.words[0]
    assert (plain.alpha, plain.p_none, plain.by_test) == (None, None, None)


@pytest.mark.slow
def test_two_effects_are_named_one_beside_the_other():
    """A case of the set for development: a closing notch and drag; chance makes no pair of a single effect."""
    trace = trace_records(draw_case("work", "known", "pair", 0).records, alpha=0.05)
    single = trace_records(draw_case("work", "known", "tendon_creep", 0).records, alpha=0.05)
    assert set(trace.names) == {"notch_closure", "viscous_drag"}
    assert (trace.verdict, trace.confusable) == ("effect", ((), ()))
    assert trace.augmented.rmse_deg < 1.1 * trace.floor.deg
    assert single.names == ("tendon_creep",)


@pytest.mark.parametrize(
    ("alike", "verdict"), [(0, "unexplained"), (1, "effect"), (3, "ambiguous"), (4, "unexplained")]
)
def test_a_claim_names_what_at_most_two_others_fit_as_well(alike, verdict):
    assert _verdict([True] * alike + [False] * 2, claimed=True, more=False, most=True) == verdict


@pytest.mark.parametrize(("most", "verdict"), [(True, "partial"), (False, "unexplained")])
def test_an_effect_beside_more_than_clean_rigs_leave_is_a_part(most, verdict):
    assert _verdict([True], claimed=True, more=True, most=most) == verdict

"""When a residual is noise, and when one model is better than another."""

from __future__ import annotations

import math

from validation.tracing.fitting.fitted import Fitted
from validation.tracing.fitting.least_squares import solve
from validation.tracing.fitting.smooth import Smooth
from validation.tracing.settings import (
    AT_NOISE,
    FAR_BEYOND_CHANCE,
    RESTS_EARLY,
    SIGNIFICANT,
    SMALL_SAMPLE_MARGIN,
    VERY_STRONG_EVIDENCE,
    WORTH_NAMING,
    SearchPolicy,
)


def significant_ratio(baseline: Fitted, policy: SearchPolicy) -> float:
    """Rms residual over the noise floor from which there is something to explain: more with few samples."""
    return max(policy.significant, 1.0 + SMALL_SAMPLE_MARGIN / math.sqrt(baseline.error_deg.size))


def nothing_to_explain(baseline: Fitted, policy: SearchPolicy) -> bool:
    """Whether the residual of a baseline is noise."""
    return baseline.rmse_deg <= significant_ratio(baseline, policy) * baseline.noise.deg


def is_beyond_chance(before: Fitted, after: Fitted, policy: SearchPolicy) -> bool:
    """Whether an effect improves a baseline which absorbs effects by so much that noise cannot have made it.

    The ratio of the errors says little there: an effect of several times the noise may be absorbed but for a few per
    cent of it, and still improve the criterion by far more than noise does.
    """
    gain = before.train_bic(after.train_samples) - after.train_bic(after.train_samples)
    return policy.absorbs_effects and bool(after.names) and gain > FAR_BEYOND_CHANCE


def more_than_noise(fitted: Fitted, noise_deg: float) -> str:
    """Words where the residual of a model exceeds the noise, on fitted or held-out samples, else empty."""
    held = fitted.heldout_error_deg.size
    for samples, error, count in (
        ("fitted", fitted.train_rmse_deg, fitted.error_deg.size - held),
        ("held-out", fitted.heldout_rmse_deg, held),
    ):
        if count and error > max(SIGNIFICANT, 1.0 + SMALL_SAMPLE_MARGIN / math.sqrt(count)) * noise_deg:
            names, times = " + ".join(fitted.names), f"{error / noise_deg:.2g} times the noise"
            return f"{names} leaves {times} on the {samples} samples: too much, so near to the noise"
    return ""


def is_noise(fitted: Fitted) -> bool:
    """Whether a residual is so close to the noise floor that no better fit is possible."""
    return fitted.rmse_deg <= AT_NOISE * fitted.noise.deg


def rests_early(fitted: Fitted) -> bool:
    """Whether a fit came to rest where its own derivatives predict a far smaller residual.

    A rig that an effect has moved far off has kinks (tendons that go slack, guides that slide elsewhere), and the
    baseline may end at one. Effects that start there end there, too.
    """
    rows = fitted.rows
    jacobian, error = rows.jacobian[rows.train], rows.errors[rows.train]
    left = error + jacobian @ solve(jacobian, -error)
    return float(left @ left) < RESTS_EARLY**2 * float(error @ error)


def is_worth_adding(before: Fitted, after: Fitted, tried: int) -> bool:
    """Whether a further effect pays for its parameters, as the best of ``tried`` effects, and for being named.

    It must reduce the error of all that is fitted, or that of the angle, and pay there: an effect of the angle's sensor
    moves no tension, and may be small beside what the model lacks of a tension.
    """
    least, most = VERY_STRONG_EVIDENCE + 2 * math.log(tried), WORTH_NAMING**2
    of_all, of_angle = after.square < most * before.square, after.mean_square < most * before.mean_square
    n, m = after.samples, after.angle_samples
    pays = before.bic(n) - after.bic(n) > least
    return (pays and (of_all or of_angle)) or (of_angle and before.angle_bic(m) - after.angle_bic(m) > least)


def beats_smooth_functions(fitted: Fitted, smooth: Smooth) -> bool:
    """Whether no smooth functions of the baseline's residual are better than a model, of the angle.

    They must be better by the evidence that also distinguishes one effect from another.
    """
    samples, competitor = fitted.angle_samples, smooth.competitor or smooth
    return fitted.angle_bic(samples) < competitor.bic(samples) + VERY_STRONG_EVIDENCE


def curve_does_as_well(fitted: Fitted, smooth: Smooth) -> bool:
    """Whether smooth functions of the baseline's residual are no worse than a model, of the angle."""
    samples = fitted.angle_samples
    return bool(smooth.names) and smooth.bic(samples) < fitted.angle_bic(samples) + VERY_STRONG_EVIDENCE


def ranked_models(models: list[Fitted]) -> list[Fitted]:
    """Sort by the criterion, and keep the best form of each set of effects.

    Samples are counted by the errors of the model with the least mean square.
    """
    if not models:
        return []
    samples = min(models, key=lambda g: g.square).samples
    best: dict[frozenset[str], Fitted] = {}
    for g in sorted(models, key=lambda g: g.bic(samples)):
        best.setdefault(frozenset(g.names), g)
    return list(best.values())

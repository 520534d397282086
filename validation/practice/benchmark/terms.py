"""Terms of the field, of which the residual of a simple baseline is made: what other ways than the tracer start from.

The baseline knows no rig: a cubic of the drive with play operators, both with a part in proportion to the preload where
the records have several, and a zero for each record. The span of the baseline is taken out of the residual and of the
terms, so that least squares of the one by the others is that of all together (Frisch, Waugh 1933, doi 10.2307/1907330).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from hysteresis.arrays import Floats, Mask
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.path import cycle_index
from hysteresis.records.record import Record
from validation.practice.hidden.curve_with_plays import RADII, split, zeros_of

DEGREE = 3
MOST_SAMPLES = 1500
"""Of a record; a longer one is thinned."""
SMOOTHED = 5
"""Samples of the running mean of which speeds are derived."""
TRAINING_PART = 0.7
"""Of every record, from its beginning: the rest is held out."""
WAVES = (1.0, 1.5, 2.0, 3.0, 4.0)
"""Revolutions of a wheel over the range of the drive."""
GAPS = (0.02, 0.06, 0.15)
"""Half widths of a play, over half the range of the drive."""
SLOW_PARTS = (0.1, 0.3)
"""Speeds of the Stribeck curve, over the largest one of a record."""
CREEP_PARTS = (0.02, 0.1, 0.4)
"""Times of creep and of a drift that saturates, over the duration of the longest record."""
NEGLIGIBLE = 1e-8
"""Part of a term beyond the baseline below which there is no such term."""
LEAST_NOISE_DEG = 1e-4
"""The last digit of a record."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of normal values over the median of their magnitudes."""
THIRD_DIFFERENCE = float(np.sqrt(20.0))
"""Standard deviation of third differences of white noise of deviation 1: 1 + 9 + 9 + 1 is 20."""


@dataclass(frozen=True, eq=False)
class ResidualTerms:
    """Residual of the baseline and the terms, both beyond the span of the baseline.

    Parameters
    ----------
    residual_deg
        Shape (n,), samples of all records.
    terms
        Shape (n, k); a coefficient times a term is in deg.
    names, effects
        Of each term: what it is, and the effect that it stands for.
    noise_deg
        White noise, from third differences of the residual.
    loops
        Weights of the baseline's plays over the slope of its curve, by radius.
    training
        Samples that are not held out, shape (n,).
    baseline, angle_deg
        Columns of the baseline, shape (n, b), and what was measured, shape (n,).
    """

    residual_deg: Floats
    terms: Floats
    names: tuple[str, ...]
    effects: tuple[str, ...]
    noise_deg: float
    loops: Floats
    training: Mask
    baseline: Floats
    angle_deg: Floats

    @property
    def over_noise(self) -> float:
        """Root mean square of the residual over the noise."""
        return float(np.sqrt(np.mean(self.residual_deg**2)) / self.noise_deg)


@dataclass(frozen=True, eq=False)
class _Paths:
    """What the terms of one record are made of, shapes (m,): see :func:`_paths`."""

    u: Floats
    way: Floats
    time: Floats
    seconds: Floats
    settled: Floats
    preload: float


def residual_terms(records: Sequence[Record]) -> ResidualTerms:
    """Fit the baseline to all records and make the terms."""
    low = min(float(record.drive.min()) for record in records)
    high = max(float(record.drive.max()) for record in records)
    preloads = np.array([float(record.rig.get("preload_N", 1.0)) for record in records])
    longest = max(float(np.ptp(record.time_s)) if record.time_s is not None else 0.0 for record in records)
    paths = [
        _paths(record, (low, high), preload / preloads.mean(), longest)
        for record, preload in zip(records, preloads, strict=True)
    ]
    several = bool(np.ptp(preloads) > 0)
    thin = [np.arange(0, path.u.size, -(-path.u.size // MOST_SAMPLES)) for path in paths]
    base = [_baseline(path, several=several) for path in paths]
    X = np.column_stack([zeros_of(records), np.concatenate(base)])
    angle = np.concatenate([record.angle_deg for record in records])
    weights = np.linalg.lstsq(X, angle, rcond=1e-9)[0]
    smooth = split(X @ weights, records)
    made = [_terms(path, predicted) for path, predicted in zip(paths, smooth, strict=True)]
    kept = np.concatenate(
        [start + index for start, index in zip(np.cumsum([0, *map(len, smooth)])[:-1], thin, strict=True)]
    )
    columns = np.concatenate([np.column_stack([values for _, _, values in one]) for one in made])
    beyond = _beyond(X[kept], np.column_stack([angle[kept], columns[kept]]))
    residual, terms = beyond[:, 0], beyond[:, 1:]
    there = np.linalg.norm(terms, axis=0) > NEGLIGIBLE * np.maximum(np.linalg.norm(columns[kept], axis=0), 1e-12)
    named = [(name, effect) for (name, effect, _), ok in zip(made[0], there, strict=True) if ok]
    return ResidualTerms(
        residual_deg=residual,
        terms=terms[:, there],
        names=tuple(name for name, _ in named),
        effects=tuple(effect for _, effect in named),
        noise_deg=_noise(np.split(residual, np.cumsum([index.size for index in thin])[:-1])),
        loops=weights[len(records) + DEGREE :][: len(RADII)] / max(float(np.abs(weights[len(records)])), 1e-9),
        training=np.concatenate([np.arange(index.size) < TRAINING_PART * index.size for index in thin]),
        baseline=X[kept],
        angle_deg=angle[kept],
    )


def _paths(record: Record, drive_range: tuple[float, float], preload: float, longest_s: float) -> _Paths:
    """Drive from -1 to 1, its way, time over the longest record and in s, settling by cycle, preload ratio."""
    low, high = drive_range
    u = 2.0 * (record.drive - low) / (high - low) - 1.0
    seconds = np.zeros(u.size) if record.time_s is None else record.time_s - record.time_s[0]
    way = (u - plays(u, [GAPS[0]])[0]) / GAPS[0]
    time = seconds / longest_s if longest_s > 0 else seconds
    return _Paths(u, way, time, seconds, np.exp(-0.5 * cycle_index(record)), preload)


def _baseline(path: _Paths, *, several: bool) -> Floats:
    loops = plays(path.u, RADII).T
    curve = np.polynomial.chebyshev.chebvander(path.u, DEGREE)[:, 1:]
    more = path.preload - 1.0
    return np.column_stack([curve, loops, *([more * path.u, more * loops] if several else [])])


def _terms(path: _Paths, predicted_deg: Floats) -> list[tuple[str, str, Floats]]:
    """Give each term of one record: what it is, the effect that it stands for, and its values."""
    u, way, time = path.u, path.way, path.time
    speed, slope = _rate(u, path.seconds), _rate(predicted_deg, path.seconds)
    more = path.preload - 1.0
    beyond = np.maximum(np.abs(u) - 0.6, 0.0)
    return [
        *((f"play of {gap:g}", "backlash", plays(u, [gap])[0]) for gap in GAPS),
        ("way that grows with the bend", "guide_friction", path.preload * way * np.abs(u)),
        ("way over the preload", "guide_friction", path.preload * way),
        ("speed of the drive", "viscous_drag", speed),
        ("speed of the drive, bent", "viscous_drag", speed * np.abs(u)),
        ("speed of the angle", "time_delay", -slope),
        ("time", "thermal_drift", time),
        *((f"settling in {part:g}", "thermal_drift", -np.expm1(-time / part)) for part in CREEP_PARTS[1:]),
        *((f"drive that lags by {part:g}", "tendon_creep", u - _lagged(u, time, part)) for part in CREEP_PARTS),
        ("drive by cycle", "preload_loss", path.settled * u),
        ("way by cycle", "preload_loss", path.settled * way),
        ("offset by cycle", "functional_fatigue", path.settled),
        ("way by cycle, bent", "functional_fatigue", path.settled * way * np.abs(u)),
        *((f"dead zone of {gap:g}", "tendon_slack", _dead_zone(u, gap / path.preload)) for gap in (0.1, 0.3)),
        ("cubic over the preload", "tendon_stiffening", u**3 / path.preload),
        ("even cubic over the preload", "tendon_stiffening", more * u**3),
        ("kink at the centre", "unequal_tendons", np.abs(u)),
        ("even part by preload", "unequal_tendons", more * u**2),
        ("softening beyond 0.6", "superelastic_plateau", np.sign(u) * beyond),
        ("way beyond 0.6", "superelastic_plateau", way * beyond),
        ("stiffening beyond 0.8", "notch_closure", np.sign(u) * np.maximum(np.abs(u) - 0.8, 0.0)),
        *((f"beyond {at:g}", "tip_contact", np.maximum(u - at, 0.0)) for at in (0.5, 0.75)),
        *((f"sine of {w:g} turns", "wheel_eccentricity", np.sin(np.pi * w * u)) for w in WAVES),
        *((f"cosine of {w:g} turns", "wheel_eccentricity", np.cos(np.pi * w * u)) for w in WAVES),
        ("fourth power", "gravity", u**4),
        ("cosine of the angle", "tip_load", np.cos(np.radians(predicted_deg))),
        ("sine of the angle", "tip_load", np.sin(np.radians(predicted_deg))),
        *((f"way at slow speed, {part:g}", "stribeck_friction", way * _slow(speed, part)) for part in SLOW_PARTS),
        ("way along the stroke", "position_friction", way * u),
        ("play by cycle", "run_in", path.settled * plays(u, [GAPS[-1]])[0]),
        ("play over the preload", "preloaded_play", plays(u, [GAPS[1] / path.preload])[0]),
        ("square of the baseline's angle", "camera_misalignment", predicted_deg**2 / 100.0),
    ]


@cache
def effects_of_terms() -> tuple[str, ...]:
    """Give the effects that terms stand for, in their order."""
    none = np.zeros(2)
    return tuple(dict.fromkeys(effect for _, effect, _ in _terms(_Paths(none, none, none, none, none, 1.0), none)))


def _rate(values: Floats, seconds: Floats) -> Floats:
    """Differentiate a running mean by time; 0 where there are no times."""
    if not np.ptp(seconds) > 0:
        return np.zeros(values.size)
    ends = np.pad(values, SMOOTHED // 2, mode="edge")
    mean = np.convolve(ends, np.full(SMOOTHED, 1.0 / SMOOTHED), mode="valid")
    return np.asarray(np.gradient(mean, seconds))


def _slow(speed: Floats, part: float) -> Floats:
    """Stribeck's factor exp(-(v / v_s)^2), v_s being a part of the largest speed; 1 where there are no times."""
    return np.exp(-((speed / (part * max(float(np.abs(speed).max()), 1e-12))) ** 2))


def _lagged(u: Floats, time: Floats, part: float) -> Floats:
    """First-order lag of the drive, from its first value, exact for a drive that is held between samples."""
    out, now = np.empty(u.size), float(u[0])
    forget = np.exp(-np.diff(time, prepend=time[0]) / part)
    for k in range(u.size):
        now = float(u[k]) + (now - float(u[k])) * float(forget[k])
        out[k] = now
    return out


def _dead_zone(u: Floats, width: float) -> Floats:
    return np.sign(u) * np.maximum(np.abs(u) - width, 0.0)


def _beyond(X: Floats, columns: Floats) -> Floats:
    """Part of columns that is orthogonal to those of X, which may depend on each other."""
    left, singular, _ = np.linalg.svd(X / np.maximum(np.linalg.norm(X, axis=0), 1e-12), full_matrices=False)
    basis = left[:, singular > 1e-9 * singular[0]]
    return np.asarray(columns - basis @ (basis.T @ columns))


def _noise(residuals: Sequence[Floats]) -> float:
    """Give the white noise of residuals in order of time, from the median of their third differences."""
    differences = np.abs(np.concatenate([np.diff(values, 3) for values in residuals]))
    return max(float(MAD_TO_SIGMA * np.median(differences) / THIRD_DIFFERENCE), LEAST_NOISE_DEG)

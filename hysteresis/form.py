"""The form of a model theta = f(x; c) + h, and one model of that form as a vector of numbers.

h is a sum of Bouc-Wen elements, one by default. The vector q holds, in this order:

- for each element log |A|, log S, log n and rho = gamma / beta, with the saturation S; beta + gamma = |A| / S^n;
- the initial states h0 / S of each element in each record;
- the logarithms of the amplitude of h in further groups of records;
- the zeros of the angle in further records, and the delay.

The global search varies all but the last item; least squares vary everything. The sign of A is kept apart; the sign 0
stands for h = 0. Every q within the bounds is an admissible model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.backbone import Backbone, fit_curves
from hysteresis.bouc_wen import BoucWen, hysteresis_batch
from hysteresis.samples import Samples

SLOPE = (0.02, 20.0)
"""Bounds of |A|."""
_SATURATION = (1e-5, 1.0)  # in ranges of the angle; a smaller loop does not show in a record
_SHARPNESS = (1.0, 10.0)  # n
_RHO = (-0.95, 1.0)  # gamma / beta
_AMPLITUDE = (0.05, 20.0)  # of h in a further group
_ZERO = 0.5  # of the angle in a further record, in ranges of the angle


@dataclass(frozen=True)
class Form:
    """Structure of a model, without its numbers.

    ``backbones``: f of each record, with shared coefficients. ``elements``: number of elements of h. ``groups``: group
    of each record, counted from 0; q holds the parameters of h in group 0, and h as a whole is scaled in each further
    group. ``longest_delay_s``: upper bound of the delay, 0 for none.
    """

    backbones: tuple[Backbone, ...]
    elements: int = 1
    groups: tuple[int, ...] = (0,)
    longest_delay_s: float = 0.0

    @property
    def law(self) -> slice:
        """Parameters of the elements in q."""
        return slice(0, 4 * self.elements)

    def state(self, record: int) -> slice:
        """Return where the initial states of a record are in q."""
        start = (4 + record) * self.elements
        return slice(start, start + self.elements)

    def amplitude(self, group: int) -> int:
        """Index in q of the logarithm of a further group's amplitude."""
        return (4 + len(self.groups)) * self.elements + group - 1

    @property
    def searched(self) -> int:
        """Number of coordinates that the global search varies; they come first in q."""
        return self.amplitude(max(self.groups)) + 1

    @property
    def zeros(self) -> slice:
        """Zeros of the angle in the records after the first, deg."""
        return slice(self.searched, self.searched + len(self.groups) - 1)

    @property
    def size(self) -> int:
        """Number of coordinates in q."""
        return self.zeros.stop + (self.longest_delay_s > 0)

    def delay_s(self, q: Floats) -> float:
        """Delay of the angle behind the drive."""
        return float(q[-1]) if self.longest_delay_s > 0 else 0.0

    def rows(self, sign: Floats, q: Floats, record: int) -> Floats:
        """Rows (A, beta, gamma, n, h0_deg) of k candidates: shapes (k,), (k, size) -> (k, elements, 5).

        A sign 0 gives h = 0.
        """
        slope, saturation, n, rho = np.moveaxis(q[:, self.law].reshape(len(q), self.elements, 4), 2, 0)
        slope, saturation, n = np.exp(slope), np.exp(saturation), np.exp(n)
        if self.groups[record] > 0:
            size = np.exp(q[:, self.amplitude(self.groups[record])])[:, np.newaxis]
            slope, saturation = slope * size, saturation * size
        beta = slope / saturation**n / (1 + rho)
        state = np.clip(q[:, self.state(record)], -1.0, 1.0)
        sign = sign[:, np.newaxis]
        return np.stack([sign * slope, beta, rho * beta, n, np.abs(sign) * state * saturation], axis=2)

    def bounds(self, samples: Samples) -> tuple[Floats, Floats]:
        """Bounds of q, shapes (size,); those of the saturation scale with the range of the angle."""
        saturation = np.log(_SATURATION) + math.log(samples.span_deg())
        law = [np.log(SLOPE), saturation, np.log(_SHARPNESS), np.array(_RHO)] * self.elements
        states = [np.array([-1.0, 1.0])] * (self.elements * len(self.groups))
        rest = [np.log(_AMPLITUDE)] * max(self.groups)
        rest += [_ZERO * samples.span_deg() * np.array([-1.0, 1.0])] * (len(self.groups) - 1)
        if self.longest_delay_s > 0:
            rest.append(np.array([0.0, self.longest_delay_s]))
        low, high = np.array([*law, *states, *rest]).T
        return low, high

    def hysteresis(self, paths: list[Floats], sign: Floats, q: Floats) -> Floats:
        """Compute h of k candidates along the paths of f, record after record: shape (k, m), deg."""
        parts = []
        for i, path in enumerate(paths):
            rows = self.rows(sign, q, i)
            h = hysteresis_batch(path, rows.reshape(-1, 5))
            parts.append(h.reshape(len(q), self.elements, -1).sum(axis=1) if self.elements > 1 else h)
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def angle(self, samples: Samples, point: Point) -> Floats:
        """Predict the angle f + h, shape (m,), deg."""
        paths = self.paths(samples, point)
        return self.sum(paths, np.array([point.sign]), point.q)

    def sum(self, paths: list[Floats], sign: Floats, q: Floats) -> Floats:
        """Add the zeros of the records, f and h: shape (m,), deg; ``sign`` has shape (1,)."""
        zeros = (0.0, *q[self.zeros].tolist())
        f = [path + zero for path, zero in zip(paths, zeros, strict=True)]
        return np.concatenate(f) + self.hysteresis(paths, sign, q[np.newaxis])[0]

    def paths(self, samples: Samples, point: Point) -> list[Floats]:
        """Evaluate f along the drive of each record."""
        drives = samples.drives(self.delay_s(point.q))
        return [backbone.at(drive)(point.c) for backbone, drive in zip(self.backbones, drives, strict=True)]

    def curve(self, samples: Samples, target: Floats, q: Floats) -> tuple[Floats, Floats]:
        """Fit f to a target, shape (m,), at the training samples: its coefficients, and q with the fitted zeros."""
        targets = [target[part][samples.train[part]] for part in samples.slices()]
        c, zeros = fit_curves(self.backbones, samples.train_drives(), targets)
        q = q.copy()
        q[self.zeros] = zeros
        return c, q


@dataclass(frozen=True)
class Point:
    """One model of a :class:`Form`: the sign of A (0 for h = 0), q, and the coefficients c of f, shape (p,)."""

    sign: float
    q: Floats
    c: Floats

    def models(self, form: Form, record: int = 0) -> list[BoucWen]:
        """Bouc-Wen law of each element in one record."""
        rows = form.rows(np.array([self.sign]), self.q[np.newaxis], record)[0]
        return [BoucWen(*row.tolist()) for row in rows]


def without_hysteresis(form: Form, samples: Samples) -> Point:
    """Fit f alone, the baseline: h = 0 with A = 0, beta = 1, gamma = 0, n = 1."""
    q = np.zeros(form.size)
    q[form.zeros.stop :] = 0.05 * form.longest_delay_s  # from where least squares start a delay
    c, q = form.curve(samples, samples.angle_deg, q)
    return Point(0.0, q, c)


def rmse(samples: Samples, form: Form, point: Point) -> float:
    """Root mean square error over the training samples, deg."""
    deviation = (form.angle(samples, point) - samples.angle_deg)[samples.train]
    return float(np.sqrt(np.mean(deviation**2)))

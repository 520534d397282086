"""The form of a model theta = f(x; c) + h, and one model of that form as a vector of numbers.

h is a sum of elements of one law of :mod:`hysteresis.laws.elements`, one Bouc-Wen element by default. The vector q
holds, in this order:

- for each element log |A|, log S and the other constants of the law; S is the saturation. Those of Bouc-Wen are log n
  and rho = gamma / beta, and beta + gamma = |A| / S^n;
- the initial states h0 / S of each element in each record;
- the logarithms of the amplitude of h in further groups of records;
- the zeros of the angle in further records, and the delay.

The global search varies all but the last item; least squares vary everything. The sign of A is kept apart; the sign 0
stands for h = 0. Every q within the bounds is an admissible model.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.fitting.samples import Samples
from hysteresis.laws.backbone import Backbone, fit_curves
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import BOUC_WEN, EVERYWHERE, Element, Law, Place

SLOPE = (0.02, 20.0)
"""Bounds of |A|."""
_SATURATION = (1e-5, 1.0)  # in ranges of the angle; a smaller loop does not show in a record
_AMPLITUDE = (0.05, 20.0)  # of h in a further group
_ZERO = 0.5  # of the angle in a further record, in ranges of the angle


@dataclass(frozen=True)
class Form:
    """Structure of a model, without its numbers.

    ``backbones``: f of each record, with shared coefficients. ``elements``: number of elements of h. ``groups``: group
    of each record, counted from 0; q holds the parameters of h in group 0, and h as a whole is scaled in each further
    group. ``longest_delay_s``: upper bound of the delay, 0 for none. ``base_law``: of the elements. ``place``: where
    its position is measured from. ``forward``: whether least squares are those of :mod:`hysteresis.fitting.forward`,
    where they know the model.
    """

    backbones: tuple[Backbone, ...]
    elements: int = 1
    groups: tuple[int, ...] = (0,)
    longest_delay_s: float = 0.0
    base_law: Law = BOUC_WEN
    place: Place = EVERYWHERE
    forward: bool = False

    @property
    def law(self) -> slice:
        """Parameters of the elements in q."""
        return slice(0, self.base_law.size * self.elements)

    def state(self, record: int) -> slice:
        """Return where the initial states of a record are in q."""
        start = (self.base_law.size + record) * self.elements
        return slice(start, start + self.elements)

    def amplitude(self, group: int) -> int:
        """Index in q of the logarithm of a further group's amplitude."""
        return (self.base_law.size + len(self.groups)) * self.elements + group - 1

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

    def values(self, q: Floats, record: int) -> Floats:
        """Rows of values of the elements in one record: shape (k, size) -> (k, elements, constants and state)."""
        constants = q[:, self.law].reshape(len(q), self.elements, self.base_law.size).copy()
        if self.groups[record] > 0:
            constants[:, :, :2] += q[:, self.amplitude(self.groups[record])][:, np.newaxis, np.newaxis]
        state = np.clip(q[:, self.state(record)], -1.0, 1.0)
        return np.concatenate([constants, state[:, :, np.newaxis]], axis=2)

    def bounds(self, samples: Samples) -> tuple[Floats, Floats]:
        """Bounds of q, shapes (size,); those of the saturation scale with the range of the angle."""
        saturation = np.log(_SATURATION) + math.log(samples.span_deg())
        constants = [np.array([one.low, one.high]) for one in self.base_law.constants]
        law = [np.log(SLOPE), saturation, *constants] * self.elements
        states = [np.array([-1.0, 1.0])] * (self.elements * len(self.groups))
        rest = [np.log(_AMPLITUDE)] * max(self.groups)
        rest += [_ZERO * samples.span_deg() * np.array([-1.0, 1.0])] * (len(self.groups) - 1)
        if self.longest_delay_s > 0:
            rest.append(np.array([0.0, self.longest_delay_s]))
        low, high = np.array([*law, *states, *rest]).T
        return low, high

    def hysteresis(self, paths: list[Floats], sign: Floats, q: Floats) -> Floats:
        """Compute h of k candidates along the paths of f, record after record: shape (k, m), deg."""
        parts = [self.hysteresis_along(path, sign, q, i) for i, path in enumerate(paths)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def hysteresis_along(self, path: Floats, sign: Floats, q: Floats, record: int) -> Floats:
        """Compute h of k candidates along the path of one record: shape (k, m), deg. A sign 0 gives h = 0."""
        values = self.values(q, record).reshape(len(q) * self.elements, -1)
        h = self.base_law.follow(path, np.repeat(sign, self.elements), values, self.place)
        return h.reshape(len(q), self.elements, -1).sum(axis=1) if self.elements > 1 else h

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

    def elements(self, form: Form, record: int = 0) -> list[Element]:
        """Elements of h in one record, in their initial state."""
        rows = form.values(self.q[np.newaxis], record)[0]
        return [form.base_law.element(self.sign, row, form.place) for row in rows]

    def models(self, form: Form, record: int = 0) -> list[BoucWen]:
        """Elements of h in one record, of a form with the Bouc-Wen law."""
        if form.base_law is not BOUC_WEN:
            raise ValueError(f"law = {form.base_law.name}: expected bouc-wen")
        return cast(list[BoucWen], self.elements(form, record))


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

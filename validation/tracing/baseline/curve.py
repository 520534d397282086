"""Baseline without a geometry: theta = zero + f(x) + h, with effects as operators on it.

f is a cubic that stays monotone: its slope is (u + even u^2 / 2 + odd u^3 / 3) with |even| + |odd| < 1, u being the
drive over half the stroke. It is stiff on purpose: a spline would follow dead zones, end stops and periodic errors. h
is the improved Bouc-Wen law along f (Mech. Sci. 9, 2018, eq. 6-7): one element of any shape, and one of exponential
approach and longer reach. Its size may change a little with the bend; a larger change is an effect. The slope of f, and
size and reach of h, are free in every group of records of one preload.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.tracing.baseline.cache import Cache
from validation.tracing.baseline.curve_kernels import bouc_wen_element
from validation.tracing.baseline.curve_scale import CurveScale, PlacedForm
from validation.tracing.baseline.samples import kept_samples, mean_slope, middle_of
from validation.tracing.effect import CurveContext, CurveForm, Effect, FreeParameter, Need, Values, cycles_repeat
from validation.tracing.prepared import RecordSet, prepare
from validation.tracing.problem import require_one_unit
from validation.tracing.settings import (
    CURVE_SAMPLES,
    CURVE_START_STEPS,
    CURVE_STARTS,
    LARGEST_CUBIC,
    LARGEST_LOOP_CHANGE,
    LARGEST_TOE_OF_CURVE,
    LEAST_LOOP,
    NO_LOOP_GROWTH,
    SAME_PRELOAD,
)

_ONE_ELEMENT = {"far_A": 0.0, "far_reach": 10.0, "bend_loop": 0.0}
_OTHER_LOOP = {"A": -0.6, "n": 1.5, "gamma_beta": 0.8, "far_A": -0.03, "far_reach": 6.0}

Added = Sequence[tuple[PlacedForm, Values]]
"""Forms of effects with the values of their parameters, in the order in which they are added."""


@dataclass(frozen=True, eq=False)
class CurveProblem(RecordSet):
    """Records of a rig of unknown geometry; see :class:`validation.tracing.problem.Problem`.

    ``groups`` numbers the preload of every record; ``preloads`` are those of the groups over the largest one, which is
    group 0. The state that a record starts in is a parameter.
    """

    parameters: tuple[FreeParameter, ...]
    start: Values
    groups: tuple[int, ...]
    preloads: tuple[float, ...]
    middle: float
    scale: CurveScale

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`."""
        return 0.0

    def forms(self, effect: Effect) -> tuple[PlacedForm, ...]:
        """Forms of an effect whose needs the records meet."""
        met: set[Need] = set()
        if all(one.timed for one in self.inputs):
            met.add("time")
        if cycles_repeat(self.inputs):
            met.add("cycles")
        met.add("preloads" if len(self.preloads) > 1 else "one preload")
        return tuple(self.scale.placed(form) for form in effect.curve_forms if form.needs <= met)

    def starts(self, form: PlacedForm) -> Sequence[Values]:
        """Give starting values of a form, with those of the baseline that go with them; best first.

        A baseline that has absorbed an effect returns from it in a least-squares fit only by many small steps.
        Therefore the baseline alone is fitted to each start of the form, from its own loop and from another one.
        """
        other = {name: value for name, value in _OTHER_LOOP.items() if name in self.start}
        fits = [
            (*_fit(self, loop, [(form, start)], CURVE_START_STEPS), start)
            for loop in (self.start, {**self.start, **other})
            for start in form.starts
        ]
        fits.sort(key=lambda fit: fit[0])
        return [{**baseline, **start} for _, baseline, start in fits[:CURVE_STARTS]]

    @cached_property
    def _strokes(self) -> tuple[Floats, ...]:
        return tuple(one.drive - self.middle for one in self.inputs)

    def predict(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records by the baseline with forms added, shapes (m_i,); the order of forms counts.

        Each record is an independent run of the operators: drive, f, backbone, h, angle, observe.
        """
        acting = [(placed.form, placed.relative_values(mine)) for placed, mine in added]
        values = {**_ONE_ELEMENT, **values}
        return [self._record(i, values, acting) for i in range(len(self.records))]

    @cached_property
    def _cache(self) -> Cache:
        """Drives, loop sizes and loops: most derivatives leave all but one of them as they are."""
        return Cache()

    def _record(self, i: int, values: Values, acting: Sequence[tuple[CurveForm, Values]]) -> Floats:
        """Angle of one record, deg."""
        group, context = self.groups[i], self._context(i, values)
        x = self._driven(i, context, acting)
        u = x / self.scale.drive
        f = self._backbone_deg(group, u, values)
        weight = np.exp(values["bend_loop"] * np.abs(u))
        for form, mine in acting:
            if form.backbone is not None:
                f = form.backbone(f, context, mine)
            if form.loop_size is not None:
                weight = weight * self._loop_size(i, form, mine, f, context)
        theta = f + self._loops(f, self._elements(group, values), values[f"state_{i}"], weight)
        for form, mine in acting:
            if form.angle is not None:
                theta = form.angle(theta, context, mine)
            if form.observe is not None:
                theta = form.observe(theta, self.inputs[i], mine)
        return theta

    def _driven(self, i: int, context: CurveContext, acting: Sequence[tuple[CurveForm, Values]]) -> Floats:
        """Drive of a record behind the effects that act on it."""
        drives = [(form.drive, mine) for form, mine in acting if form.drive is not None]
        if not drives:
            return self._strokes[i]

        def driven() -> Floats:
            x = self._strokes[i]
            for drive, mine in drives:
                x = drive(x, context, mine)
            return x

        key = (i, *context.of_baseline, *((drive, *mine.items()) for drive, mine in drives))
        return self._cache.get(key, driven)

    def _loop_size(self, i: int, form: CurveForm, mine: Values, f: Floats, context: CurveContext) -> Floats:
        """Factor of an effect on the size of the loop."""
        size = form.loop_size
        assert size is not None
        key = (i, size, *mine.items(), *context.of_baseline, f.tobytes())
        return self._cache.get(key, lambda: size(f, context, mine))

    def _loops(self, f: Floats, elements: Floats, state: float, weight: Floats) -> Floats:
        """Evaluate h, deg, shape (m,), from rows of saturation, reach, n, gamma / beta, shape (k, 4).

        A negative saturation lags. The saturation enters linearly, so h is smooth through zero. The first element
        starts in a state, the others at rest: that of an element of long reach fades over many cycles, as a drift does.
        """
        out, path, sizes = np.zeros_like(f), f.tobytes(), weight.tobytes()
        for number, (saturation, *shape) in enumerate(elements.tolist()):
            if saturation != 0.0:
                key = (path, sizes, *shape, at := 0.0 if number else state)
                out += saturation * self._cache.get(key, partial(bouc_wen_element, f, *shape, at, weight)) * weight
        return out

    def _backbone_deg(self, group: int, u: Any, values: Values) -> Any:
        """Evaluate f, deg, of the drive over half the stroke: a number or of shape (m,)."""
        full = values["slope"] * values.get(f"slope_{group}", 1.0) * self.scale.drive
        return full * u * (1.0 + u * (0.5 * values["even"] + (values["odd"] / 3.0) * u))

    def _elements(self, group: int, values: Values) -> Floats:
        """Saturation, reach, n, gamma / beta of both elements of h in a group of records, shape (2, 4)."""
        size = values.get(f"loop_{group}", 1.0)
        reach = size * values.get(f"reach_{group}", 1.0)
        near = values["reach"]
        far = near * values["far_reach"]
        return np.array(
            [
                [values["A"] * near * size, near * reach, values["n"], values["gamma_beta"]],
                [values["far_A"] * far * size, far * reach, 1.0, 1.0],
            ]
        )

    def _context(self, i: int, values: Values) -> CurveContext:
        """Give what operators know of a record."""
        group = self.groups[i]
        toe, slope_loss = self._toe(values)
        zero = -self.middle / self.scale.drive
        return CurveContext(
            inputs=self.inputs[i],
            drive_middle=self.middle,
            drive_half_range=self.scale.drive,
            angle_half_range_deg=self.scale.angle,
            straight_deg=float(self._backbone_deg(group, zero, values)) if abs(zero) <= 1.0 else 0.0,
            initial_state=values[f"state_{i}"],
            preload_ratio=self.preloads[group],
            loop_ratio=values.get(f"loop_{group}", 1.0),
            toe_ratio=toe,
            slope_loss_per_loop=slope_loss,
        )

    def _toe(self, values: Values) -> tuple[float, float]:
        """Toe of the tendons over the largest preload, and the slope that f loses per growth of the loop.

        Both are from the lowest preload, which shows most: h grows as the tendons' compliance 1 + toe / T, and the
        slope of f falls as 1 / (1 + loss compliance).
        """
        if (last := len(self.preloads) - 1) == 0:
            return 0.0, 0.0
        loop, rise = values[f"loop_{last}"], 1.0 / self.preloads[last]
        toe = (loop - 1.0) / (rise - loop) if 1.0 < loop < 0.99 * rise else 0.0 if loop <= 1.0 else LARGEST_TOE_OF_CURVE
        return toe, (1.0 / values[f"slope_{last}"] - 1.0) / (loop - 1.0) if loop > 1.0 + NO_LOOP_GROWTH else 0.0


def curve_problem(records: Sequence[Record], samples: int = CURVE_SAMPLES, *, elements: int = 2) -> CurveProblem:
    """Make a problem of records of one rig, with the baseline's parameters from a fit of them.

    Parameters
    ----------
    records
        All with one unit of the drive. Their ``rig["preload_N"]`` makes the groups; without it they are one group.
    samples
        Of a record at most, about.
    elements
        Of h, 1 or 2. With one, whose size does not change with the bend, play shows beside it; two may absorb play.

    Raises
    ------
    RecordError
        Records of different units of the drive.
    """
    require_one_unit(records)
    used = prepare(records, [kept_samples(record.drive, samples) for record in records])
    drives, observed = [one.drive for one in used], [one.angle_deg for one in used]
    low, high = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    middle = middle_of(drives)
    known, groups = _preload_groups([one.preload_N for one in used])
    scale = CurveScale(
        drive=max(high - middle, middle - low),
        angle=0.5 * max(float(np.ptp(angle)) for angle in observed),
        time=min(float(one.inputs.time_s[-1]) for one in used),
        unit=records[0].drive_unit,
    )
    preloads = tuple(load / known[0] for load in known) or (1.0,)
    slope = mean_slope(drives, observed)
    parameters = _parameters(scale, slope, len(preloads), len(records))
    problem = CurveProblem(
        records=used,
        parameters=tuple(p for p in parameters if elements == 2 or p.name not in _ONE_ELEMENT),
        start={},
        groups=groups,
        preloads=preloads,
        middle=middle,
        scale=scale,
    )
    return replace(problem, start=_first_fit(problem, slope))


def _preload_groups(preloads: Sequence[float]) -> tuple[list[float], tuple[int, ...]]:
    """Preloads, N, the largest first, and which of them each record has; one group where one of them is NaN."""
    if np.isnan(preloads).any():
        return [], (0,) * len(preloads)
    known = list[float]()
    for preload in sorted(preloads, reverse=True):
        if not known or preload < (1 - SAME_PRELOAD) * known[-1]:
            known.append(preload)
    return known, tuple(int(np.argmin(np.abs(np.array(known) - preload))) for preload in preloads)


def _parameters(scale: CurveScale, slope: float, groups: int, records: int) -> tuple[FreeParameter, ...]:
    angle, (low, high) = scale.angle, sorted((0.2 * slope, 5.0 * slope))
    parameters = [
        FreeParameter("slope", f"deg/{scale.unit}", low, high, 0.01 * abs(slope)),
        FreeParameter("even", "-", -LARGEST_CUBIC, LARGEST_CUBIC, 0.01),
        FreeParameter("odd", "-", -LARGEST_CUBIC, LARGEST_CUBIC, 0.01),
        FreeParameter("A", "-", LEAST_LOOP, 3.0, 0.02),
        FreeParameter("reach", "deg", 2e-3 * angle, 2.0 * angle, 0.1, log=True),
        FreeParameter("n", "-", 1.0, 10.0, 0.1, log=True),
        FreeParameter("gamma_beta", "-", -0.95, 1.0, 0.1),
        FreeParameter("far_A", "-", -1.0 - LEAST_LOOP, 0.5, 0.01),
        FreeParameter("bend_loop", "-", -LARGEST_LOOP_CHANGE, LARGEST_LOOP_CHANGE, 0.05),
        FreeParameter("far_reach", "-", 3.0, 200.0, 0.2, log=True),
    ]
    for group in range(1, groups):
        parameters += [
            FreeParameter(f"slope_{group}", "-", 0.5, 2.0, 0.01, log=True),
            FreeParameter(f"loop_{group}", "-", 0.05, 20.0, 0.05, log=True),
            FreeParameter(f"reach_{group}", "-", 0.1, 10.0, 0.1, log=True),
        ]
    parameters += [FreeParameter(f"state_{i}", "-", -1.0, 1.0, 0.1) for i in range(records)]
    return tuple(parameters)


def _first_fit(problem: CurveProblem, slope: float) -> Values:
    """Best of a few fits of the baseline, from loops of several sizes and reaches."""
    swing = [angle - angle.mean() for angle in problem.observed]
    spread = np.concatenate(
        [y - slope * (s.drive - s.drive.mean()) for y, s in zip(swing, problem.inputs, strict=True)]
    )
    width = float(np.sqrt(np.mean(spread**2)))
    best: tuple[float, dict[str, float]] | None = None
    for sign in (-1.0, 1.0):
        for far, n in ((6.0, 1.5), (20.0, 4.0)):
            start = {p.name: 1.0 if p.log else 0.0 for p in problem.parameters}
            start |= {"slope": slope, "A": 0.6 * sign, "reach": 1.7 * width, "n": n, "gamma_beta": 0.8}
            start |= {"far_A": 0.2 * sign / far, "far_reach": far}
            found = _fit(problem, start, (), 60)
            if best is None or found[0] < best[0]:
                best = found
    assert best is not None
    return best[1]


def _fit(problem: CurveProblem, start: Values, added: Added, most_steps: int) -> tuple[float, dict[str, float]]:
    """Fit the baseline beside forms of given values: half the sum of squares, and values of the baseline."""
    parameters = problem.parameters
    low = np.array([p.to_unit(p.low) for p in parameters])
    high = np.array([p.to_unit(p.high) for p in parameters])
    x0 = np.clip([p.to_unit(float(np.clip(start[p.name], p.low, p.high))) for p in parameters], low, high)

    def values(x: Floats) -> dict[str, float]:
        return {p.name: float(np.clip(p.from_unit(v), p.low, p.high)) for p, v in zip(parameters, x, strict=True)}

    def residual(x: Floats) -> Floats:
        errors = [
            predicted - measured
            for predicted, measured in zip(problem.predict(values(x), added), problem.observed, strict=True)
        ]
        return np.concatenate([error - error.mean() for error in errors])

    solution = least_squares(residual, x0, bounds=(low, high), x_scale="jac", max_nfev=most_steps, ftol=1e-6)
    return float(solution.cost), values(solution.x)

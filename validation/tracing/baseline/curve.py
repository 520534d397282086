"""Declared model where the geometry is unknown: theta = zero + f(x) + h, with effects as operators on it.

f is a cubic that stays monotone: slope (u + even u^2 / 2 + odd u^3 / 3) with |even| + |odd| < 1, u being the drive over
half the stroke. It is stiff on purpose: a spline would take dead zones, end stops and periodic errors for its own.
h is the improved Bouc-Wen law along f (paper, eq. 6-7): one element of any shape, and one of exponential approach and
longer reach. Its size may change a little with the bend; what changes more is an effect. Slope of f, size and reach of
h are free in every group of records of one preload.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from hysteresis.arrays import Floats
from hysteresis.path import branches
from hysteresis.record import Record
from validation.tracing.baseline.curve_kernels import loops
from validation.tracing.effect import (
    CurveContext,
    CurveForm,
    Effect,
    FreeParameter,
    Need,
    RelativeParameter,
    Values,
    cycles_repeat,
)
from validation.tracing.prepared import RecordSet, prepare
from validation.tracing.problem import require_one_unit

SAMPLES = 600
"""Of a record at most, about: the rest is left out, turning points never."""
_SHAPE = 0.45  # largest even and odd part of f, which keeps f monotone
_BEND_LOOP = 0.3  # the declared loop changes with the bend a little, as friction and ropes of any rig make it
_STANDSTILL = -0.85  # least A: at -1 the angle stands still after a reversal, which is play
_ONE_ELEMENT = {"far_A": 0.0, "far_reach": 10.0, "bend_loop": 0.0}
_NO_TOE = 1e-3
_ONE_PRELOAD = 0.1  # preloads are the same within this part
_GIVE_WAY = 12  # steps of the declared model towards a start of an effect
_STARTS = 3  # of a form that are worth a fit
_STIFFEST_TOE = 100.0


@dataclass(frozen=True)
class Placed:
    """A form with its constants in the units of the records."""

    form: CurveForm
    parameters: tuple[FreeParameter, ...]
    starts: tuple[Values, ...]

    def values_of(self, values: Values) -> Values:
        """Values under the names that the operators know."""
        return {
            relative.name: values[constant.name]
            for relative, constant in zip(self.form.parameters, self.parameters, strict=True)
        }


@dataclass(frozen=True)
class CurveScale:
    """What relative constants are multiplied with."""

    drive: float
    angle: float
    time: float
    unit: str

    def of(self, unit: str) -> float:
        """One of a unit."""
        top, _, bottom = unit.partition("/")
        return self._factor(top) / self._factor(bottom or "-")

    def _factor(self, name: str) -> float:
        return {"drive": self.drive, "angle": self.angle, "time": self.time}.get(name, 1.0)

    def place(self, constant: RelativeParameter) -> FreeParameter:
        """Give a constant its unit."""
        scale = self.of(constant.unit)
        names = {"drive": self.unit, "angle": "deg", "time": "s"}
        unit = "/".join(names.get(part, part) for part in constant.unit.split("/"))
        name = f"{constant.name}_{self.unit}" if constant.unit == "drive" else constant.name
        size = constant.scale if constant.log else constant.scale * scale
        return FreeParameter(name, unit, constant.low * scale, constant.high * scale, size, constant.log)

    def form(self, form: CurveForm) -> Placed:
        """Give a form the units of the records."""
        parameters = tuple(map(self.place, form.parameters))
        pairs = [(a.name, b.name, self.of(a.unit)) for a, b in zip(form.parameters, parameters, strict=True)]
        return Placed(form, parameters, tuple({b: start[a] * by for a, b, by in pairs} for start in form.starts))


@dataclass(frozen=True, eq=False)
class CurveProblem(RecordSet):
    """Records of a rig of unknown geometry; see :class:`validation.tracing.problem.Problem`.

    ``groups`` numbers the preload of every record; ``preloads`` are those of the groups over the largest one, which is
    group 0. The state that a record starts in is free.
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

    def forms(self, effect: Effect) -> tuple[Placed, ...]:
        """Forms of an effect that these records can have."""
        has: set[Need] = set()
        if all(record_inputs.timed for record_inputs in self.inputs):
            has.add("time")
        if cycles_repeat(self.inputs):
            has.add("cycles")
        if len(self.preloads) > 1:
            has.add("preloads")
        return tuple(self.scale.form(form) for form in effect.curve_forms if form.needs <= has)

    def starts(self, form: Any) -> Sequence[Values]:
        """Values to start the constants of a form from, with those of the declared model that go with them; best first.

        A declared loop that has taken an effect for its own has to give way to it, which takes a least-squares fit
        many small steps; so it is fitted to each start of the form alone.
        """
        fits = [(*_fit(self, self.start, [(form, start)], _GIVE_WAY), start) for start in form.starts]
        fits.sort(key=lambda fit: fit[0])
        return [{**baseline, **start} for _, baseline, start in fits[:_STARTS]]

    @cached_property
    def _strokes(self) -> tuple[Floats, ...]:
        return tuple(record_inputs.drive - self.middle for record_inputs in self.inputs)

    def predict(self, values: Values, added: Sequence[tuple[Any, Values]]) -> list[Floats]:
        """Angles of all records by the declared model with forms added, shapes (m_i,); the order of forms counts.

        Each record is an independent run of the operators: drive, f, bend, h, turn, seen.
        """
        acting = [(placed.form, placed.values_of(mine)) for placed, mine in added]
        values = {**_ONE_ELEMENT, **values}
        return [self._record(i, values, acting) for i in range(len(self.observed))]

    def _record(self, i: int, values: Values, acting: Sequence[tuple[CurveForm, Values]]) -> Floats:
        group = self.groups[i]
        x = self._strokes[i]
        curve = self._curve(i, values) if acting else None
        for form, mine in acting:
            if form.drive is not None and curve is not None:
                x = form.drive(x, curve, mine)
        u = x / self.scale.drive
        f = self._f(group, u, values)
        weight = np.exp(values["bend_loop"] * np.abs(u))
        for form, mine in acting:
            if form.backbone is not None and curve is not None:
                f = form.backbone(f, curve, mine)
            if form.loop_size is not None and curve is not None:
                weight = weight * form.loop_size(f, curve, mine)
        theta = f + loops(f, self._elements(group, values), values[f"state_{i}"], weight)
        for form, mine in acting:
            if form.angle is not None and curve is not None:
                theta = form.angle(theta, curve, mine)
            if form.observe is not None:
                theta = form.observe(theta, self.inputs[i], mine)
        return theta

    def _f(self, group: int, u: Any, values: Values) -> Any:
        """Evaluate f, deg, of the drive over half the stroke: a number or of shape (m,)."""
        full = values["slope"] * values.get(f"slope_{group}", 1.0) * self.scale.drive
        return full * u * (1.0 + u * (0.5 * values["even"] + (values["odd"] / 3.0) * u))

    def _elements(self, group: int, values: Values) -> Floats:
        """Saturation, reach, n, gamma / beta of either element in a group of records."""
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

    def _curve(self, i: int, values: Values) -> CurveContext:
        group = self.groups[i]
        toe = give = 0.0
        if (last := len(self.preloads) - 1) > 0:  # the lowest preload tells most
            loop, rise = values[f"loop_{last}"], 1.0 / self.preloads[last]
            # h goes as the ropes' compliance 1 + toe / T, and the slope of f as 1 / (1 + give compliance)
            toe = (loop - 1.0) / (rise - loop) if 1.0 < loop < 0.99 * rise else 0.0 if loop <= 1.0 else _STIFFEST_TOE
            give = (1.0 / values[f"slope_{last}"] - 1.0) / (loop - 1.0) if loop > 1.0 + _NO_TOE else 0.0
        zero = -self.middle / self.scale.drive
        return CurveContext(
            inputs=self.inputs[i],
            drive_middle=self.middle,
            drive_half_range=self.scale.drive,
            angle_half_range_deg=self.scale.angle,
            straight_deg=float(self._f(group, zero, values)) if abs(zero) <= 1.0 else 0.0,
            initial_state=values[f"state_{i}"],
            preload_ratio=self.preloads[group],
            loop_ratio=values.get(f"loop_{group}", 1.0),
            toe_ratio=toe,
            slope_loss_per_loop=give,
        )


def curve_problem(records: Sequence[Record], samples: int = SAMPLES, *, elements: int = 2) -> CurveProblem:
    """Make a problem of records of one rig, with the declared model's constants from a fit of them.

    Parameters
    ----------
    records
        All with one unit of the drive. Their ``rig["preload_N"]`` makes the groups; without it they are one group.
    samples
        Of a record at most, about.
    elements
        Of h, 1 or 2: with one, whose size does not change with the bend, play shows beside it; two may take it over.

    Raises
    ------
    RecordError
        Records of different units of the drive.
    """
    require_one_unit(records)
    used = prepare(records, [thinned(record.drive, samples) for record in records])
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
    problem = CurveProblem(
        records=used,
        parameters=tuple(
            constant
            for constant in _constants(scale, slope, len(preloads), len(records))
            if elements == 2 or constant.name not in _ONE_ELEMENT
        ),
        start={},
        groups=groups,
        preloads=preloads,
        middle=middle,
        scale=scale,
    )
    return replace(problem, start=_first_fit(problem, slope))


def _preload_groups(loads: Sequence[float]) -> tuple[list[float], tuple[int, ...]]:
    """Preloads, N, the largest first, and which of them each record has; one group where one of them is NaN."""
    if np.isnan(loads).any():
        return [], (0,) * len(loads)
    known = list[float]()
    for load in sorted(loads, reverse=True):
        if not known or load < (1 - _ONE_PRELOAD) * known[-1]:
            known.append(load)
    return known, tuple(int(np.argmin(np.abs(np.array(known) - load))) for load in loads)


def thinned(drive: Floats, samples: int = SAMPLES) -> NDArray[np.intp]:
    """Choose about ``samples`` samples evenly, and all turning points: the law is rate independent between them."""
    every = -(-len(drive) // samples)
    turns = [branch.stop - 1 for branch in branches(drive)] if every > 1 else []
    return np.unique(np.concatenate([np.arange(0, len(drive), every), np.array(turns, dtype=np.intp)]))


def middle_of(drives: Sequence[Floats]) -> float:
    """Middle of the stroke of all records; zero where they go both ways about it."""
    low, high = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    middle = 0.5 * (low + high)
    return 0.0 if abs(middle) < 0.1 * (high - low) else middle


def mean_slope(drives: Sequence[Floats], angles: Sequence[Floats]) -> float:
    """Slope of the regression of all records with a zero each."""
    x = np.concatenate([drive - drive.mean() for drive in drives])
    y = np.concatenate([angle - angle.mean() for angle in angles])
    return float(x @ y / (x @ x))


def _constants(scale: CurveScale, slope: float, groups: int, records: int) -> tuple[FreeParameter, ...]:
    angle, (low, high) = scale.angle, sorted((0.2 * slope, 5.0 * slope))
    parameters = [
        FreeParameter("slope", f"deg/{scale.unit}", low, high, 0.01 * abs(slope)),
        FreeParameter("even", "-", -_SHAPE, _SHAPE, 0.01),
        FreeParameter("odd", "-", -_SHAPE, _SHAPE, 0.01),
        FreeParameter("A", "-", _STANDSTILL, 3.0, 0.02),
        FreeParameter("reach", "deg", 2e-3 * angle, 2.0 * angle, 0.1, log=True),
        FreeParameter("n", "-", 1.0, 10.0, 0.1, log=True),
        FreeParameter("gamma_beta", "-", -0.95, 1.0, 0.1),
        FreeParameter("far_A", "-", -1.0 - _STANDSTILL, 0.5, 0.01),
        FreeParameter("bend_loop", "-", -_BEND_LOOP, _BEND_LOOP, 0.05),
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
    """Best of a few fits of the declared model, from loops of several sizes and reaches."""
    swing = [angle - angle.mean() for angle in problem.observed]
    spread = np.concatenate(
        [y - slope * (s.drive - s.drive.mean()) for y, s in zip(swing, problem.inputs, strict=True)]
    )
    width = float(np.sqrt(np.mean(spread**2)))
    best: tuple[float, dict[str, float]] | None = None
    for sign in (-1.0, 1.0):
        for far, n in ((6.0, 1.5), (20.0, 4.0)):
            start = {constant.name: 1.0 if constant.log else 0.0 for constant in problem.parameters}
            start |= {"slope": slope, "A": 0.6 * sign, "reach": 1.7 * width, "n": n, "gamma_beta": 0.8}
            start |= {"far_A": 0.2 * sign / far, "far_reach": far}
            found = _fit(problem, start, (), 60)
            if best is None or found[0] < best[0]:
                best = found
    assert best is not None
    return best[1]


def _fit(
    problem: CurveProblem, start: Values, added: Sequence[tuple[Any, Values]], most_steps: int
) -> tuple[float, dict[str, float]]:
    """Fit the declared model with forms of given constants: half the sum of squares, and values."""
    parameters = problem.parameters
    low = np.array([c.to_unit(c.low) for c in parameters])
    high = np.array([c.to_unit(c.high) for c in parameters])
    x0 = np.clip([c.to_unit(float(np.clip(start[c.name], c.low, c.high))) for c in parameters], low, high)

    def values(x: Floats) -> dict[str, float]:
        return {c.name: float(np.clip(c.from_unit(v), c.low, c.high)) for c, v in zip(parameters, x, strict=True)}

    def residual(x: Floats) -> Floats:
        parts = []
        for angle, seen in zip(problem.predict(values(x), added), problem.observed, strict=True):
            error = angle - seen
            parts.append(error - error.mean())
        return np.concatenate(parts)

    solution = least_squares(residual, x0, bounds=(low, high), x_scale="jac", max_nfev=most_steps, ftol=1e-6)
    return float(solution.cost), values(solution.x)

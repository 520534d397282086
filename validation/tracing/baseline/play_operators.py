"""Baseline of play operators where the geometry is unknown: loops with non-local memory.

theta = f(x) - f(0) + sum_j g_j (p_j - x), with x = 0 in the middle of the stroke, p_j being the outputs of play
operators of the drive: a generalised Prandtl-Ishlinskii operator (Kuhnen 2003, doi 10.3166/ejc.9.407-418; Al Janaideh,
Su, Rakheja 2008, doi 10.1088/0964-1726/17/3/035026). It returns to where a smaller loop left a larger one (non-local
memory), which no Bouc-Wen law does, and the width of its loops may depend on the position. f is a cubic B-spline; every
g_j is a number, or linear in the position. All parameters are linear and have a prior mean of nothing (ridge
regression). The zero of each record is free: angles count from the middle of the stroke.

The first stroke of a record starts from a state that the record does not tell. It is left out of this baseline, and the
words of the trace say so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline

from hysteresis.arrays import Floats, Mask
from hysteresis.laws.prandtl_ishlinskii import plays
from hysteresis.records.path import first_stroke
from hysteresis.records.record import Record
from hysteresis.sensors.lone_steps import PLAY_RADII
from validation.tracing.baseline.cache import Cache
from validation.tracing.baseline.curve_scale import CurveScale, PlacedForm
from validation.tracing.baseline.samples import kept_samples, middle_of
from validation.tracing.effect import CurveContext, CurveForm, Effect, FreeParameter, Need, Values, cycles_repeat
from validation.tracing.prepared import PreparedRecord, RecordSet, prepare
from validation.tracing.problem import require_one_unit
from validation.tracing.settings import (
    PLAY_COEFFICIENT,
    PLAY_CURVE_SCALE,
    PLAY_PRIOR,
    PLAY_SAMPLES,
    PLAY_START_PART,
)

Added = Sequence[tuple[PlacedForm, Values]]
"""Forms of effects with the values of their parameters, in the order in which they are added."""
_DEGREE, _MOST_COLUMNS = 3, 32


@dataclass(frozen=True, eq=False)
class PlayProblem(RecordSet):
    """Records of a rig of unknown geometry; see :class:`validation.tracing.problem.Problem`.

    Parameters
    ----------
    powers
        Largest power of the position that the widths depend on; 0 makes them constant.
    curve
        Columns of the spline f.
    middle
        The drive's value from which it is counted.
    range
        Least and largest drive from there, which the radii of the plays are parts of.
    trained
        The same of the samples that f is fitted to, beyond which it is straight.
    arrived
        Length of the stroke that led to the first sample of each record, with its sign.
    changed
        Whether a record is traced; the others are a reference, on which only ``shared`` forms act.
    shared
        Forms that act on all records.
    """

    powers: int
    curve: int
    parameters: tuple[FreeParameter, ...]
    start: Values
    middle: float
    scale: CurveScale
    range: tuple[float, float]
    trained: tuple[float, float]
    arrived: tuple[float, ...]
    changed: tuple[bool, ...]
    shared: tuple[CurveForm, ...] = ()

    @property
    def prior_weight_deg(self) -> float:
        """See :class:`validation.tracing.problem.Problem`."""
        return PLAY_PRIOR * self.scale.angle

    @cached_property
    def _placed(self) -> dict[int, PlacedForm]:
        return {}

    def forms(self, effect: Effect) -> tuple[PlacedForm, ...]:
        """Forms whose needs are met, of those that act on drive, loop, angle or reading.

        A form that acts on f alone adds nothing to a free f, unless a reference holds that f.
        """
        met: set[Need] = set()
        if all(inputs.timed for inputs in self.inputs):
            met.add("time")
        if cycles_repeat(self.inputs):
            met.add("cycles")
        if self.is_compared:
            met.add("reference")

        def acts(form: CurveForm) -> bool:
            return any((form.drive, form.angle, form.observe, form.loop_size)) or self.is_compared

        there = [form for form in effect.curve_forms if form.needs <= met and acts(form)]
        return tuple(map(self.placed, there))

    def placed(self, form: CurveForm) -> PlacedForm:
        """Give a form the units of these records; the same object for the same form."""
        return self._placed.setdefault(id(form), self.scale.placed(form))

    def trained_on(self, train: Sequence[Mask]) -> PlayProblem:
        """Give the same problem with an f that is straight beyond the training samples, masks of shapes (m_i,).

        Coefficients of a spline that reaches further would be fitted to nothing: where the largest of three amplitudes
        was held out, they predicted it to 9.1 deg of 116, and a straight f to 1.2.
        """
        drives = np.concatenate([stroke[mask] for stroke, mask in zip(self._strokes, train, strict=True)])
        trained = float(drives.min()), float(drives.max())
        if trained == self.trained or trained[0] == trained[1]:
            return self
        return self._narrower.setdefault(trained, replace(self, trained=trained))

    @cached_property
    def _narrower(self) -> dict[tuple[float, float], PlayProblem]:
        return {}

    def starts(self, form: PlacedForm) -> Sequence[Values]:
        """Give starting values of a form; the linear parameters of the baseline need none."""
        return form.starts

    @property
    def is_compared(self) -> bool:
        """Whether some records are a reference."""
        return not all(self.changed)

    @cached_property
    def _strokes(self) -> tuple[Floats, ...]:
        return tuple(inputs.drive - self.middle for inputs in self.inputs)

    @cached_property
    def _kept_columns(self) -> Cache:
        """Columns: most derivatives are by their coefficients. Few are kept, since they may be a megabyte."""
        return Cache(most=_MOST_COLUMNS)

    @cached_property
    def _kept_loop_sizes(self) -> Cache:
        """Factors on the loop, one of each record."""
        return Cache()

    def predict(self, values: Values, added: Added) -> list[Floats]:
        """Angles of all records by the baseline with forms added, shapes (m_i,); the order of forms counts.

        Each record is an independent run of the operators: drive, f, backbone, plays, angle, observe.
        """
        acting = [(placed.form, placed.relative_values(mine)) for placed, mine in added]
        acting.sort(key=lambda one: self._is_shared(one[0]))  # so that a change counts in the unit of the record
        coefficients = np.array([values[parameter.name] for parameter in self.parameters])
        return [
            self._record(i, coefficients, columns, self._acting(i, acting))
            for i, columns in enumerate(self._columns(acting))
        ]

    def _is_shared(self, form: CurveForm) -> bool:
        return any(form is one for one in self.shared)

    def _acting(self, i: int, forms: Sequence[tuple[CurveForm, Values]]) -> Sequence[tuple[CurveForm, Values]]:
        """Forms that act on a record."""
        return forms if self.changed[i] else [one for one in forms if self._is_shared(one[0])]

    def _record(
        self,
        i: int,
        coefficients: Floats,
        columns: tuple[Floats, Floats],
        acting: Sequence[tuple[CurveForm, Values]],
    ) -> Floats:
        """Angle of one record, deg."""
        context, (curve, loops) = self._contexts[i], columns
        f = curve @ coefficients[: self.curve]
        weight = np.ones(f.size)
        for form, mine in acting:
            if form.backbone is not None and self.is_compared:
                f = form.backbone(f, context, mine)
            if form.loop_size is not None:
                weight = weight * self._loop_size(i, form, mine, f)
        theta = f + weight * (loops @ coefficients[self.curve :])
        for form, mine in acting:
            if form.angle is not None:
                theta = form.angle(theta, context, mine)
            if form.observe is not None:
                theta = form.observe(theta, self.inputs[i], mine)
        return theta

    def _loop_size(self, i: int, form: CurveForm, mine: Values, f: Floats) -> Floats:
        """Factor on the loop; derivatives by the widths of plays leave f as it is."""
        size = form.loop_size
        assert size is not None
        key = (i, size, *mine.items(), f.tobytes())
        return self._kept_loop_sizes.get(key, lambda: size(f, self._contexts[i], mine))

    def _columns(self, acting: Sequence[tuple[CurveForm, Values]]) -> list[tuple[Floats, Floats]]:
        """Columns of f and of the plays of each record."""
        drives = [one for one in acting if one[0].drive is not None]
        key = tuple((form.drive, self._is_shared(form), *mine.items()) for form, mine in drives)
        return self._kept_columns.get(key, lambda: [self._columns_of(i, acting) for i in range(len(self._strokes))])

    def _columns_of(self, i: int, acting: Sequence[tuple[CurveForm, Values]]) -> tuple[Floats, Floats]:
        """Columns of one record, shapes (m, curve) and (m, plays); those of the plays count a tenth of the range."""
        x = self._strokes[i]
        for form, mine in self._acting(i, acting):
            if form.drive is not None:
                x = form.drive(x, self._contexts[i], mine)
        low, high = self.range
        span, arrived = high - low, self.arrived[i]
        radii = span * np.array(PLAY_RADII)
        state = x[0] - np.sign(arrived) * np.minimum(radii, PLAY_START_PART * abs(arrived))
        loops = [p - x for p in plays(x, radii, state)]
        position = (x - 0.5 * (low + high)) / (0.5 * span)
        columns = [loop * position**power for loop in loops for power in range(self.powers + 1)]
        curve = spline_columns(x, *self.trained, self.curve) - self._columns_in_the_middle
        return curve, np.column_stack(columns) / (0.1 * span)

    @cached_property
    def _columns_in_the_middle(self) -> Floats:
        """Columns of f where the drive is counted from, shape (1, curve)."""
        return spline_columns(np.zeros(1), *self.trained, self.curve)

    @cached_property
    def _contexts(self) -> tuple[CurveContext, ...]:
        """What operators know of each record."""
        return tuple(
            CurveContext(
                inputs=inputs,
                drive_middle=self.middle,
                drive_half_range=self.scale.drive,
                angle_half_range_deg=self.scale.angle,
                straight_deg=0.0,
                initial_state=float(np.sign(arrived)),
                preload_ratio=1.0,
                loop_ratio=1.0,
                toe_ratio=0.0,
                slope_loss_per_loop=0.0,
            )
            for inputs, arrived in zip(self.inputs, self.arrived, strict=True)
        )


def spline_columns(x: Floats, low: float, high: float, count: int) -> Floats:
    """Cubic B-splines on even knots, straight beyond them: shapes (m,) -> (m, count)."""
    knots = np.concatenate([[low] * _DEGREE, np.linspace(low, high, count - _DEGREE + 1), [high] * _DEGREE])
    inside = np.clip(x, low, high)
    columns = np.asarray(BSpline.design_matrix(inside, knots, _DEGREE).toarray())
    beyond = x - inside
    if np.any(beyond):
        slope = BSpline(knots, np.eye(count), _DEGREE).derivative()(inside)
        columns = columns + slope * beyond[:, None]
    return columns


def after_first_stroke(records: Sequence[Record], samples: int) -> tuple[tuple[PreparedRecord, ...], tuple[float, ...]]:
    """Thin records from the end of their first stroke on; also that stroke, with its sign.

    A record that does not reverse, or has little behind its first stroke, stays whole.

    Parameters
    ----------
    samples
        Of a record at most, about; turning points are never left out.
    """
    kept, arrived = [], []
    for record in records:
        first = first_stroke(record.drive)
        turn = first.stop - 1 if 2 * (first.stop - 1) < record.drive.size else 0
        kept.append(turn + kept_samples(record.drive[turn:], samples))
        arrived.append(float(record.drive[turn] - record.drive[min(first.start, turn)]))
    return prepare(records, kept), tuple(arrived)


def play_problem(
    records: Sequence[Record],
    *,
    powers: int = 1,
    curve: int = 8,
    reference: Sequence[Record] = (),
    shared: Sequence[CurveForm] = (),
    samples: int = PLAY_SAMPLES,
) -> PlayProblem:
    """Make a problem of records of one rig.

    Parameters
    ----------
    records
        All with one unit of the drive.
    powers, curve
        See :class:`PlayProblem`.
    reference
        Records of the same rig before a change: they share the baseline.
    shared
        Forms that act on the reference, too: effects that it was found to have.
    samples
        Of a record at most, about.

    Raises
    ------
    RecordError
        Records of different units of the drive.
    """
    changed = (*[True] * len(records), *[False] * len(reference))
    everything = [*records, *reference]
    require_one_unit(everything)
    used, arrived = after_first_stroke(everything, samples)
    drives, observed = [one.drive for one in used], [one.angle_deg for one in used]
    middle = middle_of(drives)
    low, high = min(float(d.min()) for d in drives), max(float(d.max()) for d in drives)
    scale = CurveScale(
        drive=max(high - middle, middle - low),
        angle=0.5 * max(float(np.ptp(angle)) for angle in observed),
        time=min(float(one.inputs.time_s[-1] - one.inputs.time_s[0]) for one in used),
        unit=records[0].drive_unit,
    )
    bound = PLAY_COEFFICIENT * scale.angle
    f = [FreeParameter(f"f_{k}", "deg", -bound, bound, PLAY_CURVE_SCALE * scale.angle) for k in range(curve)]
    widths = range(len(PLAY_RADII) * (powers + 1))
    parameters = (*f, *(FreeParameter(f"play_{k}", "deg", -bound, bound, scale.angle) for k in widths))
    return PlayProblem(
        records=used,
        powers=powers,
        curve=curve,
        parameters=parameters,
        start={parameter.name: 0.0 for parameter in parameters},
        middle=middle,
        scale=scale,
        range=(low - middle, high - middle),
        trained=(low - middle, high - middle),
        arrived=arrived,
        changed=changed,
        shared=tuple(shared),
    )

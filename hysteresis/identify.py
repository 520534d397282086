"""Identification of the improved Bouc-Wen law (paper, eq. 6-7) on records: ``fit = identify(record, base)``."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count, product
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from hysteresis import search
from hysteresis.arrays import Mask
from hysteresis.backbone import Backbone, Kinematics, fitted_backbone, given_backbone
from hysteresis.fit import Fit as Fit
from hysteresis.fit import Label
from hysteresis.holdout import Split, hold_out, validate_within
from hysteresis.judgement import judge
from hysteresis.optimizers import METHODS, Method
from hysteresis.path import branches, cycle_index, require_reversal
from hysteresis.record import Record, RecordError
from hysteresis.search import Effort, Fitness, Form, Point, Samples

_KNOTS = (1, 2, 3, 5, 9, 17)  # numbers of slopes that a fitted f is tried with
_SEARCH_KNOTS = 9  # number of slopes during the global search
_SEARCH_SAMPLES = 400  # of a record
_POLISH_SAMPLES = 2500
_AS_GOOD = 1.05  # a simpler form is taken when its validation error is within this factor of the best
_NEAR = 1.5  # ends of a polish with an error within this factor of the best are followed up
_SHARES = (0.05, 0.2, 0.5)  # of the path to saturation: where the first of two elements may end
_SAME_END = 1.01  # in errors: two searches ended alike
_LONGEST_DELAY = 0.02  # of the shortest record
_ENOUGH_CYCLES = 8  # in the training part, to draw whole cycles for a bootstrap; else pieces of branches
_PIECES = 5  # of a branch
_ROUNDING = 1e-9  # of the angle's range; errors below it are those of the arithmetic


def identify(
    record: Record | Sequence[Record],
    base: Kinematics | Sequence[Kinematics] | None = None,
    *,
    kinematics: Literal["analytic", "chain"] = "analytic",
    fitness: Fitness = "rmse",
    method: Method = "genetic",
    seed: int = 0,
    seeds: int = 1,
    population: int = 100,
    generations: int = 90,
    elements: int | None = 1,
    delay: bool = False,
    amplitude_by: Sequence[object] | None = None,
    splits: Sequence[Split] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Identify A, beta, gamma, n and the initial state of the improved Bouc-Wen law.

    Parameters
    ----------
    record
        A loop: the drive must go there and back. Several records are fitted jointly: they share f and the constants
        of h; each has its own initial state, and its own zero of the angle.
    base
        The kinematics f, drive in mm -> angle in deg, shape (m,) -> (m,), for all records or one for each. Its zero
        is free, and for a drive that is not in mm also the gain. Without it the record's own theory is taken, and
        without that f is fitted to the data: monotone, its slope given at a number of knots that is chosen within
        the training data.
    kinematics
        Name of ``base`` in the result.
    fitness
        ``"rmse"``: root mean square error, and a least-squares polish of all unknowns together.
        ``"paper-signed-mean"``: eq. 8 of the paper, a mean in which errors cancel; for comparison, no polish.
    method
        Of the global search, see :func:`hysteresis.optimizers.evolve`.
    seed, seeds
        Of the search, and how many searches there are, from ``seed`` on; the same seed gives the same fit.
    population, generations
        Of a search: individuals, at least 8; generations, at least 3.
    elements
        Of h, 1 or 2; None chooses within the training data.
    delay
        Whether the angle may be behind the drive in time, by up to 2 % of the shortest record.
    amplitude_by
        A label for each record: the size of h is free in each label after the first. By default the preload, where
        all records have one.
    splits
        What of each record is fitted and what is held out; by default :func:`hysteresis.holdout.hold_out`.
    progress
        Called with (generations done, generations in all).

    Raises
    ------
    RecordError
        A record that never reverses, has too few samples, an angle that never changes, or leaves its own theory;
        records of different drive units; a delay without times.
    ValueError
        An unknown fitness or method, too small a search, or kinematics that give no finite angle.
    """
    began = time.perf_counter()
    records = [record] if isinstance(record, Record) else list(record)
    _require_usable(records, delay)
    _require_search(fitness, method, population, generations, elements, seeds)
    done = count(1)  # generations

    def tick() -> None:
        if progress is not None:
            progress(next(done), generations * seeds)

    efforts = [Effort(method, fitness, seed + i, population, generations, tick) for i in range(seeds)]
    splits = [hold_out(r) for r in records] if splits is None else list(splits)
    bases, label = _kinematics(records, base, kinematics)
    form = Form(
        backbones=(),
        elements=1,
        groups=_groups(records, amplitude_by),
        longest_delay_s=_longest_delay(records) if delay else 0.0,
    )
    found = _find(records, splits, bases, form, efforts, elements)
    form, point, evaluations, agreeing = found
    samples = join(records, [split.train for split in splits], timed=delay)
    facts: dict[str, Any] = {
        "method": method, "evaluations": evaluations, "seed": seed, "seeds": seeds, "seeds_agreeing": agreeing,
        "kinematics": label,
    }  # fmt: skip
    fit = judge(
        records, splits, samples, samples.thinned(_POLISH_SAMPLES), form, point, intervals=fitness == "rmse", **facts
    )
    return replace(fit, seconds=time.perf_counter() - began)


def join(records: Sequence[Record], seen: Sequence[Mask], *, timed: bool = False) -> Samples:
    """Put records one after the other as samples of a fit; ``seen``, shapes (m_i,), mark what it may see."""
    starts = np.cumsum([0, *(len(r.drive) for r in records)])[:-1]
    times = [r.time_s for r in records if r.time_s is not None] if timed else []
    return Samples(
        np.concatenate([r.drive for r in records]),
        np.concatenate([r.angle_deg for r in records]),
        np.concatenate(list(seen)),
        tuple(int(start) for start in starts),
        np.concatenate(times) if times else None,
        tuple((time, r.drive) for time, r in zip(times, records, strict=True)) if times else (),
        _blocks(records, seen),
    )


def _blocks(records: Sequence[Record], seen: Sequence[Mask]) -> NDArray[np.int64]:
    """Block of each sample for a bootstrap: its cycle where enough are seen, else a fifth of a branch."""
    cycles = [cycle_index(record) for record in records]
    if sum(len(np.unique(c[mask])) for c, mask in zip(cycles, seen, strict=True)) < _ENOUGH_CYCLES:
        cycles = [np.zeros_like(c) for c in cycles]
        for record, mine in zip(records, cycles, strict=True):
            for i, branch in enumerate(branches(record.drive)):
                size = branch.stop - branch.start
                mine[branch] = _PIECES * i + np.arange(size) * _PIECES // size
    firsts = np.cumsum([0, *(int(mine.max()) + 1 for mine in cycles)])[:-1]
    return np.concatenate([mine + first for mine, first in zip(cycles, firsts, strict=True)])


# --- what is asked for -------------------------------------------------------------------------------------------


def _require_usable(records: Sequence[Record], delay: bool) -> None:
    if not records:
        raise ValueError("records: none: expected at least one")
    for record in records:
        name = record.source or "record"
        require_reversal(record)
        if np.ptp(record.angle_deg) == 0:
            raise RecordError(f"{name}: angle = {record.angle_deg[0]:g} throughout: expected an angle that changes")
        if record.drive_unit != records[0].drive_unit:
            expected = f"expected {records[0].drive_unit}, as in the first record"
            raise RecordError(f"{name}: drive in {record.drive_unit}: {expected}")
        if delay and record.time_s is None:
            raise RecordError(f"{name}: time: missing: expected times, to fit a delay")


def _require_search(
    fitness: str, method: str, population: int, generations: int, elements: int | None, seeds: int
) -> None:
    if fitness not in ("rmse", "paper-signed-mean"):
        raise ValueError(f"fitness = {fitness!r}: expected 'rmse' or 'paper-signed-mean'")
    if method not in METHODS:
        raise ValueError(f"method = {method!r}: expected one of {', '.join(METHODS)}")
    if elements not in (None, 1, 2) or (elements != 1 and fitness != "rmse"):
        raise ValueError(f"elements = {elements}: expected 1, 2 or None; 1 for the paper's fitness")
    for name, value, least in (("population", population, 8), ("generations", generations, 3), ("seeds", seeds, 1)):
        if value < least:
            raise ValueError(f"{name} = {value}: expected at least {least}")


def _groups(records: Sequence[Record], labels: Sequence[object] | None) -> tuple[int, ...]:
    """Group of each record, by label in order of appearance; all in one where not all have a label."""
    if labels is None:
        labels = [record.rig.get("preload_N") for record in records]
        if None in labels:
            return (0,) * len(records)
    if len(labels) != len(records):
        raise ValueError(f"amplitude_by: {len(labels)} labels: expected one for each of {len(records)} records")
    known = list(dict.fromkeys(labels))
    return tuple(known.index(label) for label in labels)


def _longest_delay(records: Sequence[Record]) -> float:
    return _LONGEST_DELAY * min(float(r.time_s[-1] - r.time_s[0]) for r in records if r.time_s is not None)


def _kinematics(
    records: Sequence[Record], base: Kinematics | Sequence[Kinematics] | None, label: Label
) -> tuple[list[Kinematics] | None, Label]:
    """Take the caller's kinematics, else the records' theory, else none."""
    if base is not None:
        bases = [base] * len(records) if callable(base) else list(base)
        for kinematics, record in zip(bases, records, strict=True):
            _require_finite(kinematics, record)
        return bases, label
    if any(record.kinematics is None for record in records):
        return None, "fitted"
    return [_theory(record) for record in records], "theory"


def _theory(record: Record) -> Kinematics:
    """Interpolate the record's own theory; flat beyond its ends."""
    assert record.kinematics is not None
    if record.drive_unit == "N":
        raise RecordError(f"{record.source or 'record'}: kinematics: expected a drive in mm, deg or step, not a force")
    first, last = record.kinematics[[0, -1], 0]
    low, high = float(record.drive.min()), float(record.drive.max())
    slack = 1e-6 * (last - first)
    if record.drive_unit == "mm" and (low < first - slack or high > last + slack):
        raise RecordError(
            f"{record.source or 'record'}: drive from {low:g} to {high:g}: expected within the kinematics table, "
            f"{first:g} to {last:g}"
        )
    curve = PchipInterpolator(*record.kinematics.T)
    return lambda drive: curve(np.clip(drive, first, last))


def _require_finite(base: Kinematics, record: Record) -> None:
    if record.drive_unit not in ("mm", "N"):
        return  # the drive is scaled first
    angle = np.asarray(base(record.drive), dtype=float)
    if angle.shape != record.drive.shape or not np.isfinite(angle).all():
        raise ValueError(f"base: shape {angle.shape}: expected {record.drive.shape} finite angles for the drive")


# --- the search --------------------------------------------------------------------------------------------------


def _find(
    records: Sequence[Record],
    splits: Sequence[Split],
    bases: Sequence[Kinematics] | None,
    form: Form,
    efforts: Sequence[Effort],
    elements: int | None,
) -> tuple[Form, Point, int, int]:
    """Find the form of the model and its numbers; also the evaluations it took, and how many searches agreed.

    The form (knots of a fitted f, elements of h) and the choice between optima are by validation inside the training
    samples; a single form needs none.
    """
    fitness, timed = efforts[0].fitness, form.longest_delay_s > 0
    samples = join(records, [split.train for split in splits], timed=timed)
    seen = np.concatenate(samples.seen_drives()), samples.angle_deg[samples.seen]
    curves: dict[int, tuple[Backbone, ...]]
    if bases is not None:
        curves = {0: tuple(given_backbone(base, *seen, records[0].drive_unit) for base in bases)}
    else:
        curves = {knots: (fitted_backbone(*seen, knots),) * len(records) for knots in _KNOTS}
    wanted = (1, 2) if elements is None else (elements,)
    if fitness != "rmse" or (bases is not None and wanted == (1,)):
        form = replace(form, backbones=curves[min(_SEARCH_KNOTS, max(curves))])
        few = samples.thinned(_SEARCH_SAMPLES * len(records))
        forms_points, evaluations, agreeing = _search(few, form, efforts)
        point = forms_points[0]
    else:
        form, point, evaluations, agreeing = _choose(records, splits, curves, form, efforts, wanted)
    if fitness != "rmse":
        return form, point, evaluations, agreeing
    plain = search.plain(form, samples)
    if point.sign == 0:
        return form, plain, evaluations, agreeing
    fine = samples.thinned(_POLISH_SAMPLES)
    point, calls = search.polish(fine, form, point)
    point = point if _earns_its_place(fine, form, point, plain) else plain
    return form, point, evaluations + calls, agreeing


def _earns_its_place(samples: Samples, form: Form, point: Point, plain: Point) -> bool:
    """Tell whether h lowers the training error by more than as many more parameters do by fitting noise.

    That is m log(sum of squares) + size log m (Schwarz 1978, doi 10.1214/aos/1176344136), and a gain that matters.
    """
    m = int(samples.seen.sum())
    without = search.rmse(samples, form, plain)
    gain = min(1 / _AS_GOOD, m ** (-0.5 * form.size / m))
    return without > _rounding(samples) and search.rmse(samples, form, point) < gain * without


def _rounding(samples: Samples) -> float:
    return _ROUNDING * samples.span_deg()


def _search(samples: Samples, form: Form, efforts: Sequence[Effort]) -> tuple[list[Point], int, int]:
    """Search on few samples and polish what is found: those about as good as the best, which comes first."""
    points: list[Point] = []
    errors: list[float] = []
    evaluations = 0
    for effort in efforts:
        found, calls = search.explore(samples, form, effort)
        evaluations += calls
        if effort.fitness != "rmse":
            return found[:1], evaluations, 1
        ends, calls = _polish_all(samples, form, found)
        evaluations += calls
        points += ends
        errors.append(search.rmse(samples, form, ends[0]))
    agreeing = sum(error <= max(_SAME_END * min(errors), _rounding(samples)) for error in errors)
    return _nearest(samples, form, points), evaluations, agreeing


def _polish_all(samples: Samples, form: Form, points: Sequence[Point]) -> tuple[list[Point], int]:
    polished = [search.polish(samples, form, point) for point in points]
    return _nearest(samples, form, [point for point, _ in polished]), sum(calls for _, calls in polished)


def _nearest(samples: Samples, form: Form, points: Sequence[Point]) -> list[Point]:
    """Those about as good as the best, the best first."""
    ends = sorted(((search.rmse(samples, form, point), point) for point in points), key=lambda end: end[0])
    return [point for error, point in ends if error <= _NEAR * ends[0][0]]


def _choose(
    records: Sequence[Record],
    splits: Sequence[Split],
    curves: dict[int, tuple[Backbone, ...]],
    form: Form,
    efforts: Sequence[Effort],
    elements: Sequence[int],
) -> tuple[Form, Point, int, int]:
    """Choose knots, elements and optimum by validation inside the training samples.

    The simplest that is as good as the best: curves without hysteresis first, then one element, then two.
    """
    timed = form.longest_delay_s > 0
    inner = [validate_within(record, split) for record, split in zip(records, splits, strict=True)]
    few = join(records, [split.train for split in inner], timed=timed).thinned(_SEARCH_SAMPLES * len(records))
    check = join(records, [split.heldout for split in inner], timed=timed).thinned(_POLISH_SAMPLES)
    affordable = [knots for knots in curves if 3 * (knots + 6) <= few.seen.sum()] or [min(curves)]
    forms = {knots: replace(form, backbones=curves[knots]) for knots in affordable}
    first = forms[min(affordable[-1], _SEARCH_KNOTS)]
    starts, evaluations, agreeing = _search(few, first, efforts)
    tried: list[tuple[float, Form, Point]] = []
    for shape in forms.values():
        plain = search.plain(shape, few)
        tried.append((search.rmse(check, shape, plain), shape, plain))
    ends: dict[int, list[Point]] = {}
    for number, (knots, shape) in product(range(1, max(elements) + 1), forms.items()):
        if number == 1:
            moved = [search.with_curve_of(shape, few, first, start) for start in starts]
        else:
            pairs = [search.split_element(shape, point, share) for point in ends[knots][:1] for share in _SHARES]
            shape, moved = pairs[0][0], [point for _, point in pairs]
        ends[knots], calls = _polish_all(few, shape, moved)
        evaluations += calls
        if number in elements:
            tried += [
                (search.rmse(check, shape, point), shape, point) for point in _best_first(check, shape, ends[knots])
            ]
    limit = max(_AS_GOOD * min(error for error, _, _ in tried), _rounding(few))
    _, form, point = next(entry for entry in tried if entry[0] <= limit)
    return form, point, evaluations, agreeing


def _best_first(check: Samples, form: Form, points: Sequence[Point]) -> list[Point]:
    return sorted(points, key=lambda point: search.rmse(check, form, point))[:1]

"""Metrics of a hysteresis loop: errors of a prediction, width, area, noise floor.

Angles are in degrees; the drive keeps the unit of its record. Loops are the complete cycles of
:func:`hysteresis.records.path.find_cycles`; cycle 0, the approach, is never used.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtri

from hysteresis.arrays import Floats, Ints
from hysteresis.records.leaps import Leap, find_leap
from hysteresis.records.path import branches, cycle_index, cycle_slices, find_cycles, first_stroke

if TYPE_CHECKING:  # records have a loop width, which is measured here
    from hysteresis.records.record import Record

_CLOSED = 0.05  # of a cycle's drive range: largest gap of a closed cycle, and of turning points that repeat
_COMPARED = 100  # cycles that all others are compared with: records of a thousand cycles need no pairs of all
_BIN = 0.002  # of a cycle's drive range: closer samples of one branch are averaged

_AMID = 0.03  # of a cycle: a leap that is nearer to its ends may be what the rig itself changes between cycles
_DRIFT_CYCLES = 4  # cycles from which a drift of their means can be told from their scatter
_SAME_STATE = 0.999  # of cycles from one state whose first stroke is taken for one


# --- errors ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Errors:
    """Errors of a prediction, as in Table 1 of the paper (Mech. Sci. 9, 2018), relative to the range of eq. 8.

    The range is max - min of the measured angle. Table 1 of the paper uses another reference: 1.48 deg printed as
    3.23 % (1.61 deg as 3.58 %) implies about 45 deg, the amplitude, while the range is 90 deg. ``max_rel_percent`` is
    therefore about half of the paper's value; the two are not directly comparable.
    """

    rmse_deg: float
    max_abs_deg: float
    max_rel_percent: float  # 100 max_abs_deg / range
    normalised: float  # rmse_deg / range

    def to_dict(self) -> dict[str, float]:
        """Return plain values for JSON."""
        return asdict(self)


def errors(measured_deg: ArrayLike, predicted_deg: ArrayLike) -> Errors:
    """Compare a prediction with a measurement, sample by sample.

    Parameters
    ----------
    measured_deg, predicted_deg
        Shape (m,), degrees.

    Raises
    ------
    ValueError
        Shapes that differ, a value that is not finite, or a measured angle that never changes.
    """
    deviation, span = _deviation(measured_deg, predicted_deg)
    rmse = float(np.sqrt(np.mean(deviation**2)))
    largest = float(np.max(np.abs(deviation)))
    return Errors(rmse, largest, 100 * largest / span, rmse / span)


def _deviation(measured_deg: ArrayLike, predicted_deg: ArrayLike) -> tuple[Floats, float]:
    measured, predicted = _rows("measured_deg", measured_deg, "predicted_deg", predicted_deg)
    span = float(np.ptp(measured))
    if span == 0:
        raise ValueError(f"measured_deg = {measured[0]:g} throughout: expected an angle that changes")
    return predicted - measured, span


def _rows(first: str, a: ArrayLike, second: str, b: ArrayLike) -> tuple[Floats, Floats]:
    x, y = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if x.ndim != 1 or x.size == 0 or x.shape != y.shape:
        raise ValueError(f"{first}, {second}: shapes {x.shape}, {y.shape}: expected two rows of the same length")
    for name, row in ((first, x), (second, y)):
        if not np.isfinite(row).all():
            raise ValueError(f"{name}: NaN or infinite: expected finite numbers")
    return x, y


# --- the loop ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class LoopWidth:
    """Vertical distance between the two branches of a loop, mean of its complete cycles.

    The sign is positive where the angle lags the drive: the falling branch is above the rising one (below it, for an
    angle that falls with the drive).
    """

    max_deg: float  # largest |width|; biased upwards by noise, see loop_width
    at_drive: float  # drive of the largest width
    at_zero_deg: float | None  # signed width at zero drive; None if no loop crosses it
    drive: Floats = field(repr=False)  # shape (k,), increasing
    width_deg: Floats = field(repr=False)  # shape (k,), signed

    def to_dict(self) -> dict[str, float | list[float] | None]:
        """Return plain values for JSON."""
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}


def loop_width(drive: ArrayLike, angle_deg: ArrayLike, cycle: ArrayLike | None = None) -> LoopWidth:
    """Measure the width of a loop over the drive.

    Each branch is made single valued: samples within 0.2 % of the drive's range are averaged, which removes dwell and
    jitter. The branches are interpolated linearly at the drives that both cover. At each drive, the mean is taken over
    the cycles that reach it.

    The maximum of many noisy widths is biased upwards: white noise of 0.05 deg alone gives a ``max_deg`` of 0.19 deg
    for one cycle of 177 samples and 0.06 deg for the mean of ten. ``at_zero_deg`` is unbiased.

    Parameters
    ----------
    drive, angle_deg
        Shape (m,), in chronological order.
    cycle
        Shape (m,), 0 for the approach; found from the reversals if absent.

    Raises
    ------
    ValueError
        No complete cycle, or arrays of different shapes.
    """
    x, y = _rows("drive", drive, "angle", angle_deg)
    return _loops_over(x, find_cycles(x, y) if cycle is None else np.asarray(cycle)).width(y)


@dataclass(frozen=True, eq=False)
class LoopsOverDrive:
    """Cycles and branches of a drive, to measure the loops of many angles over it; made by :func:`loops_over`."""

    drive: Floats  # shape (m,)
    grid: Floats  # shape (k,), increasing: drives at which there is a width
    reached: Ints  # shape (k,), number of cycles that reach each, at least one
    cycles: tuple[_Cycle, ...]

    def width(self, angle_deg: ArrayLike) -> LoopWidth:
        """Measure the width of the loop of an angle of shape (m,), as :func:`loop_width` does, to the last bit.

        Raises
        ------
        ValueError
            A shape that differs from that of the drive, or a value that is not finite.
        """
        y, grid, places = np.asarray(angle_deg, dtype=float), self.grid, self._places
        if y.shape != self.drive.shape or not np.isfinite(y).all():
            _rows("drive", self.drive, "angle", y)
        means = places.means(y)
        widths = np.zeros(places.down.before.size + 1)  # of all cycles, end to end; then what is outside of one
        widths[:-1] = places.down.of(means) - places.up.of(means)
        width = _lag_sign(places.centred, y) * (places.onto.of(widths).sum(axis=0) / self.reached)
        k = int(np.abs(width).argmax())
        at_zero = float(np.interp(0.0, grid, width)) if grid[0] <= 0 <= grid[-1] else None
        return LoopWidth(float(abs(width[k])), float(grid[k]), at_zero, grid, width)

    @cached_property
    def _places(self) -> _Places:
        branches = [branch for cycle in self.cycles for branch in (cycle.up, cycle.down)]
        begin = np.cumsum([0] + [branch.size.size for branch in branches])
        up, down = (
            _joined([_lookup(c.grid, getattr(c, way).drive, begin[2 * n + k]) for n, c in enumerate(self.cycles)])
            for k, way in enumerate(("up", "down"))
        )
        start = np.cumsum([0] + [c.grid.size for c in self.cycles])
        onto = [_lookup(self.grid, c.grid, start[n], outside=start[-1]) for n, c in enumerate(self.cycles)]
        return _Places(
            centred=self.drive - self.drive.mean(),
            samples=np.concatenate([branch.samples for branch in branches]),
            number=np.concatenate([branch.number + first for branch, first in zip(branches, begin, strict=False)]),
            size=np.concatenate([branch.size for branch in branches]),
            up=up,
            down=down,
            onto=_Lookup(*(np.array(parts) for parts in zip(*onto, strict=True))),
        )


class _Lookup(NamedTuple):
    """Places of a linear interpolation in a row of values: from one, the way over the gap to another one."""

    before: Ints
    after: Ints
    gap: Floats
    way: Floats

    def of(self, values: Floats) -> Floats:
        """Interpolate, to the last bit as ``np.interp``."""
        low = values[self.before]
        return np.asarray((values[self.after] - low) / self.gap * self.way + low)


def _lookup(at: Floats, x: Floats, first: int, outside: int | None = None) -> _Lookup:
    """Find values at ``at`` among those at ``x``, increasing, the first of which has the place ``first``.

    ``outside`` is the place of the value beyond both ends.
    """
    j = np.searchsorted(x, at, side="right") - 1
    inside = (j >= 0) & (at <= x[-1])
    j, last = np.maximum(j, 0), x.size - 1
    after = np.minimum(j + 1, last)
    within = inside & (j < last)
    before, behind = j + first, after + first
    if outside is not None:
        before, behind = np.where(inside, before, outside), np.where(inside, behind, outside)
    return _Lookup(before, behind, np.where(within, x[after] - x[j], 1.0), np.where(within, at - x[j], 0.0))


def _joined(parts: Sequence[_Lookup]) -> _Lookup:
    return _Lookup(*(np.concatenate(one) for one in zip(*parts, strict=True)))


class _Places(NamedTuple):
    """Where a width finds its samples: those of all branches, their bins end to end, and what lies between them."""

    centred: Floats  # shape (m,), drive less its mean
    samples: Ints
    number: Ints
    size: Ints
    up: _Lookup  # of all cycles, end to end, among the bins
    down: _Lookup
    onto: _Lookup  # shape (cycles, k): at the grid of all, among the widths of the cycles

    def means(self, y: Floats) -> Floats:
        """Mean of the samples of each bin."""
        if self.size.size == self.samples.size:  # one each: their order alone changes
            out = np.empty(self.size.size)
            out[self.number] = y[self.samples]
            return out
        return np.asarray(np.bincount(self.number, y[self.samples]) / self.size)


def loops_over(drive: ArrayLike, cycle: ArrayLike) -> LoopsOverDrive:
    """Divide a drive of shape (m,), with the cycle of each sample, into what the widths of its loops need.

    Raises
    ------
    ValueError
        No complete cycle, arrays of different shapes, or a drive that is not finite.
    """
    x, _ = _rows("drive", drive, "drive", drive)
    return _loops_over(x, np.asarray(cycle))


def _loops_over(x: Floats, numbers: Ints) -> LoopsOverDrive:
    cycles = tuple(c for c in (_cycle_over(x, s) for s in _complete(x, numbers)) if c is not None)
    if not cycles:
        raise ValueError("drive: the two branches have no drive in common: expected a loop (there and back)")
    grid = np.unique(np.concatenate([c.grid for c in cycles]))
    reached = np.sum([(c.grid[0] <= grid) & (grid <= c.grid[-1]) for c in cycles], axis=0)
    return LoopsOverDrive(x, grid, reached, cycles)


def dissipated_area(drive: ArrayLike, angle_deg: ArrayLike, cycle: ArrayLike | None = None) -> float:
    """Integrate the area of the loop in (drive unit) x deg, mean of the closed cycles; positive for an angle that lags.

    The trapezoidal rule along the path is exact for a polygon. A cycle is closed if it ends within 5 % of its range
    of the drive at which it began; cycles of decaying amplitude are not, and enclose no area.

    Parameters
    ----------
    drive, angle_deg, cycle
        As :func:`loop_width`.

    Raises
    ------
    ValueError
        No closed cycle, or arrays of different shapes.
    """
    x, y, loops = _complete_cycles(drive, angle_deg, cycle)
    return -_lag_sign(x - x.mean(), y) * _mean_integral(x, y, loops)


def _complete_cycles(drive: ArrayLike, value: ArrayLike, cycle: ArrayLike | None) -> tuple[Floats, Floats, list[slice]]:
    """Return the samples of the cycles with a reversal; the last one must also return to its start."""
    x, y = _rows("drive", drive, "angle", value)
    return x, y, _complete(x, find_cycles(x, y) if cycle is None else np.asarray(cycle))


def _complete(x: Floats, numbers: Ints) -> list[slice]:
    """Return the samples of the cycles as :func:`_complete_cycles` does."""
    if numbers.shape != x.shape:
        raise ValueError(f"cycle: shape {numbers.shape}: expected the drive's, {x.shape}")
    slices = cycle_slices(x, numbers)
    continued = [b.start == a.stop - 1 for (_, a), (_, b) in pairwise(slices)] + [False]
    loops = [
        s
        for (number, s), reverses in zip(slices, continued, strict=True)
        if number != 0 and len(branches(x[s])) > 1 and (reverses or _is_closed(x[s]))
    ]
    if not loops:
        raise ValueError("drive: no complete cycle beside the approach (cycle 0): expected a loop (there and back)")
    return loops


def _is_closed(x: Floats) -> bool:
    # A gap of one step is allowed: a cycle numbered from its turning point ends one sample before the next one.
    return bool(abs(x[0] - x[-1]) <= max(_CLOSED * np.ptp(x), abs(x[-1] - x[-2])))


def _lag_sign(u: Floats, y: Floats) -> float:
    """Return -1 for an angle that falls with the drive less its mean, else 1, also for a loop with almost no slope."""
    v = y - y.mean()
    return -1.0 if u @ v < -0.1 * np.sqrt((u @ u) * (v @ v)) else 1.0


def _mean_integral(x: Floats, y: Floats, loops: list[slice]) -> float:
    closed = [s for s in loops if _is_closed(x[s])]
    if not closed:
        ends = f"{x[loops[0]][0]:g} to {x[loops[0]][-1]:g}"
        raise ValueError(f"drive: no closed cycle, the first goes from {ends}: expected the same drive at both ends")
    areas = []
    for s in closed:
        u, v = np.append(x[s], x[s.start]), np.append(y[s], y[s.start])
        areas.append(np.trapezoid(v, u))
    return float(np.mean(areas))


class _Branch(NamedTuple):
    """Samples of the rising or of the falling branches of a cycle, averaged within :data:`_BIN` of the drive."""

    drive: Floats  # shape (b,), increasing
    samples: Ints  # shape (n,), of the record
    number: Ints  # shape (n,), of the bin of each
    size: Ints  # shape (b,), of each bin


class _Cycle(NamedTuple):
    """One cycle over the drives that both its branches cover."""

    grid: Floats
    up: _Branch
    down: _Branch


def _cycle_over(x: Floats, where: slice) -> _Cycle | None:
    """Divide one cycle into its branches; None if they share no drive."""
    samples, own = dict[bool, list[int]]({True: [], False: []}), x[where]
    for s in branches(own):
        samples[bool(own[s.stop - 1] > own[s.start])] += range(where.start + s.start, where.start + s.stop)
    up, down = (_branch(x, np.array(samples[way], dtype=np.int64), np.ptp(own)) for way in (True, False))
    low, high = max(up.drive[0], down.drive[0]), min(up.drive[-1], down.drive[-1])
    if low >= high:
        return None
    grid = np.unique(np.concatenate([up.drive, down.drive]))
    return _Cycle(grid[(grid >= low) & (grid <= high)], up, down)


def _branch(drive: Floats, samples: Ints, span: float) -> _Branch:
    x = drive[samples]
    bins = np.floor((x - x.min()) / (_BIN * span)).astype(np.int64)
    _, number, count = np.unique(bins, return_inverse=True, return_counts=True)
    return _Branch(np.bincount(number, x) / count, samples, number, count)


# --- noise -------------------------------------------------------------------------------------------------------


def noise_floor(record: Record) -> float:
    """Estimate the standard deviation of the angle's noise, deg.

    With two or more cycles that repeat (same turning points, within 5 % of the cycle's drive range; also trials that
    only load): the pooled deviation from the mean of the cycles at the same branch and drive, with the (K - 1)
    correction. Linear interpolation averages noise; its factor is divided out. Changes from cycle to cycle, such as
    creep, count as noise. A first stroke from another state than that of later cycles does not: a record that starts at
    rest, or amid a play, is compared behind it.

    With a single cycle: 1.4826 times the median absolute second difference along the path of the drive, corrected by
    1/sqrt(6) (in its general form for uneven spacing). The curvature of the angle within two samples counts as noise.
    Angles that repeat from sample to sample (a sensor slower than the log), or that are quantised more coarsely than
    the noise, bias the estimate, down to zero.

    Parameters
    ----------
    record
        Drive and angle of one test.
    """
    repeats = _from_one_state(record, _repeats(record))
    if len(repeats) > 1:
        return _spread(record, repeats)
    return _local_noise(record.drive, record.angle_deg)


def repeatability_deg(record: Record) -> float | None:
    """Estimate the deviation of the angle from one cycle or trial to the next at equal drive and direction, deg.

    No model of one rig comes nearer to a cycle that it has not seen. It is pooled over all drives, with the (K - 1)
    correction. From four cycles on, a drift of the mean angle in proportion to the number of the cycle is taken out.
    Between its samples a cycle is interpolated linearly; by how much that averages deviations, their correlation from
    sample to sample tells. Unlike :func:`noise_floor` it counts what changes slowly along a cycle in full, and noise
    that is white as noise. A first stroke from another state is left out, as there.

    Returns
    -------
    float or None
        None where no two cycles repeat each other.
    """
    cycles = _from_one_state(record, _repeats(record))
    parts = _deviations(record, cycles)
    if not parts:
        return None
    deviations, factors = [part.deviation for part in parts], [part.factors for part in parts]
    leap = _leap_of(parts)
    if leap is not None:
        deviations = np.split(leap.left, np.cumsum([d.shape[1] for d in deviations])[:-1], axis=1)
    deviation, factor = np.concatenate(deviations, axis=1), np.concatenate(factors, axis=1)
    count, level = len(cycles), deviation.mean(axis=1)
    neighbours = sum(float(np.sum(d[:, 1:] * d[:, :-1])) for d in deviations)
    whole = float(np.sum(deviation**2))
    if whole == 0.0:
        return 0.0
    correlation = min(max(neighbours / whole, 0.0), 1.0)
    averaged = float(np.mean(factor + (1 - factor) * correlation))
    levels = float(level @ level) / (count - 1)
    if count >= _DRIFT_CYCLES:
        number = np.arange(count) - (count - 1) / 2
        drift = float(number @ level) ** 2 / float(number @ number)
        levels = (float(level @ level) - drift) / (count - 2)
    shape = float(np.sum((deviation - level[:, None]) ** 2)) / ((count - 1) * deviation.shape[1])
    return float(np.sqrt((levels + shape) / averaged))


@dataclass(frozen=True)
class CycleLeap:
    """From one instant on, a record is off by a constant against the cycles before, at equal drive and direction.

    Parameters
    ----------
    sample
        First sample behind it.
    size_deg
        Mean change of the angle.
    sudden
        It is the angle that leaps, amid a cycle. What changes from the end of a cycle on may be the rig itself.
    """

    sample: int
    size_deg: float
    sudden: bool


def leap_between_cycles(record: Record) -> CycleLeap | None:
    """Find a leap: a camera or a clamp that moved, counts that an encoder lost.

    The angle, or the drive, is off by a constant from one sample on. This must explain nearly all of what one cycle
    differs from the next, and far more than a steady drift does. A first stroke that differs from those of later cycles
    starts from another state, such as the middle of a play: no leap. Nor is what lasts into the stroke after it: its
    turning point was reached from that state, and friction remembers it until all has slid back.

    Returns
    -------
    CycleLeap or None
        None where no two cycles repeat each other, or without a leap.
    """
    cycles = _repeats(record)
    parts = _deviations(record, cycles)
    found = _leap_of(parts) if parts else None
    if found is None:
        return None
    at = np.cumsum([part.deviation.shape[1] for part in parts])
    branch = int(np.searchsorted(at, found.phase, side="right"))
    part, where = parts[branch], cycles[found.cycle][branch]
    drive = part.drives[found.phase - (int(at[branch - 1]) if branch else 0)]
    sample = where.start + int(np.argmin(np.abs(record.drive[where] - drive)))
    begin = first_stroke(record.drive).stop
    if sample < next((one.stop for one in branches(record.drive) if one.stop > begin), begin):
        return None
    amid = _AMID < found.phase / at[-1] < 1 - _AMID
    return CycleLeap(sample, found.size_deg, found.of_angle and bool(amid))


@dataclass(frozen=True, eq=False)
class _Deviations:
    """Of K cycles on one branch at g drives in the order of time: (g,), (K, g) less the mean, (g,), (K, g)."""

    drives: Floats
    deviation: Floats
    slope: Floats
    factors: Floats


def _deviations(record: Record, cycles: list[list[slice]]) -> list[_Deviations]:
    """Deviations of cycles that repeat each other from their mean, by branch; empty where none do."""
    out = []
    for repeats in zip(*cycles, strict=True) if len(cycles) > 1 else ():
        grid, angles, factors = _at_equal_drive(record, repeats)
        if grid.size == 0:
            continue
        first = record.drive[repeats[0]]
        drives = grid if first[-1] >= first[0] else -grid
        mean = angles.mean(axis=0)
        slope = np.gradient(mean, drives) if grid.size > 1 else np.zeros(1)
        out.append(_Deviations(drives, angles - mean, slope, factors))
    return out


def _leap_of(parts: list[_Deviations]) -> Leap | None:
    deviation = np.concatenate([part.deviation for part in parts], axis=1)
    return find_leap(deviation, np.concatenate([part.slope for part in parts]))


def _repeats(record: Record) -> list[list[slice]]:
    """Return the branches, as slices of the record, of the cycles that have the same turning points."""
    cycles = []
    for number, s in cycle_slices(record.drive, cycle_index(record)):
        if number != 0:
            pieces = branches(record.drive[s])
            cycles.append([slice(s.start + b.start, s.start + b.stop) for b in pieces])
    if not cycles:
        return []
    usual = Counter(len(cycle) for cycle in cycles).most_common(1)[0][0]
    cycles = [cycle for cycle in cycles if len(cycle) == usual]
    ends = np.array([[record.drive[c[0].start], *(record.drive[b.stop - 1] for b in c)] for c in cycles])
    tolerance = _CLOSED * np.ptp(ends, axis=1)
    one = np.unique(np.linspace(0, len(ends) - 1, min(len(ends), _COMPARED)).astype(np.int64))
    gap = np.max(np.abs(ends[one, None] - ends[None]), axis=2)  # of each pair of cycles; of many, some with all
    same = gap <= np.minimum(tolerance[one, None], tolerance[None])
    largest = same[np.argmax(same.sum(axis=1))]
    return [cycle for cycle, repeats in zip(cycles, largest, strict=True) if repeats]


def _from_one_state(record: Record, cycles: list[list[slice]]) -> list[list[slice]]:
    """Leave out a first stroke that starts from another state than the same branch of later cycles.

    The state at the first sample of a record is that of rest, or unknown. By how much the first cycle differs from the
    mean of the others is compared between its first stroke and its other strokes: what changes from cycle to cycle
    changes both, and noise differs by an F test. Of two cycles the branch is left out, of more the first cycle.
    """
    if len(cycles) < 2 or len(cycles[0]) < 2 or cycles[0][0].start > 0:
        return cycles
    first, *others = (_contrast(record, repeats) for repeats in zip(*cycles, strict=True))
    samples, squares, variances = (sum(parts) for parts in zip(*others, strict=True))
    if not first.samples or not samples:
        return cycles
    most = float(fdtri(first.samples, samples, _SAME_STATE)) * squares / variances
    if first.squares / first.variances <= most:
        return cycles
    return cycles[1:] if len(cycles) > 2 else [cycle[1:] for cycle in cycles]


class _Contrast(NamedTuple):
    """Squared differences of the first cycle from the mean of the others on one branch, and those of noise of 1."""

    samples: int
    squares: float
    variances: float


def _contrast(record: Record, repeats: Sequence[slice]) -> _Contrast:
    grid, angles, factors = _at_equal_drive(record, repeats)
    difference = angles[0] - angles[1:].mean(axis=0)
    variance = factors[0] + factors[1:].mean(axis=0) / (len(repeats) - 1)
    return _Contrast(grid.size, float(difference @ difference), float(variance.sum()))


def _spread(record: Record, cycles: list[list[slice]]) -> float:
    squares = variance = 0.0
    for repeats in zip(*cycles, strict=True):
        grid, angles, factors = _at_equal_drive(record, repeats)
        if grid.size == 0:
            continue
        deviation = angles - np.mean(angles, axis=0)
        squares += float(np.sum(deviation**2))
        variance += float(np.sum(factors)) * (1 - 1 / len(repeats))
    return float(np.sqrt(squares / variance)) if variance > 0 else _local_noise(record.drive, record.angle_deg)


def _at_equal_drive(record: Record, repeats: Sequence[slice]) -> tuple[Floats, Floats, Floats]:
    """Drives of the first of several branches (g,), and all their angles there with the factors of noise, (K, g)."""
    runs = [_monotone(record.drive[s], record.angle_deg[s]) for s in repeats]
    low, high = max(x[0] for x, _ in runs), min(x[-1] for x, _ in runs)
    grid = runs[0][0][(runs[0][0] >= low) & (runs[0][0] <= high)]
    angles, factors = zip(*(_interpolate(grid, x, y) for x, y in runs), strict=True)
    return grid, np.array(angles), np.array(factors)


def _monotone(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Keep the samples of one branch that are beyond all previous ones; the drive is returned as increasing."""
    x = x if x[-1] >= x[0] else -x
    further = np.concatenate([[True], x[1:] > np.maximum.accumulate(x)[:-1]])
    return x[further], y[further]


def _interpolate(grid: Floats, x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """Interpolate linearly; also return the variance of the result for noise of variance 1 in y."""
    if x.size == 1:
        return np.full(grid.shape, y[0]), np.ones(grid.shape)
    i = np.clip(np.searchsorted(x, grid, side="right") - 1, 0, x.size - 2)
    w = (grid - x[i]) / (x[i + 1] - x[i])
    return (1 - w) * y[i] + w * y[i + 1], (1 - w) ** 2 + w**2


def _local_noise(drive: Floats, angle_deg: Floats) -> float:
    if drive.size < 3:
        raise ValueError(f"drive: {drive.size} samples: expected at least 3")
    step = np.abs(np.diff(drive))
    before, both = step[:-1], step[:-1] + step[1:]
    w = np.divide(before, both, out=np.full(both.shape, 0.5), where=both > 0)
    second = angle_deg[1:-1] - (1 - w) * angle_deg[:-2] - w * angle_deg[2:]  # evenly spaced: half a 2nd difference
    return float(1.4826 * np.median(np.abs(second) / np.sqrt(1 + (1 - w) ** 2 + w**2)))

"""Identification of the improved Bouc-Wen law (paper, eq. 6-7) on one record: ``fit = identify(record, base)``."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import PchipInterpolator

from hysteresis import search
from hysteresis.backbone import Backbone, Kinematics, fitted_backbone, given_backbone
from hysteresis.bouc_wen import BoucWen, hysteresis
from hysteresis.holdout import Split, hold_out, validate_within
from hysteresis.metrics import Errors, errors, noise_floor
from hysteresis.path import require_reversal
from hysteresis.record import Record, RecordError
from hysteresis.search import Fitness, Point, Samples
from hysteresis.uncertainty import Parameter, Uncertainty, parameters_of, uncertainty

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
Label = Literal["analytic", "chain", "fitted", "theory"]
Genetic = Callable[[Samples, Backbone], tuple[list[Point], int]]

_KNOTS = (1, 2, 3, 5, 9, 17)  # numbers of slopes that a fitted f is tried with
_SEARCH_KNOTS = 9  # number of slopes during the genetic search
_SEARCH_SAMPLES = 400
_POLISH_SAMPLES = 2500
_AS_GOOD = 1.05  # a curve with fewer knots is taken when its validation error is within this factor of the best
_NEAR = 1.5  # ends of a polish with an error within this factor of the best are followed up
_NO_HYSTERESIS = "no hysteresis above the noise in this record"
_STANDSTILL = -1.1  # A; -1 is a play, some more is within what steps of the drive can tell
_ILL_CONDITIONED = 1e4
_SATURATED = 0.95  # of the saturation
_SUSPECT = 2.0  # held-out error in training errors
_ROUNDING = 1e-9  # of the angle's range; errors below it are those of the arithmetic


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of :func:`identify`: theta = f(x) + h, what it gets right, and what to beware of.

    ``parameters`` holds A, beta, gamma, n, h0_deg and, for given kinematics, what was free in them; ``baseline_*``
    are the errors of :meth:`plain`, the best single-valued f of the same freedom, fitted to the same samples. A record
    whose samples are met as well without hysteresis has A = 0, h = 0 and f = plain. ``heldout_mask``, shape (m,),
    marks the samples of the record that were hidden from the fit.
    """

    record: str
    kinematics: Label
    model: BoucWen
    parameters: dict[str, Parameter]
    saturation_deg: Parameter
    train: Errors
    heldout: Errors
    baseline_train: Errors
    baseline_heldout: Errors
    heldout_by: str
    noise_floor_deg: float
    evaluations: int
    seconds: float
    seed: int
    warnings: tuple[str, ...]
    backbone: Backbone
    coefficients: Floats  # of the backbone, shape (p,)
    plain_coefficients: Floats  # without hysteresis, shape (p,)
    heldout_mask: Mask
    drive_range: tuple[float, float]  # of the record

    def f(self, drive: ArrayLike) -> Floats:
        """Single-valued part of the angle, shape (m,) -> (m,), deg."""
        return self.backbone.at(np.asarray(drive, dtype=float))(self.coefficients)

    def plain(self, drive: ArrayLike) -> Floats:
        """Angle of the best curve without hysteresis, the baseline, shape (m,) -> (m,), deg."""
        return self.backbone.at(np.asarray(drive, dtype=float))(self.plain_coefficients)

    def predict(self, drive: ArrayLike) -> Floats:
        """Angle along a path of the drive, shape (m,) -> (m,), deg; it starts in the state h0_deg."""
        f = self.f(drive)
        return f + hysteresis(f, self.model)

    def to_dict(self) -> dict[str, Any]:
        """Give the contents of identify.json (docs/identification.md)."""
        places = np.linspace(*self.drive_range, 65)
        return {
            "schema": 1,
            "records": [self.record],
            "kinematics": self.kinematics,
            "model": "bouc-wen",
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "train": self.train.to_dict(),
            "heldout": self.heldout.to_dict(),
            "evaluations": self.evaluations,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
            "baseline": {"train": self.baseline_train.to_dict(), "heldout": self.baseline_heldout.to_dict()},
            "heldout_by": self.heldout_by,
            "noise_floor_deg": self.noise_floor_deg,
            "saturation_deg": self.saturation_deg.to_dict(),
            "f": {"drive": places.tolist(), "angle_deg": self.f(places).tolist()},
            "seed": self.seed,
        }

    def __str__(self) -> str:
        lines = [f"Bouc-Wen on {self.record}, kinematics {self.kinematics}"]
        lines += [f"  {name:<12} {parameter}" for name, parameter in self.parameters.items()]
        lines += [f"  {'saturation':<12} {self.saturation_deg}"]
        pairs = (("train", self.train, self.baseline_train), ("held out", self.heldout, self.baseline_heldout))
        for name, mine, plain in pairs:
            lines.append(
                f"  {name:<12} {mine.rmse_deg:.3g} deg rmse, {mine.max_abs_deg:.3g} deg at most; "
                f"without hysteresis {plain.rmse_deg:.3g} deg rmse"
            )
        lines += [f"  held out by  {self.heldout_by}", f"  noise floor  {self.noise_floor_deg:.2g} deg"]
        return "\n".join([*lines, *(f"  warning: {text}" for text in self.warnings)])


def identify(
    record: Record,
    base: Kinematics | None = None,
    *,
    kinematics: Literal["analytic", "chain"] = "analytic",
    fitness: Fitness = "rmse",
    seed: int = 0,
    population: int = 100,
    generations: int = 90,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Identify A, beta, gamma, n and the initial state of the improved Bouc-Wen law on a record.

    Parameters
    ----------
    record
        A loop: the drive must go there and back.
    base
        The kinematics f, drive in mm -> angle in deg, shape (m,) -> (m,). Its zero is free, and for a drive that is
        not in mm also the gain. Without it the record's own theory is taken, and without that f is fitted to the
        data: monotone, its slope given at a number of knots that is chosen within the training data.
    kinematics
        Name of ``base`` in the result.
    fitness
        ``"rmse"``: root mean square error, and a least-squares polish of all unknowns together.
        ``"paper-signed-mean"``: eq. 8 of the paper, a mean in which errors cancel; for comparison, no polish.
    seed
        Of the genetic search; the same seed gives the same fit.
    population, generations
        Of the genetic search: individuals, at least 8; generations, at least 3.
    progress
        Called with (generations done, generations in all).

    Raises
    ------
    RecordError
        A record that never reverses, has too few samples, an angle that never changes, or leaves its own theory.
    ValueError
        An unknown fitness, too small a search, or kinematics that give no finite angle.
    """
    began = time.perf_counter()
    require_reversal(record)
    _require_usable(record, fitness, population, generations)
    done = count(1)  # generations

    def tick() -> None:
        if progress is not None:
            progress(next(done), generations)

    genetic = partial(
        search.genetic, fitness=fitness, seed=seed, population=population, generations=generations, tick=tick
    )
    split = hold_out(record)
    base, label = _kinematics(record, base, kinematics)
    backbone, point, evaluations = _find(record, split, base, fitness, genetic)
    facts = {"kinematics": label, "evaluations": evaluations, "seed": seed, "seconds": time.perf_counter() - began}
    return _judge(record, split, backbone, point, intervals=fitness == "rmse", **facts)


def _require_usable(record: Record, fitness: str, population: int, generations: int) -> None:
    if np.ptp(record.angle_deg) == 0:
        name = record.source or "record"
        raise RecordError(f"{name}: angle = {record.angle_deg[0]:g} throughout: expected an angle that changes")
    if fitness not in ("rmse", "paper-signed-mean"):
        raise ValueError(f"fitness = {fitness!r}: expected 'rmse' or 'paper-signed-mean'")
    for name, value, least in (("population", population, 8), ("generations", generations, 3)):
        if value < least:
            raise ValueError(f"{name} = {value}: expected at least {least}")


def _kinematics(record: Record, base: Kinematics | None, label: Label) -> tuple[Kinematics | None, Label]:
    """Take the caller's kinematics, else the record's theory, else none."""
    if base is not None:
        _require_finite(base, record)
        return base, label
    return (None, "fitted") if record.kinematics is None else (_theory(record), "theory")


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


def _curve(record: Record, split: Split, knots: int) -> Backbone:
    return fitted_backbone(record.drive[split.train], record.angle_deg[split.train], knots)


def _find(
    record: Record, split: Split, base: Kinematics | None, fitness: Fitness, genetic: Genetic
) -> tuple[Backbone, Point, int]:
    """Find the form of f and the parameters of h, or that there is no h; also the evaluations it took."""
    samples = Samples(record.drive, record.angle_deg, split.train)
    if base is None and fitness == "rmse":
        backbone, point, evaluations = _choose_curve(record, split, genetic)
    else:
        if base is None:
            backbone = _curve(record, split, _SEARCH_KNOTS)
        else:
            seen = split.train
            backbone = given_backbone(base, record.drive[seen], record.angle_deg[seen], record.drive_unit)
        points, evaluations = _search(samples.thinned(_SEARCH_SAMPLES), backbone, genetic, fitness)
        point = points[0]
    if fitness != "rmse":
        return backbone, point, evaluations
    plain = search.plain(backbone, samples)
    if point.sign == 0:
        return backbone, plain, evaluations
    fine = samples.thinned(_POLISH_SAMPLES)
    point, calls = search.polish(fine, backbone, point)
    return backbone, point if _earns_its_place(fine, backbone, point, plain) else plain, evaluations + calls


def _earns_its_place(samples: Samples, backbone: Backbone, point: Point, plain: Point) -> bool:
    """Tell whether h lowers the training error by more than five more parameters do by fitting noise.

    That is m log(sum of squares) + 5 log m (Schwarz 1978, doi 10.1214/aos/1176344136), and a gain that matters.
    """
    m = int(samples.seen.sum())
    without = search.rmse(samples, backbone, plain)
    gain = min(1 / _AS_GOOD, m ** (-2.5 / m))
    return without > _rounding(samples) and search.rmse(samples, backbone, point) < gain * without


def _rounding(samples: Samples) -> float:
    return _ROUNDING * float(np.ptp(samples.angle_deg[samples.seen]))


def _search(samples: Samples, backbone: Backbone, genetic: Genetic, fitness: Fitness) -> tuple[list[Point], int]:
    """Search on few samples and polish what it found: those about as good as the best, which comes first."""
    points, evaluations = genetic(samples, backbone)
    if fitness != "rmse":
        return points[:1], evaluations
    ends, calls = _polish_all(samples, backbone, points)
    return ends, evaluations + calls


def _polish_all(samples: Samples, backbone: Backbone, points: list[Point]) -> tuple[list[Point], int]:
    polished = [search.polish(samples, backbone, point) for point in points]
    ends = sorted(((search.rmse(samples, backbone, point), point) for point, _ in polished), key=lambda end: end[0])
    near = [point for error, point in ends if error <= _NEAR * ends[0][0]]
    return near, sum(calls for _, calls in polished)


def _choose_curve(record: Record, split: Split, genetic: Genetic) -> tuple[Backbone, Point, int]:
    """Choose the number of knots of a fitted f, and between optima, by validation inside the training samples.

    The simplest that is as good as the best: curves without hysteresis first, then those with.
    """
    inner = validate_within(record, split)
    few = Samples(record.drive, record.angle_deg, inner.train).thinned(_SEARCH_SAMPLES)
    judge = Samples(record.drive, record.angle_deg, inner.heldout).thinned(_POLISH_SAMPLES)
    affordable = [knots for knots in _KNOTS if 3 * (knots + 6) <= few.seen.sum()] or [1]
    first = _curve(record, split, min(_SEARCH_KNOTS, affordable[-1]))
    starts, evaluations = _search(few, first, genetic, "rmse")
    backbones = [_curve(record, split, knots) for knots in affordable]
    plains = [(backbone, search.plain(backbone, few)) for backbone in backbones]
    tried = [(search.rmse(judge, backbone, plain), backbone, plain) for backbone, plain in plains]
    for backbone in backbones:
        moved = [search.with_curve_of(backbone, few, first, start) for start in starts]
        ends, calls = _polish_all(few, backbone, moved)
        evaluations += calls
        error, end = min(((search.rmse(judge, backbone, end), end) for end in ends), key=lambda pair: pair[0])
        tried.append((error, backbone, end))
    limit = max(_AS_GOOD * min(error for error, _, _ in tried), _rounding(few))
    _, backbone, point = next(entry for entry in tried if entry[0] <= limit)
    return backbone, point, evaluations


def _judge(
    record: Record, split: Split, backbone: Backbone, point: Point, *, intervals: bool, **search_facts: Any
) -> Fit:
    """Errors on both parts of the record, those of the best curve without hysteresis, intervals and warnings."""
    samples = Samples(record.drive, record.angle_deg, split.train)
    plain, fine = search.plain(backbone, samples), samples.thinned(_POLISH_SAMPLES)
    spread = uncertainty(fine, backbone, point) if intervals else None
    train, heldout, baseline_train, baseline_heldout = (
        errors(record.angle_deg[mask], angle[mask])
        for angle in (point.angle(backbone, record.drive), plain.angle(backbone, record.drive))
        for mask in (split.train, split.heldout)
    )
    parameters = parameters_of(fine, backbone, point, spread)
    saturation = parameters.pop("saturation_deg")
    if search_facts["kinematics"] == "fitted":  # its coefficients say nothing by themselves; f is given as a table
        parameters = {name: value for name, value in parameters.items() if name not in backbone.names}
    of_law = _law_warnings(fine, backbone, point, spread) if point.sign else [_NO_HYSTERESIS]
    of_errors = _error_warnings(fine, point, train, heldout, baseline_heldout)
    return Fit(
        record=record.source or record.title or "record",
        model=point.model,
        parameters=parameters,
        saturation_deg=saturation,
        train=train,
        heldout=heldout,
        baseline_train=baseline_train,
        baseline_heldout=baseline_heldout,
        heldout_by=split.by,
        noise_floor_deg=noise_floor(record),
        warnings=(*of_law, *of_errors),
        backbone=backbone,
        coefficients=point.c,
        plain_coefficients=plain.c,
        heldout_mask=split.heldout,
        drive_range=(float(record.drive.min()), float(record.drive.max())),
        **search_facts,
    )


def _law_warnings(fine: Samples, backbone: Backbone, point: Point, spread: Uncertainty | None) -> Iterator[str]:
    low, high = search.box(fine)
    for name, value, a, b in list(zip(search.COORDINATES, point.q, low, high, strict=True))[:-1]:
        end = a if value - a < 1e-3 * (b - a) else b if b - value < 1e-3 * (b - a) else None
        if end is not None:
            limit = end if name == "gamma / beta" else math.exp(end)
            yield f"{'|A|' if name == 'A' else name} is at the bound of the search, {limit:.3g}"
    if point.model.A < _STANDSTILL:
        yield f"A = {point.model.A:.3g} is below -1: the predicted angle runs on after the drive has turned"
    if spread is None:
        yield "eq. 8 is a mean in which errors cancel: it does not determine the parameters, and gives no intervals"
    elif spread.blind[:5].any():
        names = [name for name, blind in zip(search.COORDINATES, spread.blind[:5], strict=True) if blind]
        yield f"the record does not show {', '.join(names)}: no interval"
    elif spread.condition > _ILL_CONDITIONED:
        yield (
            f"parameters make good for each other (condition number {spread.condition:.1e}): "
            "judge by the errors, not by single parameters"
        )
    reached = float(np.abs(hysteresis(backbone.at(fine.drive)(point.c), point.model)).max())
    if reached < _SATURATED * point.model.saturation_deg:
        yield (
            f"h reaches {reached:.3g} deg of a saturation of {point.model.saturation_deg:.3g} deg: "
            "the record does not show the saturation"
        )
    if point.sign > 0:
        yield "A > 0: h leads f, the loop runs the other way round than a lagging one"


def _error_warnings(fine: Samples, point: Point, train: Errors, heldout: Errors, baseline: Errors) -> Iterator[str]:
    if heldout.rmse_deg > max(_SUSPECT * train.rmse_deg, _rounding(fine)):
        yield f"held-out rmse is {heldout.rmse_deg:.3g} deg, that of training {train.rmse_deg:.3g} deg"
    if point.sign and heldout.rmse_deg >= baseline.rmse_deg:
        yield "no better than a curve without hysteresis on what was held out"

"""Identification of the improved Bouc-Wen law (paper, eq. 6-7) on records: ``fit = identify(record, base)``."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
from scipy.interpolate import PchipInterpolator

from hysteresis.fitting.fit import Fit, KinematicsLabel
from hysteresis.fitting.form import Form, rmse
from hysteresis.fitting.judgement import judge
from hysteresis.fitting.law_choice import choose_law, fit_laws, searches
from hysteresis.fitting.model_choice import find_model
from hysteresis.fitting.samples import join
from hysteresis.fitting.search import Effort, Found
from hysteresis.fitting.settings import DEFAULTS, IdentifySettings
from hysteresis.laws.backbone import Kinematics
from hysteresis.laws.elements import LAWS, Place
from hysteresis.records.folds import without_first_stroke
from hysteresis.records.holdout import Split, hold_out
from hysteresis.records.path import require_reversal
from hysteresis.records.record import Record, RecordError
from hysteresis.records.thinning import thinned
from hysteresis.sensors.readings import cleaned, sensor_notes

_LONGEST_DELAY = 0.02  # of the shortest record
_COST = 1.25  # first strokes are left out if, with them, the error in the other samples is larger by this factor


def identify(
    record: Record | Sequence[Record],
    base: Kinematics | Sequence[Kinematics] | None = None,
    *,
    kinematics: KinematicsLabel = "analytic",
    settings: IdentifySettings = DEFAULTS,
    amplitude_by: Sequence[object] | None = None,
    splits: Sequence[Split] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Fit:
    """Identify A, beta, gamma, n and the initial state of the improved Bouc-Wen law, and another law, if asked.

    Parameters
    ----------
    record
        A loop: the drive must reverse. Several records are fitted jointly: they share f and the parameters of h; each
        has its own initial state and its own zero of the angle.
    base
        The kinematics f, drive in mm -> angle in deg, shape (m,) -> (m,), for all records or one for each. Its zero
        is fitted, and for a drive that is not in mm also the gain. Without ``base`` the record's own theory is used,
        and without that f is fitted to the data: monotone, with slopes at knots whose number is chosen within the
        training data.
    kinematics
        Name of ``base`` in the result.
    settings
        Of the search and of the model.
    amplitude_by
        A label for each record: the amplitude of h is fitted for each label after the first. By default the preload,
        if all records have one.
    splits
        Training and held-out samples of each record; by default :func:`hysteresis.records.holdout.hold_out`, trained
        without a first stroke that spoils the fit (:func:`hysteresis.records.folds.without_first_stroke`).
    progress
        Called with (generations done, generations in all).

    Raises
    ------
    RecordError
        A record that never reverses, has too few samples, an angle that never changes, or leaves its own theory;
        records of different drive units; a delay without times.
    ValueError
        No record, kinematics without finite angles, or labels that do not match the records.
    """
    began, words = time.perf_counter(), list[str]()
    given = [record] if isinstance(record, Record) else record
    records = _require_usable([thinned(one) if splits is None else one for one in given], settings.delay)
    bases, label = _kinematics(records, base, kinematics)
    longest = _longest_delay(records) if settings.delay else 0.0
    records, whole, spoiled = _readings(records, splits or [hold_out(one) for one in records])
    shorter = whole if splits is not None else _without_first_strokes(records, whole, words)
    form = Form((), 1, _groups(records, amplitude_by), longest, place=_place(records, whole), forward=settings.forward)
    efforts = _efforts(settings, progress, 1 + bool(words) + searches(settings.law))
    found, used = find_model(records, whole, bases, form, efforts, settings.elements), whole
    if words:
        other = find_model(records, shorter, bases, form, efforts, settings.elements)
        found, used = (other, shorter) if _costs(records, shorter, found, other) else (found, whole)
    fit = replace(judge(records, used, found, settings, label), notes=(*spoiled, *(words if used is shorter else ())))
    if settings.law != "bouc-wen" and found.point.sign:
        fit = _with_law(records, used, bases, (fit, found), efforts)
    return replace(fit, seconds=time.perf_counter() - began)


def _with_law(
    records: Sequence[Record],
    splits: Sequence[Split],
    bases: Sequence[Kinematics] | None,
    bouc_wen: tuple[Fit, Found],
    efforts: Sequence[Effort],
) -> Fit:
    """Fit the law that the settings name, or choose one; ``bouc_wen`` is the fit that accompanies it."""
    fit, found = bouc_wen
    wanted = None if fit.settings.law == "auto" else fit.settings.law
    laws = fit_laws(records, splits, bases, found, efforts, wanted)
    choice = None
    if wanted is None:
        choice = choose_law(records, splits, laws)
        one = choice.chosen.found
    else:
        one = laws.get(LAWS[wanted].title, found)
    if one is found:
        return replace(fit, choice=choice)
    judged = judge(records, splits, one, fit.settings, fit.kinematics)
    return replace(judged, choice=choice, bouc_wen=fit, notes=fit.notes)


def _readings(
    records: Sequence[Record], splits: Sequence[Split]
) -> tuple[list[Record], list[Split], tuple[str, ...]]:  # fmt: skip
    """Take what sensors added out of records, and samples that are no readings out of their splits.

    The words say that, and first what was left out of a long record.
    """
    sensed = [cleaned(one, _seen(split)) for one, split in zip(records, splits, strict=True)]
    read = [split.only(one.read) for split, one in zip(splits, sensed, strict=True)]
    left_out = (one.left_out for one in records if one.left_out)
    return [one.record for one in sensed], read, (*left_out, *sensor_notes(sensed))


def _seen(split: Split) -> int:
    """Count the samples before the first one that is held out: nothing behind it may change what is fitted."""
    return int(split.heldout.argmax()) if split.heldout.any() else split.heldout.size


def _place(records: Sequence[Record], splits: Sequence[Split]) -> Place:
    """Return the centre and half the range of the training angles."""
    angle = np.concatenate([record.angle_deg[split.train] for record, split in zip(records, splits, strict=True)])
    low, high = float(angle.min()), float(angle.max())
    return Place(0.5 * (low + high), max(0.5 * (high - low), 1e-9))


def _without_first_strokes(records: Sequence[Record], splits: Sequence[Split], words: list[str]) -> list[Split]:
    """Leave first strokes that differ out of the training samples; ``words`` takes a word on each."""
    shorter = []
    for record, split in zip(records, splits, strict=True):
        one, word = without_first_stroke(record, split)
        shorter.append(one)
        if word is not None:
            words.append(f"{Path(record.source).name}: {word}" if record.source and len(records) > 1 else word)
    return shorter


def _costs(records: Sequence[Record], splits: Sequence[Split], kept: Found, left_out: Found) -> bool:
    """Tell whether a fit with the first strokes has a much larger error in the other training samples."""
    samples = join(records, [split.train for split in splits], timed=kept.form.longest_delay_s > 0)
    return rmse(samples, kept.form, kept.point) > _COST * rmse(samples, left_out.form, left_out.point)


# --- checks of the input -----------------------------------------------------------------------------------------


def _require_usable(records: list[Record], delay: bool) -> list[Record]:
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
    return records


def _efforts(settings: IdentifySettings, progress: Callable[[int, int], None] | None, searched: int) -> list[Effort]:
    """One effort for each seed; all count generations together, over ``searched`` searches."""
    s, done = settings, count(1)

    def tick() -> None:
        if progress is not None:
            progress(next(done), s.generations * s.seeds * searched)

    return [Effort(s.method, s.fitness, s.seed + i, s.population, s.generations, tick) for i in range(s.seeds)]


def _groups(records: Sequence[Record], labels: Sequence[object] | None) -> tuple[int, ...]:
    """Group of each record, by label in order of appearance; one group for all if some have no label."""
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
    records: Sequence[Record], base: Kinematics | Sequence[Kinematics] | None, label: KinematicsLabel
) -> tuple[list[Kinematics] | None, KinematicsLabel]:
    """Use the caller's kinematics, else the records' own theory, else none: f is then fitted."""
    if base is not None:
        bases = [base] * len(records) if callable(base) else list(base)
        for kinematics, record in zip(bases, records, strict=True):
            _require_finite(kinematics, record)
        return bases, label
    if any(record.kinematics is None for record in records):
        return None, "fitted"
    return [_theory(record) for record in records], "theory"


def _theory(record: Record) -> Kinematics:
    """Interpolate the record's own theory; it is constant beyond its ends."""
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
        return  # the drive is scaled before the kinematics are evaluated
    angle = np.asarray(base(record.drive), dtype=float)
    if angle.shape != record.drive.shape or not np.isfinite(angle).all():
        raise ValueError(f"base: shape {angle.shape}: expected {record.drive.shape} finite angles for the drive")

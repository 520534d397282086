"""The still zone after reversals, on loops by stop operators behind a play, behind friction, and without either."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from hysteresis.arrays import Floats
from hysteresis.records.record import Record
from validation.tracing import cross_validated
from validation.tracing.cross_validated import PlayBaselines, play_baselines, trace_by_folds
from validation.tracing.effect import catalogue
from validation.tracing.next_experiment import PLAY_OR_FRICTION, next_experiment
from validation.tracing.result import in_words, trace_report
from validation.tracing.search.still_zone import StillZone, find_still_zone
from validation.tracing.settings import STILL_AS_GOOD

WIDTH_MM = 0.3
BACKLASH = [effect for effect in catalogue() if effect.name == "backlash"]


@pytest.fixture(autouse=True)
def one_blas_thread() -> Iterator[None]:
    with threadpool_limits(1, user_api="blas"):
        yield


def stops(drive: Floats) -> Floats:
    """Angle of a rig that moves at once: a spring beside stop operators (Iwan 1966)."""
    out = 9.0 * drive - 0.25 * drive**3
    for limit in (0.13, 0.37, 0.6, 0.9):
        s, last, row = 0.0, drive[0], np.empty(drive.size)
        for i, x in enumerate(drive):
            s = min(limit, max(-limit, s + x - last))
            last, row[i] = x, s
        out = out - 0.5 * row
    return out


def play(drive: Floats, width: float) -> Floats:
    """Drive behind a play, case by case."""
    out, p = np.empty(drive.size), drive[0]
    for i, x in enumerate(drive):
        p = max(x - width / 2, min(x + width / 2, p))
        out[i] = p
    return out


def behind_friction(drive: Floats, force_N: float, stiffness_N_per_mm: float) -> Floats:
    """End of an elastic tendon that rubs: it moves where the tendon pulls by more than the friction."""
    end, out = drive[0], np.empty(drive.size)
    for i, x in enumerate(drive):
        pull = stiffness_N_per_mm * (x - end)
        if abs(pull) > force_N:
            end = x - np.sign(pull) * force_N / stiffness_N_per_mm
        out[i] = end
    return out


def records(before: Callable[[Floats], Floats], ripple_deg: float = 0.25, *, samples: int = 45) -> list[Record]:
    """Three records of decaying amplitude, of so many samples a cycle.

    A ripple of the drive, which no model has, stays unexplained.
    """
    out = []
    for seed, rate in enumerate((0.1, 0.2, 0.4)):
        time = np.arange(0.0, 5 / rate, 1 / (samples * rate))
        drive = 2.0 * np.exp(-0.12 * time * rate) * np.sin(2 * np.pi * rate * time)
        noise = 0.02 * np.random.default_rng(seed).normal(size=time.size)
        angle = stops(before(drive)) + ripple_deg * np.sin(2 * np.pi * drive / 0.45) + noise
        out.append(Record(drive=drive, angle_deg=angle, drive_unit="mm", time_s=time, source=f"{rate} Hz"))
    return out


def zone_of(given: list[Record]) -> tuple[PlayBaselines, StillZone | None]:
    plays = play_baselines(given)
    assert plays is not None
    return plays, find_still_zone(plays.fits.best(plays.fitted), BACKLASH, plays.fits)


@pytest.fixture(scope="module")
def behind_a_play() -> tuple[PlayBaselines, StillZone | None]:
    return zone_of(records(lambda drive: play(drive, WIDTH_MM), 0.0))


def test_a_play_that_play_operators_absorb_is_found_with_its_width(behind_a_play) -> None:
    _, zone = behind_a_play
    assert zone is not None
    assert zone.width == pytest.approx(WIDTH_MM, rel=0.1)
    assert zone.refuted_deg > 1.5 * zone.fitted.heldout_rmse_deg


def test_friction_before_an_elastic_tendon_reads_the_same() -> None:
    """The width is 2 F / k; one more reason that the name is never alone."""
    drive = records(lambda x: x)[0].drive
    assert behind_friction(drive, 0.6, 4.0) == pytest.approx(play(drive, 2 * 0.6 / 4.0), abs=1e-12)


@pytest.mark.parametrize("ripple_deg", [0.0, 0.25])
def test_a_rig_that_moves_at_once_has_no_still_zone(ripple_deg: float) -> None:
    assert zone_of(records(lambda drive: drive, ripple_deg))[1] is None


def test_a_rig_that_moves_by_a_part_at_once_has_none() -> None:
    """A third of the slope is left within the width: softer, not still."""
    assert zone_of(records(lambda drive: drive / 3 + 2 * play(drive, WIDTH_MM) / 3, 0.0))[1] is None


@pytest.mark.slow
def test_records_with_a_still_zone_are_traced_to_play_or_friction() -> None:
    plays, _ = zone_of(records(lambda drive: play(drive, WIDTH_MM), samples=90))
    trace = trace_by_folds(plays, BACKLASH, lambda *_: None)
    assert (trace.verdict, trace.names, trace.confusable) == ("partial", ("backlash",), (("guide_friction",),))
    report = trace_report(trace)
    assert report.effects[0].parameters["width_mm"].value == pytest.approx(WIDTH_MM, rel=0.25)
    assert report.after.heldout.rmse_deg <= STILL_AS_GOOD * report.before.heldout.rmse_deg
    words = " ".join(in_words(report))
    assert "stands still for 0." in words
    assert "mm of the drive" in words
    assert next_experiment(trace).words == PLAY_OR_FRICTION
    assert "the still zone is an exception: its width was found on all samples" in report.heldout_by
    without = trace_by_folds(plays, BACKLASH, lambda *_: None, still=False)
    assert "still zone" not in trace_report(without).heldout_by
    assert (without.verdict, without.names) == ("unexplained", ())
    assert next_experiment(without).words != PLAY_OR_FRICTION


@pytest.mark.parametrize("verdict", ["none", "effect", "ambiguous"])
def test_records_that_lack_nothing_more_are_not_searched(verdict: str, behind_a_play, monkeypatch) -> None:
    """A play is then a part of the loops that the baseline has."""
    plays, zone = behind_a_play
    assert zone is not None
    judge = cross_validated.judge_by_folds

    def judged(*some, **more):
        return replace(judge(*some, **more), verdict=verdict)

    monkeypatch.setattr(cross_validated, "judge_by_folds", judged)
    monkeypatch.setattr(cross_validated, "find_still_zone", lambda *some: pytest.fail("searched"))
    assert trace_by_folds(plays, [], lambda *_: None).verdict == verdict

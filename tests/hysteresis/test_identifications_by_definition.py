"""Judgement of a fit, and a whole identification, by their definitions."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_loops import LOOP, line

from hysteresis.fitting import identification, judgement
from hysteresis.fitting.fit import Fit
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import (
    Uncertainty,
)
from hysteresis.laws.elements import LAWS, Place, elements_of
from hysteresis.records.record import Record, RecordError

# --- judgement -----------------------------------------------------------------------------------------------------


def test_a_slope_of_a_play_and_slightly_more_is_no_overshoot():
    warned = lambda A, number=1: list(  # noqa: E731
        judgement._overshoot_warnings(
            SimpleNamespace(elements=number), SimpleNamespace(models=lambda form: [SimpleNamespace(A=A)] * number)
        )
    )
    assert warned(-1.5) == []
    assert [words.startswith("A = -1.6 is below -1.5") for words in warned(-1.6)] == [True]
    assert [words.split(" is ")[0] for words in warned(-1.6, 2)] == ["A = -1.6 of element 1", "A = -1.6 of element 2"]


@pytest.mark.parametrize(("amplitudes", "factor"), [((0.5,), 1.0), ((0.5, 3.0), 3.0), ((3.0, 0.5), 3.0), ((1.5,), 1.5)])
def test_a_saturation_is_that_of_the_group_of_the_largest_amplitude(amplitudes, factor):
    groups = tuple(range(len(amplitudes) + 1))
    for share, warned in ((0.949, True), (0.951, False)):
        form = SimpleNamespace(
            hysteresis=lambda *given, top=share * factor * 2.0: np.array([[0.5, -top]]), paths=lambda *given: [],
            groups=groups, amplitude=lambda group: 4 + group,
        )  # fmt: skip
        point = SimpleNamespace(
            sign=-1.0, q=np.append(np.zeros(5), np.log(amplitudes)),
            elements=lambda form: [SimpleNamespace(saturation_deg=1.5), SimpleNamespace(saturation_deg=0.5)],
        )  # fmt: skip
        assert bool(list(judgement._saturation_warnings(None, form, point))) is warned


def test_warnings_of_a_law_by_its_sign_its_kind_and_its_intervals(monkeypatch):
    monkeypatch.setattr(judgement, "_saturation_warnings", lambda *given: iter(["saturation"]))
    monkeypatch.setattr(judgement, "_overshoot_warnings", lambda *given: iter(["overshoot"]))
    words = lambda sign, law, spread: [  # noqa: E731
        text.split(" ")[0]
        for text in judgement._law_warnings(
            None, SimpleNamespace(base_law=LAWS[law]), SimpleNamespace(sign=sign), spread
        )
    ]
    assert words(-1.0, "bouc-wen", "spread") == ["overshoot", "saturation"]
    assert words(-1.0, "prandtl-ishlinskii", "spread") == ["saturation"]
    assert words(1.0, "bouc-wen", "spread") == ["overshoot", "saturation", "A"]
    assert words(-1.0, "bouc-wen", None) == ["eq.", "overshoot", "saturation"]


def test_correlations_are_those_of_each_pair_of_parameters_of_the_law():
    covariance = np.diag([4.0, 1.0, 9.0, 0.0, 1.0])
    covariance[0, 2] = covariance[2, 0] = -3.0
    covariance[0, 4] = covariance[4, 0] = 1.0  # of an initial state, which is not of the law
    found = judgement._correlations(Form(()), Uncertainty(covariance, 2.0, 1.0, np.zeros(5, dtype=bool), 9.0))
    assert found == {
        "A ~ saturation_deg": 0.0, "A ~ n": -0.5, "A ~ gamma / beta": 0.0, "saturation_deg ~ n": 0.0,
        "saturation_deg ~ gamma / beta": 0.0, "n ~ gamma / beta": 0.0,
    }  # fmt: skip


def test_a_held_out_error_of_two_training_errors_is_not_suspect():
    fine = SimpleNamespace(span_deg=lambda: 10.0)
    of = lambda error: SimpleNamespace(rmse_deg=error)  # noqa: E731
    warned = lambda train, heldout, plain, sign=-1.0: len(  # noqa: E731
        list(judgement._error_warnings(fine, SimpleNamespace(sign=sign), of(train), of(heldout), of(plain)))
    )
    assert (warned(0.25, 0.5, 0.75), warned(0.0, 1e-8, 0.75), warned(0.25, 0.5, 0.5)) == (0, 0, 1)
    assert (warned(0.25, 0.75, 0.5), warned(0.25, 0.75, 0.5, 0.0), warned(0.25, 0.75, 0.5, 1.0)) == (2, 1, 2)
    searches = lambda agreeing, seeds, sign: list(  # noqa: E731
        judgement._search_warnings(SimpleNamespace(sign=sign), seeds, agreeing)
    )
    assert searches(1, 2, -1.0) == searches(1, 1, -1.0) == searches(2, 3, -1.0) == []
    assert searches(1, 3, -1.0) == ["1 of 3 searches ended at the best: expected more than half"]


# --- the whole -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("law", "sign", "strokes", "costs"),
    [("bouc-wen", -1.0, False, False), ("auto", -1.0, False, False), ("auto", 0.0, False, False),
     ("bouc-wen", -1.0, True, True), ("bouc-wen", -1.0, True, False), ("prandtl-ishlinskii", 1.0, True, True)],
)  # fmt: skip
def test_an_identification_fits_another_law_only_where_there_is_hysteresis(monkeypatch, law, sign, strokes, costs):
    """With a first stroke that differs, both samples are fitted, and the shorter ones kept where the stroke costs."""
    asked, ticks = [], []
    record = Record(LOOP, 10 * LOOP + 0.1 * np.sign(np.gradient(LOOP)))
    whole, short = (
        SimpleNamespace(train=np.arange(LOOP.size) >= first, heldout=np.zeros(LOOP.size, bool)) for first in (0, 5)
    )
    whole.only = lambda read: whole
    monkeypatch.setattr(identification, "hold_out", lambda record: whole)
    monkeypatch.setattr(
        identification, "without_first_stroke", lambda *given: (short, "left out") if strokes else (whole, None)
    )

    def find(records, splits, bases, form, efforts, elements):
        asked.append("whole" if splits[0] is whole else "short")
        efforts[0].tick()
        return SimpleNamespace(point=SimpleNamespace(sign=sign), samples=asked[-1])

    monkeypatch.setattr(identification, "find_model", find)
    monkeypatch.setattr(identification, "_costs", lambda *given: costs)
    settings = IdentifySettings(law=law)

    def judge(records, used, found, settings, label):
        assert (used[0] is short) is (found.samples == "short")
        return made_fit(warnings=(found.samples,))

    monkeypatch.setattr(identification, "judge", judge)
    monkeypatch.setattr(identification, "_with_law", lambda *given: (asked.append("law"), given[3][0])[1])
    progress = lambda *both: ticks.append(both)  # noqa: E731
    fit = identification.identify(record, lambda x: 10 * x, settings=settings, progress=progress)
    assert asked == ["whole", *["short"] * strokes, *["law"] * (law != "bouc-wen" and sign != 0)]
    assert fit.notes == (("left out",) if costs else ())
    assert fit.warnings == ("short" if costs else "whole",)
    searches = 1 + strokes + {"auto": 2, "bouc-wen": 0, "prandtl-ishlinskii": 1}[law]
    assert ticks[-1] == (1 + strokes, settings.generations * searches)


def test_a_first_stroke_is_named_by_its_record_among_several(monkeypatch):
    splits = [SimpleNamespace(), SimpleNamespace()]
    monkeypatch.setattr(identification, "without_first_stroke", lambda record, split: (split, "left out"))
    records = [Record(LOOP, LOOP, source="folder/a.csv"), Record(LOOP, LOOP)]
    words = []
    assert identification._without_first_strokes(records, splits, words) == splits
    assert words == ["a.csv: left out", "left out"]
    words.clear()
    identification._without_first_strokes(records[:1], splits[:1], words)
    assert words == ["left out"]
    monkeypatch.setattr(identification, "without_first_stroke", lambda record, split: (split, None))
    words.clear()
    identification._without_first_strokes(records, splits, words)
    assert words == []


@pytest.mark.parametrize(("wanted", "kept"), [("auto", "chosen"), ("prandtl-ishlinskii", "Prandtl-Ishlinskii")])
def test_another_law_stands_beside_the_bouc_wen_fit_unless_that_is_the_one(monkeypatch, wanted, kept):
    first = made_fit(settings=IdentifySettings(law=wanted), notes=("a note",))
    laws = {"Bouc-Wen": "found", "Prandtl-Ishlinskii": "Prandtl-Ishlinskii"}
    monkeypatch.setattr(identification, "fit_laws", lambda *given: (asked.append(given[-1]), laws)[1])
    monkeypatch.setattr(identification, "judge", lambda records, splits, one, *more: made_fit(warnings=(one,)))
    for chosen in ("chosen", "found"):
        asked = []
        choice = SimpleNamespace(chosen=SimpleNamespace(found=chosen))
        monkeypatch.setattr(identification, "choose_law", lambda *given, choice=choice: choice)
        fit = identification._with_law([], [], None, (first, "found"), [])
        assert asked == [None if wanted == "auto" else wanted]
        assert fit.choice is (choice if wanted == "auto" else None)
        if wanted == "auto" and chosen == "found":
            assert (fit.bouc_wen, fit.warnings) == (None, ())
        else:
            assert (fit.bouc_wen, fit.notes, fit.warnings) == (first, ("a note",), (kept,))
    laws.pop("Prandtl-Ishlinskii")  # it was not fitted: the Bouc-Wen fit stays
    if wanted != "auto":
        assert identification._with_law([], [], None, (first, "found"), []).bouc_wen is None


def test_records_of_an_identification_agree_and_have_times_where_a_delay_is_fitted():
    timed = Record(LOOP, 10 * LOOP, time_s=np.arange(LOOP.size) * 1.0, source="a.csv")
    bare = Record(LOOP, 10 * LOOP)
    identification._require_usable([timed, bare], False)
    identification._require_usable([timed, timed], True)
    with pytest.raises(RecordError, match="time: missing"):
        identification._require_usable([timed, bare], True)
    with pytest.raises(RecordError, match=r"record: drive in step: expected mm"):
        identification._require_usable([timed, Record(LOOP, 10 * LOOP, drive_unit="step")], False)
    with pytest.raises(RecordError, match="angle = 3 throughout"):
        identification._require_usable([Record(LOOP, np.full(LOOP.size, 3.0))], False)
    with pytest.raises(ValueError, match="records: none"):
        identification._require_usable([], False)


def test_kinematics_are_finite_angles_for_a_drive_in_mm_or_a_force():
    bad = lambda x: np.full(x.shape, math.nan)  # noqa: E731
    for unit in ("mm", "N"):
        with pytest.raises(ValueError, match="finite angles for the drive"):
            identification._kinematics([Record(LOOP, LOOP, drive_unit=unit)], bad, "chain")
    for unit in ("deg", "step"):
        record = Record(LOOP, LOOP, drive_unit=unit)
        assert identification._kinematics([record, record], bad, "chain") == ([bad, bad], "chain")
    with pytest.raises(ValueError, match=r"shape \(\): expected"):
        identification._kinematics([Record(LOOP, LOOP)], lambda x: 3.0, "chain")
    good, other = (lambda x: x), (lambda x: 2 * x)
    record = Record(LOOP, LOOP)
    assert identification._kinematics([record, record], [good, other], "chain") == ([good, other], "chain")
    theory = Record(LOOP, LOOP, drive_unit="N", kinematics=np.array([[-1.0, -1.0], [1.0, 1.0]]))
    with pytest.raises(RecordError, match="not a force"):
        identification._theory(theory)


def made_fit(**given):
    fields = dict.fromkeys(Fit.__dataclass_fields__)
    fields |= {"warnings": (), "notes": (), "observed": (Record(LOOP, 10 * LOOP),)}
    return Fit(**(fields | given))


def two_records(delay=0.0):
    """Two records with a law of n = 1, gamma = beta, S = 2, A = -0.5; the second's zero is at 3 deg."""
    time = np.arange(LOOP.size) * 0.5
    records = Record(LOOP, 10 * LOOP, title="a", time_s=time), Record(3 * LOOP, 30 * LOOP, source="b.csv", time_s=time)
    form = Form((line(10.0), line(12.0)), groups=(0, 0), longest_delay_s=0.8 if delay else 0.0)
    q = np.array([math.log(0.5), math.log(2.0), 0.0, 1.0, 0.0, -0.5, 3.0, *[delay] * bool(delay)])
    plain = np.array([0.0] * 6 + [-4.0, *[0.0] * bool(delay)])
    masks = tuple(np.arange(LOOP.size) >= first for first in (30, 35))
    return made_fit(
        observed=records, form=form, point=Point(-1.0, q, np.array([0.25])), heldout_masks=masks,
        baseline_point=Point(0.0, plain, np.array([0.75])),
    )  # fmt: skip


def test_a_prediction_is_f_and_h_and_the_zero_of_its_record():
    fit = two_records()
    drive = np.array([0.0, 0.4, 9.0])
    rising = -2.0 * -math.expm1(-0.25 * 4.0)
    np.testing.assert_allclose(fit.predict(drive), [0.25, 4.25 + rising, 90.25 - 2.0], rtol=1e-9)
    # the second starts at h = -1, half of the saturation; f is 12 x + 0.25
    second = -2.0 + 1.0 * math.exp(-0.25 * 4.8)
    np.testing.assert_allclose(fit.predict(drive, record=1), [3.25 - 1.0, 8.05 + second, 111.25 - 2.0], rtol=1e-9)
    np.testing.assert_allclose(fit.plain(drive), 10 * drive + 0.75, atol=1e-12)
    np.testing.assert_allclose(fit.plain(drive, 1), 12 * drive + 0.75 - 4.0, atol=1e-12)
    np.testing.assert_allclose(fit.f(drive, 1), 12 * drive + 0.25, atol=1e-12)
    assert fit.f([0.5]).tolist() == [5.25]
    assert (fit.records, fit.drive_range, fit.first_drive, fit.delay_s) == (("a", "b.csv"), (-3.0, 3.0), -1.0, 0.0)
    assert (fit.model.A, fit.model.h0_deg, len(fit.elements), len(fit.models)) == (-0.5, 0.0, 1, 1)
    assert fit.heldout_masks[0].sum() == LOOP.size - 30
    columns = fit.columns(1)
    assert columns["heldout"].sum() == LOOP.size - 35
    np.testing.assert_array_equal(columns["predicted_deg"], fit.predict(3 * LOOP, record=1))
    np.testing.assert_array_equal(columns["f_alone_deg"], fit.plain(3 * LOOP, 1))


def test_a_prediction_with_a_delay_is_that_of_the_drive_before():
    fit = two_records(0.25)
    time, drive = np.arange(4.0), np.array([0.0, 0.4, 0.8, 9.0])
    earlier = np.array([0.0, 0.3, 0.7, 0.8 + 0.75 * 8.2])
    np.testing.assert_allclose(fit.predict(drive, time), two_records().predict(earlier), rtol=1e-9)
    assert fit.delay_s == 0.25
    with pytest.raises(ValueError, match=r"0\.25 s behind the drive"):
        fit.predict(drive)


@pytest.mark.parametrize(("elements", "title"), [(1, "Bouc-Wen"), (2, "2 Bouc-Wen elements")])
def test_the_law_is_stored_with_all_that_makes_it_again(elements, title):
    errors = SimpleNamespace(to_dict=dict)
    form = Form((line(),), elements=elements, place=Place(1.0, 5.0))
    rows = [[math.log(0.5), math.log(2.0), 0.0, 1.0], [math.log(0.25), 0.0, 0.5, 0.5]][:elements]
    point = Point(-1.0, np.array([*np.ravel(rows), *[0.5, -0.25][:elements]]), np.array([0.25]))
    law = made_fit(form=form, point=point, parameters={}, layer={}, train=errors, heldout=errors)._of_law()
    assert (law["name"], law["title"], law["choice"], law["sign"]) == ("bouc-wen", title, None, -1.0)
    assert law["values"] == [[*row, state] for row, state in zip(rows, (0.5, -0.25), strict=False)]
    assert (law["place"], law["delay_s"]) == ([1.0, 5.0], 0.0)
    assert (law["f"]["drive"][0], law["f"]["drive"][-1], len(law["f"]["drive"])) == (-1.0, 1.0, 257)
    np.testing.assert_allclose(law["f"]["angle_deg"], 10 * np.array(law["f"]["drive"]) + 0.25, atol=1e-12)
    for element, again in zip(
        point.elements(form), elements_of(law["name"], law["sign"], law["values"], law["place"]), strict=True
    ):
        assert again == element

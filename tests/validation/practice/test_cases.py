"""Practice cases: sizes, seeds, protocols and files."""

from pathlib import Path

import numpy as np
import pytest

from fem_models.chain.solve import simulate_chain
from fem_models.load import LoadProgram
from fem_models.rig import Rig
from fem_models.rig.of_record import rig_of
from hysteresis import Record, read_record
from validation.practice import Case, draw, draw_case
from validation.practice.cases import write_case
from validation.practice.catalogue import ANGLE_ALONE, CATALOGUE, DISTINCT
from validation.practice.draw import SETS
from validation.practice.outside_catalogue import OUTSIDE_CATALOGUE
from validation.practice.size import MODERATE

EFFECTS = [*CATALOGUE, *OUTSIDE_CATALOGUE]


def files(case: Case, folder: Path) -> dict[str, bytes]:
    write_case(case, folder)
    return {path.name: path.read_bytes() for path in sorted((folder / case.name).iterdir())}


@pytest.mark.parametrize("label", EFFECTS)
def test_every_effect_is_drawn_at_a_moderate_size(label: str) -> None:
    case = draw_case("work", "known", label, 0)
    assert case.truth.effects == (label,)
    assert MODERATE[0] <= case.truth.ratios[0] <= MODERATE[1]
    # a free f(x) can only absorb more than the parameters alone, by definition of least squares
    assert case.truth.beyond_curve[0] <= case.truth.ratios[0] + 1e-3
    assert all(np.isfinite(value) for value in case.truth.numbers[label].values())


def test_same_seed_gives_the_same_files(tmp_path: Path) -> None:
    first, again = (files(draw_case("work", "unknown", "pair", 1), tmp_path / name) for name in "ab")
    assert first == again
    assert len(first) == 8  # four records with a CSV and a sidecar each


def test_sets_kinds_labels_and_numbers_differ() -> None:
    cases = [
        draw_case("work", "known", "clean", 0),
        draw_case("score", "known", "clean", 0),
        draw_case("work", "unknown", "clean", 0),
        draw_case("work", "known", "clean", 1),
    ]
    assert len({case.records[0].angle_deg.tobytes() for case in cases}) == len(cases)
    assert len(set(SETS.values())) == len(SETS)


def test_protocol_of_the_records() -> None:
    for number in range(4):
        case = draw_case("work", "known", "clean", number)
        assert [record.rig["preload_N"] for record in case.records[:3]] == [20.0, 10.0, 20.0]
        seconds = [record.time_s[-1] for record in case.records]
        amplitudes = [np.abs(record.drive).max() for record in case.records]
        assert 5 < seconds[0] / seconds[2] < 15  # the rates that are drawn
        assert amplitudes[3] == pytest.approx(amplitudes[0] / 2, abs=0.01)  # rounded to 0.01 mm
        # 25 to 45 deg, except for noise, zero and the remaining error of the secant
        assert 24 < np.abs(case.records[0].angle_deg).max() < 46
        np.testing.assert_array_equal(case.records[0].angle_deg, np.round(case.records[0].angle_deg, 4))


def test_sidecars_have_the_nominal_rig_or_only_the_preload(tmp_path: Path) -> None:
    found = set()
    for number in (0, 1, 2, 3, 5, 6, 7, 8):  # none with the multibody model
        known = draw_case("work", "known", "clean", number)
        path = write_case(known, tmp_path)[1]
        text = path.with_suffix(".toml").read_text()
        assert not any(effect in text for effect in EFFECTS)
        record = read_record(path)
        rig = rig_of(record)
        assert rig is not None
        assert rig.preload_N == 10.0
        assert rig.name in ("du2018-full-widths", "bench")
        found.add((rig.name, record.cycle is None))
    assert {name for name, _ in found} == {"du2018-full-widths", "bench"}
    assert {counted for _, counted in found} == {True, False}
    unknown = draw_case("work", "unknown", "backlash", 0)
    assert [dict(record.rig) for record in unknown.records[:2]] == [{"preload_N": 20.0}, {"preload_N": 10.0}]


def test_titles_do_not_reveal_the_effect() -> None:
    cases = [draw_case("work", "known", label, 0) for label in ("clean", "backlash")]
    assert len({record.title for case in cases for record in case.records}) == 4


def test_one_case_in_five_is_simulated_with_the_multibody_model(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[object] = []

    def simulated(rig: Rig, program: LoadProgram) -> Record:  # by the chain, which is faster
        calls.append(rig)
        return simulate_chain(rig, program)

    monkeypatch.setattr(draw, "simulate_multibody", simulated)
    assert draw_case("work", "known", "clean", 3).truth.engine == "chain"
    assert not calls
    case = draw_case("work", "known", "clean", 4)
    assert case.truth.engine == "multibody"
    assert len(calls) >= len(case.records)


def test_pairs_have_effects_of_two_kinds() -> None:
    kind = {effect: k for k, group in enumerate(DISTINCT) for effect in group}
    assert set(kind) <= set(CATALOGUE)
    assert len(kind) == sum(map(len, DISTINCT))
    a, b = draw_case("work", "known", "pair", 0).truth.effects
    assert kind[a] != kind[b]
    assert set(ANGLE_ALONE) < set(CATALOGUE)

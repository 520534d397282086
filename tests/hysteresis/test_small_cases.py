"""Small cases by hand: folds by the number of cycles, a law that does nothing, ends of a curve, signs and words."""

from types import SimpleNamespace

import numpy as np
import pytest

from hysteresis.fitting.fit import Parameter
from hysteresis.fitting.judgement import _overshoot_warnings
from hysteresis.fitting.uncertainty import _bounded
from hysteresis.laws.inverse import inverse_curve
from hysteresis.laws.stops import follow_stops
from hysteresis.records.folds import inner_folds
from hysteresis.records.holdout import Split
from hysteresis.records.record import Record


@pytest.mark.parametrize(
    ("cycles", "by"), [(1, "blocks of a tenth"), (2, "from the other"), (3, "from those before it")]
)
def test_inner_folds_by_the_number_of_cycles(cycles: int, by: str) -> None:
    way = np.r_[np.linspace(0, 2, 40, endpoint=False), np.linspace(2, 0, 40, endpoint=False)]
    drive, cycle = np.r_[np.tile(way, cycles), 0.0], np.repeat(np.arange(1, cycles + 1), 80)
    cycle = np.r_[cycle, cycle[-1]]
    everything = np.ones(drive.size, dtype=bool)
    folds = inner_folds(Record(drive, drive, cycle=cycle), Split(everything, ~everything, "nothing"))
    assert all(by in fold.by for fold in folds)
    assert not any((fold.train & fold.heldout).any() for fold in folds)
    held = [set(cycle[fold.heldout].tolist()) for fold in folds]
    seen = [set(cycle[fold.train].tolist()) for fold in folds]
    if cycles == 1:
        assert len(folds) == 4
    elif cycles == 2:
        assert (held, seen) == ([{1}, {2}], [{2}, {1}])
    else:
        assert (held, seen) == ([{2}, {3}], [{1}, {1, 2}])


def test_a_law_that_does_nothing_leaves_the_others_of_its_search_alone() -> None:
    path = np.r_[np.linspace(0, 7, 30), np.linspace(7, -3, 30)]
    law, nothing = [-0.9, 2.0, 0.6, 0.2, 0.0, 0.0, 0.0], [0.0, 2.0, 0.6, 0.2, 0.0, 0.0, 0.0]
    alone, both = (follow_stops(path, np.array(rows), 0.0, 10.0) for rows in ([law], [nothing, law]))
    assert not both[0].any()
    np.testing.assert_array_equal(both[1], alone[0])


@pytest.mark.parametrize("slope", [3.0, -3.0])
def test_a_curve_is_inverted_up_to_the_ends_of_its_range(slope: float) -> None:
    drives = np.array([-2.0, 0.3, 2.0])
    assert inverse_curve(lambda x: slope * x, slope * drives, (-2.0, 2.0)) == pytest.approx(drives, abs=1e-12)


def test_the_interval_of_a_negative_constant_is_that_of_its_size_mirrored() -> None:
    def positive(value: float, gradient: np.ndarray, unit: str) -> Parameter:
        return Parameter(value, value / 2, value * 3, unit)

    reader = SimpleNamespace(positive=positive)
    assert _bounded(reader, "A", -2.0, "-", np.ones(1)) == Parameter(-2.0, -6.0, -1.0, "-")
    assert _bounded(reader, "A", 2.0, "-", np.ones(1)) == Parameter(2.0, 1.0, 6.0, "-")
    assert _bounded(reader, "A", 0.0, "-", np.ones(1)) == Parameter(0.0, None, None, "-")


def test_the_element_that_overshoots_is_named() -> None:
    point = SimpleNamespace(models=lambda form: [SimpleNamespace(A=-0.5), SimpleNamespace(A=-1.6)])
    (words,) = _overshoot_warnings(SimpleNamespace(elements=2), point)
    assert words.startswith("A = -1.6 of element 2 is below -1.5")


def test_a_record_shows_its_cycles_where_it_has_numbers_of_them() -> None:
    drive = np.linspace(0, 1, 5)
    assert "1 to 2" in Record(drive, drive, cycle=np.array([1, 1, 1, 2, 2]))._repr_html_()
    assert "cycles" not in Record(drive, drive)._repr_html_()

"""The page on the two readings is what its stored figures say, and these are those of today's code."""

from dataclasses import replace

import pytest

from docs.make.readings.page import PAGE, page
from docs.make.readings.stored import Stored, read
from validation.measured.readings.loops import loops_of
from validation.measured.readings.mechanisms import SETS, rig_of
from validation.measured.readings.paper_table import paper_table
from validation.measured.readings.posterior import met_but_peak
from validation.measured.readings.statements import judge


@pytest.fixture(scope="module")
def stored() -> Stored:
    return read()


def test_page_is_made_of_the_stored_figures(stored: Stored) -> None:
    assert PAGE.read_text(encoding="utf-8") == page(stored)


def test_stored_numbers_of_the_paper_are_those_of_today(stored: Stored) -> None:
    assert stored.table == paper_table()


def test_stored_rigs_of_the_sets_say_what_is_stored(stored: Stored) -> None:
    assert list(stored.sets) == list(SETS)
    for fits in stored.sets.values():
        for reading, fit in fits.items():
            chosen = rig_of(fit.constants)
            judged = judge(loops_of(chosen.rig, chosen.camera), reading)
            assert judged.met == fit.judged.met
            assert judged.chi_square == pytest.approx(fit.judged.chi_square, abs=0.05, rel=0.01)


def test_stored_members_that_meet_all_statements_do(stored: Stored) -> None:
    for drawn in stored.samples.values():
        for reading, samples in drawn.items():
            for member in samples.members(meeting=True)[::20]:
                judged = judge(loops_of(rig_of(member).rig), reading)
                assert judged.met["width at 10 N"]
                assert judged.met["width at 20 N"]


def test_errors_are_of_rigs_that_meet_the_static_statements(stored: Stored) -> None:
    for name, errors in stored.layer.items():
        for reading in errors:
            assert met_but_peak(stored.sets[name][reading].judged)


def test_a_part_that_was_not_run_says_so(stored: Stored) -> None:
    text = page(replace(stored, samples={}, layer={}))
    assert text.count("Not run yet: ") == 3

"""The page on the two readings is what its stored figures say, and these are those of today's code."""

from dataclasses import replace

import pytest

from docs.make.calibration.sample import PRESETS
from docs.make.readings.page import PAGE, page
from docs.make.readings.stored import EVERY, SEED, Stored, read
from fem_models.rig.ensemble import member_constants
from validation.measured.readings.layer_errors import member_errors
from validation.measured.readings.loops import loops_of
from validation.measured.readings.mechanisms import SETS, rig_of
from validation.measured.readings.paper_table import paper_table
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


def test_errors_of_equation_7_are_those_of_the_shipped_members(stored: Stored) -> None:
    for reading, name in PRESETS.items():
        members = member_constants(name)[::EVERY]
        assert len(stored.layer[reading]) == len(members)
        found = member_errors(members[3], reading, SEED + 3)
        assert found.static["20"].largest_deg == pytest.approx(
            stored.layer[reading][3].static["20"].largest_deg, abs=0.05
        )


def test_a_part_that_was_not_run_says_so(stored: Stored) -> None:
    text = page(replace(stored, layer={}))
    assert text.count("Not run yet: ") == 2

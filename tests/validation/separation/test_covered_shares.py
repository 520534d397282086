"""The score of the intervals of ``separate``: how it counts, and a few rigs of it from end to end."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest

from benchmarks.covered_shares import Covered, case_of, counts, covered, interval_of, kept
from docs.make import separation as page
from studies.commands.separation import NUMBERS, Draws, parts_with_intervals, to_measure
from validation.separation import loop_program, separate
from validation.separation.contributions import SOURCES
from validation.separation.priors import PRIORS, laws_of

ROW = Covered(
    seed=1, number=0, noise_deg=0.05, law="flag", laws={"flag": 1.0}, misfit=1.0, effective_draws=40.0, seconds=9.0,
    redrawn=0, found={name: dict.fromkeys(SOURCES, (0.5, 0.5, 0.4, 0.6)) for name in ("share", "width_share")},
)  # fmt: skip


def test_a_score_counts_what_its_intervals_hold(tmp_path):
    missed = replace(ROW, number=1, found={**ROW.found, "share": dict.fromkeys(SOURCES, (0.7, 0.5, 0.4, 0.6))})
    rows = [ROW, missed, replace(ROW, number=2, found={}, refused="no loop")]
    assert counts(rows, "share") == (3, 6)
    assert counts(rows, "width_share", ("friction",)) == (2, 2)
    (tmp_path / "score.jsonl").write_text("".join(json.dumps(asdict(one)) + "\n" for one in rows))
    found = kept(tmp_path / "score.jsonl")
    assert counts(found, "share") == (3, 6)
    assert "3 of 6, 50.0 % (12 to 88) | 0.200" in page.score([*found, replace(ROW, noise_deg=0.2)])
    assert kept(tmp_path / "none.jsonl") == []


def test_exact_intervals_of_a_proportion():
    """Clopper and Pearson 1934: none of n is below 1 - 0.025^(1/n), and so is all of n above."""
    assert interval_of(0, 30) == pytest.approx((0.0, 1 - 0.025 ** (1 / 30)))
    assert interval_of(30, 30) == pytest.approx((0.025 ** (1 / 30), 1.0))
    assert interval_of(95, 100) == pytest.approx((0.8872, 0.9836), abs=1e-4)


def test_the_page_has_the_kept_score_and_the_priors_of_the_code():
    written = page.PAGE.read_text(encoding="utf-8")
    rows = kept(page.SCORE)
    tables = {page.COMMAND: page.score(rows), page.OF_MEMBERS: page.members(rows), page.OF_PRIORS: page.priors()}
    for command, text in tables.items():
        _, between, _ = written.split(f"<!-- table of `python -m {command}` -->")
        assert between.strip() == text.strip()


@pytest.fixture(scope="module")
def divided():
    """The stated rig, with draws of which the energy share of friction is that of the sheath alone."""
    stated = replace(case_of(1, 0).rig, superelastic=None, backlash=None)
    law, *_ = laws_of(stated)
    rng = np.random.default_rng(0)
    z = rng.standard_normal((60, len(law.coordinates)))
    tables = rng.normal(size=(60, 4, len(NUMBERS)))
    tables[:, 0, NUMBERS.index("share")] = 0.8 + 0.01 * z[:, 0]
    rigs = tuple(law.rig_at(one, stated) for one in z)
    found = separate(stated, loop_program(-1.0, 1.0, cycles=1, steps=22), softer=10.0)
    return found, Draws(rigs, tables, np.full(60, 1 / 60))


def test_what_to_measure_is_what_a_share_depends_on(divided):
    friction, *_ = to_measure(*divided)
    assert (friction.part, friction.parameter) == ("friction", "sheath_N")
    assert friction.explains > 0.7  # it is linear in the logarithm
    assert friction.how == PRIORS["sheath_N"].how


def test_intervals_hold_the_value_they_belong_to(divided):
    found, draws = divided
    parts = parts_with_intervals(found, replace(draws, tables=draws.tables + 5.0))
    for part in parts.values():
        for name in NUMBERS:
            low, high = part.interval(name)
            assert low <= getattr(part, name) <= high
    unknown = parts_with_intervals(found, replace(draws, tables=np.full_like(draws.tables, np.nan)))
    assert unknown["friction"].interval("share") is None


@pytest.mark.slow
def test_intervals_of_drawn_rigs_hold_their_shares():
    rows = [covered(case_of(12, number), 12, number, 0.2) for number in range(4)]
    assert not any(one.refused for one in rows)
    held, count = counts(rows, "share")
    assert count == 12
    assert held >= 9  # fewer in 2 of 1,000 where each is held in 95 of 100

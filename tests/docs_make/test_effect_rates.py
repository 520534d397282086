"""The rates of each effect on the page are the counts of the archive."""

from docs.make import effect_rates
from validation.practice.catalogue import CATALOGUE


def test_the_page_has_the_counts_of_the_archive():
    page = effect_rates.PAGE.read_text(encoding="utf-8")
    _, written, _ = page.split(f"<!-- table of `python -m {effect_rates.COMMAND}` -->")
    assert written.strip() == effect_rates.text()


def test_every_effect_of_the_practice_set_has_a_row_and_the_counts_add_up():
    """The sums are the rates of the same sections: 64 of 69 first, 20 of 21 and 40 of 48 in the set."""
    sums = {}
    for heading in effect_rates.SECTIONS:
        text = effect_rates.section(heading)
        found = effect_rates.counts(text)
        for i, rate in enumerate(("first", "within set")):
            hits, of = (sum(int(cells[i].split("/")[part]) for cells in found.values()) for part in (0, 1))
            assert f"| {rate} | {hits} | {of} |" in text
            sums[heading, rate] = hits, of
    assert sums["Known rig", "first"] == (64, 69)
    assert {f"`{name}`" for name in CATALOGUE} <= set(effect_rates.text().split())

"""The page on the two readings, from stored figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from docs.make.pages import DOCS, table, template
from docs.make.readings.stored import Stored
from validation.measured.readings.fit import SetFit
from validation.measured.readings.layer_errors import FastTest, LoopErrors, MemberErrors
from validation.measured.readings.paper_table import (
    FACTORS,
    FULL_SCALE_DEG,
    LARGEST_DEG,
    NORMALISED,
    PERCENT,
    OfReading,
    PaperTable,
)
from validation.measured.readings.statements import PEAK, STATEMENTS

PAGE = DOCS / "validation" / "readings.md"
DRIVE_MM = 2.2
_READINGS = tuple(FACTORS)


def page(stored: Stored) -> str:
    """Format the page; a part that is not stored says so, but the paper's numbers have to be there (KeyError)."""
    paper = stored.table
    if paper is None:
        raise KeyError("table")
    layer = stored.layer
    return template("readings").format(
        paper=paper,
        peak_low=paper.peak_ratio[0],
        peak_high=paper.peak_ratio[1],
        numbers=numbers_table(paper),
        sets=sets_table(stored.sets),
        unmet=unmet_words(stored.sets),
        layer=layer_table(layer) if layer else _not_run("layer"),
        fast=fast_table(layer) if layer else _not_run("layer"),
        layer_words=layer_words(layer) if layer else "",
    )


def _not_run(part: str) -> str:
    return f"Not run yet: `python -m docs.make.readings {part}`."


# --- the paper's numbers -----------------------------------------------------------------------------------------


def numbers_table(paper: PaperTable) -> str:
    """One row a number of the paper, one column a reading; pairs are those at 10 and 20 N."""
    by = {name: [one for one in paper.readings if one.reading == name] for name in _READINGS}

    def row(words: str, text: Callable[[OfReading], str]) -> list[str]:
        return [words, *(" / ".join(text(one) for one in by[name]) for name in _READINGS)]

    def bound(digits: int, name: str, limit: float) -> Callable[[OfReading], str]:
        def text(one: OfReading) -> str:
            value = f"{getattr(one, name):.{digits}f}"
            return f"**{value}**" if getattr(one, name) > limit else value

        return text

    def within(low: float, high: float) -> Callable[[OfReading], str]:
        return lambda one: f"{one.width_deg:.2f}" if low <= one.width_deg <= high else f"**{one.width_deg:.2f}**"

    fast = [paper.model_width_deg + sign * 2 * LARGEST_DEG[1] for sign in (-1, 1)]
    rows = [
        row("loop width, deg", lambda one: f"{one.width_deg:.2f}"),
        row(
            "the same along the drive, mm (45 deg at 2.2 mm)",
            lambda o: f"{o.width_deg * DRIVE_MM / FULL_SCALE_DEG:.2f}",
        ),
        row(
            f"less the loop of equation 10, {paper.model_width_deg:.2f} deg",
            lambda one: f"{one.width_deg - paper.model_width_deg:+.2f}",
        ),
        row(f"largest error, at least; Table 1: {LARGEST_DEG[0]}", bound(2, "least_error_deg", LARGEST_DEG[0])),
        row(f"the same, %; Table 1: {PERCENT[0]}", bound(2, "percent", PERCENT[0])),
        row(f"normalised by 45.8 deg, at least; Table 1: {NORMALISED[0]}", bound(4, "normalised", NORMALISED[0])),
        row("normalised by 90 deg, at least", bound(4, "normalised_by_range", NORMALISED[0])),
        row(
            "width within {:.2f} to {:.2f} deg, which 1.48 deg allows".format(*paper.by_largest_deg),
            within(*paper.by_largest_deg),
        ),
        row("within {:.2f} to {:.2f} deg, which 1.61 deg at 1 Hz allows".format(*fast), within(fast[0], fast[1])),
        row(
            f"width at 0.9 of the stroke, at least {paper.near_end_from_deg:.2f} deg, over the largest",
            lambda one: _ratio(paper.near_end_from_deg / one.width_deg),
        ),
    ]
    return table(["number of the paper", *(f"{name} widths, 10 / 20 N" for name in _READINGS)], rows)


def _ratio(value: float) -> str:
    return f"**{value:.2f}**" if value > 1 else f"{value:.2f}"


# --- sets --------------------------------------------------------------------------------------------------------


def sets_table(sets: Mapping[str, Mapping[str, SetFit]]) -> str:
    """One row a set: deviances of each statement, full / half, those that are not met in bold."""
    rows = []
    for name, fits in sets.items():
        cells = [" / ".join(_deviance(fits[one], statement) for one in _READINGS) for statement in STATEMENTS]
        rows.append([name, *cells])
    return table(["set of mechanisms", *STATEMENTS], rows)


def _deviance(fit: SetFit, statement: str) -> str:
    value = fit.judged.deviance[statement]
    text = f"{value:.1f}" if value < 1000 else f"{value:.0f}"
    return text if fit.judged.met[statement] else f"**{text}**"


def unmet_words(sets: Mapping[str, Mapping[str, SetFit]]) -> str:
    """Which statements no set meets, and how many sets meet all others."""
    parts = []
    for one in _READINGS:
        fits = [fits[one] for fits in sets.values()]
        never = [name for name in STATEMENTS if not any(fit.judged.met[name] for fit in fits)]
        others = sum(all(met for name, met in fit.judged.met.items() if name not in never) for fit in fits)
        words = " and ".join(f'"{name}"' for name in never) or "none"
        parts.append(f"{one} widths: {words} by no set; all others by {others} of {len(fits)}")
    best = min((fit for fits in sets.values() for fit in fits.values()), key=lambda fit: fit.judged.deviance[PEAK])
    peak = best.judged.numbers["peak at 1 Hz over the static one"]
    return f"Met with {'; with '.join(parts)}. The lowest peak at 1 Hz of a set is {peak:.3f} of the static one."


# --- draws -------------------------------------------------------------------------------------------------------


# --- equation 7 --------------------------------------------------------------------------------------------------


def _error_cells(found: Sequence[LoopErrors], test: int) -> list[str]:
    met = np.array([one.within(test) for one in found])
    cells = []
    for k, (name, digits) in enumerate((("largest_deg", 2), ("percent", 2), ("normalised", 4))):
        values = np.array([getattr(one, name) for one in found])
        cells.append(
            f"{np.median(values):.{digits}f} ({values.min():.{digits}f} to {values.max():.{digits}f}); "
            f"{int(met[:, k].sum())} of {len(found)}"
        )
    return cells


def layer_table(layer: Mapping[str, Sequence[MemberErrors]]) -> str:
    """Format static errors of equation 7 by reading and preload."""
    rows = [["Table 1, measured", "", *(f"{limit[0]}" for limit in (LARGEST_DEG, PERCENT, NORMALISED))]]
    for reading in _READINGS:
        found = layer[reading]
        for preload in found[0].static:
            rows.append([reading, f"{preload} N", *_error_cells([one.static[preload] for one in found], 0)])
    return table(["widths", "loop", "largest error, deg", "%", "normalised"], rows)


def _fast(layer: Mapping[str, Sequence[MemberErrors]], reading: str) -> list[FastTest]:
    return [one.fast for one in layer[reading] if one.fast is not None]


def fast_table(layer: Mapping[str, Sequence[MemberErrors]]) -> str:
    """Errors of the static law at 1 Hz."""
    rows = [["Table 1, measured", *(f"{limit[1]}" for limit in (LARGEST_DEG, PERCENT, NORMALISED)), "", ""]]
    for reading in _READINGS:
        found = _fast(layer, reading)
        late = np.array([one.late_ms for one in found])
        peaks = np.array([one.peak_ratio for one in found])
        cells = _error_cells([one.errors for one in found], 1)
        rows.append([
            reading, *cells, f"{np.median(late):.1f} ({late.min():.1f} to {late.max():.1f})",
            f"{peaks.min():.3f} to {peaks.max():.3f}; {sum(one.peak_met for one in found)} of {len(found)}",
        ])  # fmt: skip
    return table(["widths", "largest error, deg", "%", "normalised", "later than the static loop, ms", "peak"], rows)


def layer_words(layer: Mapping[str, Sequence[MemberErrors]]) -> str:
    """How late the loops are that stay within 1.61 deg, and how many rigs there are."""
    words = []
    for reading in _READINGS:
        found = _fast(layer, reading)
        late = [one.late_ms for one in found if one.errors.within(1)[0]]
        over = [one.late_ms for one in found if not one.errors.within(1)[0]]
        words.append(
            f"with {reading} widths {len(late)} of {len(found)} rigs stay within 1.61 deg, which are at most "
            f"{max(late, default=0.0):.1f} ms late" + (f" (the others at least {min(over):.1f} ms)" if over else "")
        )
    return "At 1 Hz, " + "; ".join(words) + "."

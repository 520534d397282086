"""Writes the tables of the ensemble on the calibration page: ``python -m docs.make.calibration.ensemble``.

Takes two minutes: it runs the loops of all members at other preloads and amplitudes, and divides them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from docs.make.calibration.sample import PRESETS
from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig import Rig, ensemble
from fem_models.rig.ensemble import ensemble_file
from fem_models.rig.rig import numeric_fields
from hysteresis.arrays import Floats, Mask
from hysteresis.files import read_toml
from validation.measured.ensemble.predict import (
    measurements,
    narrowing,
    predicted_shares,
    predicted_widths,
    relative_width,
)
from validation.measured.preset_du2018 import READING
from validation.measured.readings.loops import loops_of
from validation.measured.readings.statements import (
    CENTRE_WIDEST,
    END_LEAST,
    MET,
    PEAK,
    STATEMENTS,
    judge,
    margins_of,
    met_but_peak,
)
from validation.separation.ensemble import range_of

PAGE = DOCS / "validation" / "calibration.md"
HALF = 0.5
NUMBERS = tuple(name for name in STATEMENTS if name not in (CENTRE_WIDEST, END_LEAST, PEAK))


def models_table(made: Mapping[str, Mapping[str, Any]]) -> str:
    """One row a model and a reading: evidence, odds, quality of the draws, and what its members meet."""
    head = ["model", "widths", "log evidence, two runs", "odds", "effective draws", "R-hat", "rigs run", "members",
            "meet all"]  # fmt: skip
    rows = [
        [
            name,
            reading,
            " / ".join(f"{x:.2f}" for x in one["log_evidence"]),
            f"{100 * one['odds']:.1f} %",
            " / ".join(str(x) for x in one["effective_draws"]),
            f"{one['r_hat']:.3f}",
            f"{one['rigs_run']:,}",
            str(one["members"]),
            str(one["meet_all"]),
        ]
        for reading, sidecar in made.items()
        for name, one in sidecar["models"].items()
    ]
    return table(head, rows)


def statements_table(made: Mapping[str, Mapping[str, Any]], near: Mapping[str, Mask]) -> str:
    """How many members meet each statement, by reading; ``near`` are those that do within all errors, (members,)."""
    rows = []
    for name in STATEMENTS:
        met = [sum(one["meet"][name] for one in sidecar["models"].values()) for sidecar in made.values()]
        rows.append(
            [name, *(f"{count} of {sidecar['members']}" for count, sidecar in zip(met, made.values(), strict=True))]
        )
    meeting = [sum(one["meet_all"] for one in sidecar["models"].values()) for sidecar in made.values()]
    every = [f"**{count} of {sidecar['members']}**" for count, sidecar in zip(meeting, made.values(), strict=True)]
    rows.append(["all but the peak at 1 Hz", *every])
    within = [f"**{int(one.sum())} of {one.size}**" for one in near.values()]
    rows.append(["the same, words within a reader's error", *within])
    return table(["statement of the paper", *(f"{reading} widths" for reading in made)], rows)


def constants_table(rigs: Sequence[Rig], made: Mapping[str, Any]) -> str:
    """Priors with their sources, and the range of the members that have the constant."""
    rows = []
    numbers = [numeric_fields(rig) for rig in rigs]
    for name, prior in made["priors"].items():
        key = name.replace("tendon.", "tendon_a.")
        values = [one[key] for one in numbers if one.get(key)]
        found = str(range_of(values)) if values else "no member"
        scale = "log" if prior["uniform_in"] == "logarithm" else "linear"
        rows.append([f"`{name}`", f"{prior['low']:g} to {prior['high']:g}, {scale}", found, prior["source"]])
    return table(["constant", "prior, uniform", "members", "source of the prior"], rows)


def ranges_table(wanted: Mapping[str, Mapping[str, Floats]], meeting: Mapping[str, Mask]) -> str:
    """Median and 90 % range of every prediction by reading, and of the members that meet all static statements."""
    rows = []
    for name in next(iter(wanted.values())):
        cells = []
        for reading, values in wanted.items():
            cells += [_range_words(values[name]), _range_words(values[name][meeting[reading]])]
        rows.append([name, *cells])
    head = [f"{reading} widths{who}" for reading in wanted for who in ("", ", members that meet all")]
    return table(["prediction", *head], rows)


def _range_words(values: Floats) -> str:
    """Range over the members that have such a loop, and how many these are, if not all."""
    able = np.isfinite(values)
    return f"{range_of(values[able])}" + ("" if able.all() else f", {int(able.sum())} of {able.size}")


def narrowing_table(rigs: Sequence[Rig], widths: Mapping[str, Floats], wanted: Mapping[str, Floats]) -> str:
    """Part of the widest ranges that every measurement would leave."""
    candidates = measurements(rigs, widths)
    left = narrowing(candidates, wanted)
    order = sorted(wanted, key=lambda name: -relative_width(name, wanted[name]))[:6]
    rows = []
    for name, one in sorted(left.items(), key=lambda item: item[1][order[0]]):
        cells = [f"**{one[target]:.2f}**" if one[target] <= HALF else f"{one[target]:.2f}" for target in order]
        read = range_of(candidates[name].values)
        rows.append([f"{name} ({candidates[name].how})", f"{read.low:.3g} to {read.high:.3g}", *cells])
    best = min(left, key=lambda name: left[name][order[0]])
    most = max(left, key=lambda name: sum(left[name][target] <= HALF for target in order))
    words = (
        f'The widest range is that of "{order[0]}". "{best}" narrows it to {100 * left[best][order[0]]:.0f} %. '
        f'"{most}" at least halves the most of the six widest: {sum(left[most][t] <= HALF for t in order)}.'
    )
    return words + "\n\n" + table(["measurement", "members read", *order], rows)


def _agrees(rig: Rig, reading: str) -> bool:
    """Whether a rig meets all numbers but the peak at 1 Hz, and the words within two deviations of a reader."""
    loops = loops_of(rig)
    met = judge(loops, reading).met
    return min(margins_of(loops)) > -MET and all(met[name] for name in NUMBERS)


def main() -> None:
    """Work out all tables and put them on the page."""
    made = {
        reading: read_toml(ensemble_file(name).with_suffix(".toml"), "the sidecar of an ensemble")
        for reading, name in PRESETS.items()
    }
    rigs = {reading: ensemble(name) for reading, name in PRESETS.items()}
    widths = {reading: predicted_widths(own) for reading, own in rigs.items()}
    wanted = {reading: {**widths[reading], **predicted_shares(own, threads=2)} for reading, own in rigs.items()}
    finite = {name: one for name, one in wanted[READING].items() if np.isfinite(one).all()}
    for one in (*wanted.values(), finite):
        del one["play, share of energy"]  # play dissipates nothing
    meeting = {
        reading: np.array([met_but_peak(judge(loops_of(rig), reading)) for rig in own]) for reading, own in rigs.items()
    }
    near = {reading: np.array([_agrees(rig, reading) for rig in own]) for reading, own in rigs.items()}
    parts = (
        ("### Six models under two readings", models_table(made)),
        ("### Statements that members meet", statements_table(made, near)),
        ("### Constants", constants_table(rigs[READING], made[READING])),
        ("### Predictions and shares", ranges_table(wanted, meeting)),
        (
            "### Which measurement would narrow the ranges",
            narrowing_table(rigs[READING], {name: finite[name] for name in widths[READING] if name in finite}, finite),
        ),
    )
    put_between_marks(PAGE, "docs.make.calibration.ensemble", "\n\n".join(f"{a}\n\n{b}" for a, b in parts))


if __name__ == "__main__":
    main()

"""Writes the tables of the ensemble on the calibration page: ``python -m docs.make.calibration.ensemble``.

Takes two minutes: it runs the loops of all members at other preloads and amplitudes, and divides them.
"""

from __future__ import annotations

import csv
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from docs.make.pages import DOCS, put_between_marks, table
from fem_models.rig import Rig, ensemble
from fem_models.rig.ensemble import MODEL, ensemble_file
from fem_models.rig.rig import numeric_fields
from hysteresis.arrays import Floats
from validation.measured.ensemble.facts import facts_as, facts_of
from validation.measured.ensemble.predict import (
    measurements,
    narrowing,
    predicted_shares,
    predicted_widths,
    relative_width,
)
from validation.measured.readings.paper_table import FACTORS
from validation.measured.readings.statements import HUNDREDTH_DEG
from validation.separation.ensemble import range_of

PAGE = DOCS / "validation" / "calibration.md"
NAME = "du2018"
HALF = 0.5
KEPT = 0.8
"""Part of the width that counts as approximately the same."""


def models_table(made: Mapping[str, Any]) -> str:
    """One row a model: what its draws met, and its odds."""
    head = ["model", "draws that show the three numbers", "their density, 1/deg^2", "then widest at, mm, 10 N",
            "20 N", "then place met", "odds", "effective draws", "members"]  # fmt: skip
    rows = [
        [
            name,
            f"{100 * one['solved_share']:.0f} %",
            "{:.4f} +- {:.4f}".format(*one["evidence"]),
            *("{1:.1f} ({0:.1f} to {2:.1f})".format(*one[f"widest_at_{p}N_mm"]) for p in (10, 20)),
            *_place_and_odds(one),
            f"{one['effective_draws']:.0f}",
            str(one["members"]),
        ]
        for name, one in made["models"].items()
    ]
    return table(head, rows)


def _place_and_odds(one: Mapping[str, Any]) -> tuple[str, str]:
    """Probability of the place and odds; the upper end of 95 % where no draw meets the place (rule of three)."""
    if one["odds"] == 0:
        return f"below {300 / one['effective_draws_of_numbers']:.0f} %", "no draw"
    return "{:.1f} +- {:.1f} %".format(
        *(100 * value for value in one["place_probability"])
    ), f"{100 * one['odds']:.1f} %"


def facts_table(rigs: Sequence[Rig], reading: str) -> str:
    """Facts of all members, worked out again, beside those of the paper with its widths read so."""
    found, paper = [facts_of(rig) for rig in rigs], facts_as(reading)
    near = HUNDREDTH_DEG * FACTORS[reading]
    met = sum(paper.met_by(one, near) for one in found)
    numbers = np.array([one.numbers for one in found])
    places = np.abs([one.widest_at_mm for one in found])
    rows = [
        [name, stated, f"{low:.{digits}f} to {high:.{digits}f}"]
        for name, stated, low, high, digits in (
            ("full scale at 20 N, deg", "45 +- 0.5", *_ends(numbers[:, 0]), 2),
            ("width at 10 N, deg", f"{paper.widths_deg[0]:g} +- {near:g}", *_ends(numbers[:, 1]), 4),
            ("width at 20 N, deg", f"{paper.widths_deg[1]:g} +- {near:g}", *_ends(numbers[:, 2]), 4),
            ("widest at 10 N, mm from zero", "0 +- 0.5", *_ends(places[:, 0]), 1),
            ("widest at 20 N, mm from zero", "0 +- 0.5", *_ends(places[:, 1]), 1),
        )
    ]
    return f"{met} of {len(rigs)} members meet all facts.\n\n" + table(["fact", "paper", "members, all"], rows)


def _ends(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())


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


def ranges_table(wanted: Mapping[str, Floats]) -> str:
    """Median and 90 % range of every prediction."""
    rows = []
    for name, values in wanted.items():
        found = range_of(values)
        rows.append(
            [name, f"{found.median:.3g}", f"{found.low:.3g} to {found.high:.3g}", f"{relative_width(name, values):.2f}"]
        )
    return table(["prediction", "median", "90 % range", "its width, over the median (of a share: its width)"], rows)


def amplitude_words(rigs: Sequence[Rig], widths: Mapping[str, Floats], reading: str) -> str:
    """Compare with what the paper says of smaller amplitudes, in words: no constant was fitted to it."""
    with ensemble_file(NAME).open(encoding="utf-8", newline="") as file:
        models = np.array([row[MODEL] for row in csv.DictReader(file)])
    ratio = widths["width at 1.1 mm, 20 N, deg"] / facts_as(reading).widths_deg[1]
    kept = ", ".join(
        f'{int((ratio[models == name] >= KEPT).sum())} of {int((models == name).sum())} of "{name}"'
        for name in dict.fromkeys(models.tolist())
    )
    return (
        'The paper says of 20 N that the hysteresis is "approximately the same" at other amplitudes. No constant was '
        f"fitted to that. The loop of 1.1 mm has {range_of(ratio)} of the width of 2.2 mm. "
        f"{int((ratio >= KEPT).sum())} of {len(rigs)} members keep at least {100 * KEPT:.0f} %: {kept}."
    )


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


def main() -> None:
    """Work out all tables and put them on the page."""
    made = tomllib.loads(ensemble_file(NAME).with_suffix(".toml").read_text(encoding="utf-8"))
    reading = made["reading"].removesuffix(" widths")
    rigs = ensemble(NAME)
    widths = predicted_widths(rigs)
    wanted = {**widths, **predicted_shares(rigs, threads=2)}
    energy = [name for name in wanted if name == "play, share of energy"]  # play dissipates nothing
    wanted = {name: values for name, values in wanted.items() if name not in energy}
    parts = (
        ("### Six models", models_table(made)),
        ("### Facts of the members", facts_table(rigs, reading)),
        ("### Constants", constants_table(rigs, made)),
        ("### Predictions and shares", f"{ranges_table(wanted)}\n\n{amplitude_words(rigs, widths, reading)}"),
        ("### Which measurement would narrow the ranges", narrowing_table(rigs, widths, wanted)),
    )
    put_between_marks(PAGE, "docs.make.calibration.ensemble", "\n\n".join(f"{a}\n\n{b}" for a, b in parts))


if __name__ == "__main__":
    main()

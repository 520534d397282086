"""Writes docs/guide/effects-catalogue.md from the catalogue: ``python -m docs.make.effects``."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Sequence
from pathlib import Path

from hysteresis.files import write_files
from validation.tracing.effect import Effect, FreeParameter, Need, RelativeParameter, catalogue

PAGE = Path(__file__).parents[2] / "docs" / "guide" / "effects-catalogue.md"

_WIDTH = 120
_NEEDS: dict[Need, str] = {
    "time": "times",
    "cycles": "cycles of one amplitude",
    "preloads": "two preloads",
    "two tendons": "two tendons",
    "wheel": "a wheel that drives",
    "force": "a tendon force that drives",
}
_INTRODUCTION = """# Catalogue of effects

Written by `python -m docs.make.effects` from the files of `validation/tracing/effects/`, one an effect;
`notchbend effects` prints it. What the tracer does with it: [trace.md](trace.md). The tables of a rig that has an
effect from the start: [effects.md](../theory/effects.md).

A row is one way in which an effect may act, with the constants that are fitted: in the mechanics where the geometry of
the rig is known, as an operator on drive, bend, loop, angle or time where it is not. There, constants count in parts of
half the largest range of the drive or of the angle, or of the shortest record's time. *Needs* is what the records or
the rig must have for it to be tried. A row *at the end* is not looked for: an effect that is named is fitted in it too.
"""


def page(effects: Sequence[Effect]) -> str:
    """Markdown of the catalogue."""
    listed = "\n".join(f"- [`{effect.name}`](#{effect.name})" for effect in effects)
    return "\n".join([_INTRODUCTION, listed, "", "\n".join(map(_section, effects))])


def _section(effect: Effect) -> str:
    rows = [
        _row("known, at the end" if form.refines else "known", form.parameters, form.needs) for form in effect.rig_forms
    ]
    rows += [_row("unknown", form.parameters, form.needs) for form in effect.curve_forms]
    table = "\n".join(["| geometry | constants | needs |", "|---|---|---|", *rows])
    distinguished = textwrap.fill(f"*Distinguished by.* {effect.distinguished_by}", _WIDTH, break_long_words=False)
    physics = textwrap.fill(effect.physics, _WIDTH, break_long_words=False, break_on_hyphens=False)
    return f"## {effect.name}\n\n{physics}\n\n{distinguished}\n\n{table}\n"


def _row(geometry: str, parameters: Sequence[FreeParameter | RelativeParameter], needs: Collection[Need]) -> str:
    shown = [f"`{c.name}`" + (f" ({c.unit})" if c.unit != "-" else "") for c in parameters]
    return f"| {geometry} | {', '.join(shown)} | {', '.join(_NEEDS[need] for need in sorted(needs)) or '-'} |"


if __name__ == "__main__":
    write_files({PAGE: page(catalogue())})

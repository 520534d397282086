"""Writes ``docs/guide/effects-catalogue.md`` from the catalogue: ``python -m docs.make.effects``."""

from __future__ import annotations

import textwrap
from collections.abc import Collection, Sequence

from docs.make.pages import DOCS, table, template
from hysteresis.files import write_files
from validation.tracing import Effect, catalogue
from validation.tracing.effect import FreeParameter, Need, RelativeParameter, Sensible

PAGE = DOCS / "guide" / "effects-catalogue.md"

_WIDTH = 120
_NEEDS: dict[Need, str] = {
    "time": "times",
    "cycles": "cycles of one amplitude",
    "preloads": "two preloads",
    "one preload": "one preload alone",
    "two tendons": "two tendons",
    "one tendon": "a single tendon",
    "wheel": "a wheel as the drive",
    "force": "a tendon force as the drive",
    "drive in mm": "a drive in mm of tendon",
    "declared plateau": "a plateau that is declared",
    "reference": "a reference",
    "torsion": "torsion in all records",
}


def page(effects: Sequence[Effect]) -> str:
    """Markdown of the catalogue."""
    listed = "\n".join(f"- [`{effect.name}`](#{effect.name})" for effect in effects)
    return template("effects-catalogue").format(listed=listed, sections="\n\n".join(map(_section, effects)))


def _section(effect: Effect) -> str:
    rows = [
        _row("known, at the end" if form.refines else "known", form.parameters, form.needs) for form in effect.rig_forms
    ]
    rows += [_row("unknown", form.parameters, form.needs) for form in effect.curve_forms]
    rows += [_row("known, in space", form.parameters, form.needs) for form in effect.space_forms]
    distinguished = textwrap.fill(f"*Distinguished by.* {effect.distinguished_by}", _WIDTH, break_long_words=False)
    physics = textwrap.fill(effect.physics, _WIDTH, break_long_words=False, break_on_hyphens=False)
    parts = [f"## {effect.name}", physics, distinguished, table(["geometry", "parameters", "needs"], _once(rows))]
    return "\n\n".join([*parts, *_plausible(effect)])


def _once(rows: Sequence[list[str]]) -> list[list[str]]:
    """Rows without repetitions: forms of a parameter that is free on either side have the same row."""
    return [*{tuple(row): row for row in rows}.values()]


def _plausible(effect: Effect) -> list[str]:
    """Ranges outside of which a fit is shown and not named, parameters of one range and reason in a line."""
    free = [("known", p) for form in (*effect.rig_forms, *effect.space_forms) for p in form.parameters]
    free += [("unknown", p) for form in effect.curve_forms for p in form.parameters]
    there = [(p.name, p.sensible, rig) for rig, p in free if p.sensible is not None]
    ranges = {name: {_range(sensible) for known, sensible, _ in there if known == name} for name, *_ in there}
    named = dict[str, dict[str, None]]()
    for name, sensible, rig in there:
        of_rig = f", {rig} geometry" if len(ranges[name]) > 1 else ""
        named.setdefault(f"{_range(sensible)} ({sensible.because}).", {})[f"`{name}`{of_rig}"] = None
    if not named:
        return []
    lines = [f"- {', '.join(names)}: {what}" for what, names in named.items()]
    words = [textwrap.fill(line, _WIDTH, subsequent_indent="  ", break_on_hyphens=False) for line in lines]
    return ["Named only within:", "\n".join(words)]


def _range(sensible: Sensible) -> str:
    low, high = sensible.low + sensible.about, sensible.high + sensible.about
    per = "" if sensible.per == "1" else f" times {sensible.per}"
    return f"{low:g} to {high:g}{per}"


def _row(geometry: str, parameters: Sequence[FreeParameter | RelativeParameter], needs: Collection[Need]) -> list[str]:
    shown = [f"`{c.name}`" + (f" ({c.unit})" if c.unit != "-" else "") for c in parameters]
    return [geometry, ", ".join(shown), ", ".join(_NEEDS[need] for need in sorted(needs)) or "-"]


if __name__ == "__main__":
    write_files({PAGE: page(catalogue())})

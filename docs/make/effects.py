"""Writes ``docs/guide/effects-catalogue.md`` from the catalogue: ``python -m docs.make.effects``."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Sequence

from docs.make.pages import DOCS, table, template
from hysteresis.files import write_files
from validation.tracing import Effect, catalogue
from validation.tracing.effect import CurveForm, FreeParameter, Need, RelativeParameter, RigForm, Sensible, SpaceForm

PAGE = DOCS / "guide" / "effects-catalogue.md"

_WIDTH = 120
_NEEDS: dict[Need, str] = {
    "time": "times",
    "cycles": "equal cycles",
    "preloads": "two preloads",
    "one preload": "one preload",
    "two tendons": "two tendons",
    "one tendon": "one tendon",
    "wheel": "a wheel",
    "force": "a force",
    "drive in mm": "a drive in mm",
    "declared plateau": "a declared plateau",
    "reference": "a reference",
    "torsion": "torsion",
}


def page(effects: Sequence[Effect]) -> str:
    """Markdown of the catalogue."""
    head = ["effect", "what a record shows", "what to do to distinguish it", "parameters"]
    rows = [[f"[`{e.name}`](#{e.name})", e.seen, _record(e), _names(e)] for e in effects]
    sections = "\n\n".join(map(_section, effects))
    return template("effects-catalogue").format(overview=table(head, rows), sections=sections)


def _record(effect: Effect) -> str:
    """Return what the first sentence tells a reader to do, up to a reason after a colon."""
    first = re.split(r"[.:] ", effect.distinguished_by)[0]
    return first[0].lower() + first[1:]


def _names(effect: Effect) -> str:
    """Parameters of a known rig, of all forms together."""
    forms = [form for form in effect.rig_forms if not form.refines] or effect.space_forms
    return ", ".join({f"`{p.name}`": None for form in forms for p in form.parameters})


def _section(effect: Effect) -> str:
    paragraphs = [effect.physics, f"*Distinguished by.* {effect.distinguished_by}", _parameters(effect)]
    filled = [textwrap.fill(words, _WIDTH, break_long_words=False, break_on_hyphens=False) for words in paragraphs]
    return "\n\n".join([f"## {effect.name}", *filled])


def _parameters(effect: Effect) -> str:
    """One sentence: what is fitted, by what is known of the rig and what a form needs, with the ranges to be named."""
    known = [form for form in effect.rig_forms if not form.refines]
    kinds: list[tuple[str, Sequence[RigForm | CurveForm | SpaceForm]]] = [
        ("known", known),
        ("refined", [form for form in effect.rig_forms if form.refines]),
        ("unknown", effect.curve_forms),
        ("in space", effect.space_forms),
    ]
    said = set[tuple[str, str]]()
    parts = [part for kind, forms in kinds for part in _of_kind(kind, forms, said)]
    return f"*Parameters.* {'; '.join(parts)}."


def _of_kind(kind: str, forms: Sequence[RigForm | CurveForm | SpaceForm], said: set[tuple[str, str]]) -> list[str]:
    """Parameters of the forms with the same needs together; ``said`` has the ranges that stand before."""
    by_needs = dict[str, dict[str, None]]()
    for form in forms:
        shown = by_needs.setdefault(_needs(form.needs), {})
        for parameter in form.parameters:
            if f"`{parameter.name}`" not in {text.partition(" ")[0] for text in shown}:
                shown[_parameter(parameter, said)] = None
    return [f"{kind}{needs}: {', '.join(shown)}" for needs, shown in by_needs.items()]


def _needs(needs: Collection[Need]) -> str:
    return f" with {' and '.join(_NEEDS[need] for need in sorted(needs))}" if needs else ""


def _parameter(parameter: FreeParameter | RelativeParameter, said: set[tuple[str, str]]) -> str:
    """Name, the unit of a relative parameter, and its range, if no name that begins alike has had it."""
    notes: list[str] = [parameter.unit] if isinstance(parameter, RelativeParameter) and parameter.unit != "-" else []
    if parameter.sensible is not None:
        key = parameter.name.partition("_")[0], _range(parameter.sensible)
        notes += [key[1]] if key not in said else []
        said.add(key)
    return f"`{parameter.name}`" + (f" ({', '.join(notes)})" if notes else "")


def _range(sensible: Sensible) -> str:
    low, high = sensible.low + sensible.about, sensible.high + sensible.about
    per = "" if sensible.per == "1" else f" {sensible.per.replace('1/', 'per ')}"
    return (f"±{high:g}" if low == -high else f"{low:g} to {high:g}") + per


if __name__ == "__main__":
    write_files({PAGE: page(catalogue())})

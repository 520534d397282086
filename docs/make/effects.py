"""Writes the pages of the catalogue of effects: ``python -m docs.make.effects``.

They are ``docs/guide/effects-catalogue.md`` and ``docs/guide/effect-parameters.md``.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Collection, Sequence

from docs.make.pages import DOCS, table, template
from hysteresis.files import write_files
from validation.tracing import Effect, catalogue
from validation.tracing.effect import CurveForm, FreeParameter, Need, RelativeParameter, RigForm, Sensible, SpaceForm

PAGE = DOCS / "guide" / "effects-catalogue.md"
PARAMETERS = DOCS / "guide" / "effect-parameters.md"

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
    paragraphs = [effect.physics, f"*Distinguished by.* {effect.distinguished_by}"]
    filled = [textwrap.fill(words, _WIDTH, break_long_words=False, break_on_hyphens=False) for words in paragraphs]
    return "\n\n".join([f"## {effect.name}", *filled])


def parameter_page(effects: Sequence[Effect]) -> str:
    """Markdown of all parameters: a table for each effect, a row for each parameter of a kind of model."""
    return template("effect-parameters").format(sections="\n\n".join(map(_parameters, effects)))


def _parameters(effect: Effect) -> str:
    kinds: list[tuple[str, Sequence[RigForm | CurveForm | SpaceForm]]] = [
        ("known", [form for form in effect.rig_forms if not form.refines]),
        ("known, at the end", [form for form in effect.rig_forms if form.refines]),
        ("unknown", effect.curve_forms),
        ("known, in space", effect.space_forms),
    ]
    rows = {tuple(_row(kind, form.needs, p)): None for kind, forms in kinds for form in forms for p in form.parameters}
    head = ["geometry", "parameter", "unit", "named within", "needs"]
    return f"## {effect.name}\n\n" + table(head, [list(row) for row in rows])


def _row(geometry: str, needs: Collection[Need], parameter: FreeParameter | RelativeParameter) -> list[str]:
    within = "" if parameter.sensible is None else f"{_range(parameter.sensible)}: {parameter.sensible.because}"
    return [
        geometry,
        f"`{parameter.name}`",
        parameter.unit,
        within or "-",
        ", ".join(_NEEDS[need] for need in sorted(needs)) or "-",
    ]


def _range(sensible: Sensible) -> str:
    low, high = sensible.low + sensible.about, sensible.high + sensible.about
    per = "" if sensible.per == "1" else f" times {sensible.per}"
    return f"{low:g} to {high:g}{per}"


if __name__ == "__main__":
    write_files({PAGE: page(catalogue()), PARAMETERS: parameter_page(catalogue())})

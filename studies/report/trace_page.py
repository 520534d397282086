"""The page of one trace: one HTML file with everything in it."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from studies.report.templates import environment
from validation.tracing.effect import catalogue
from validation.tracing.report import in_words

TEMPLATE = "trace.html"


def trace_page(result: Mapping[str, Any], figures: Mapping[str, bytes]) -> str:
    """HTML of a trace.

    Parameters
    ----------
    result
        As in trace.json, with ``figures``: their files and captions.
    figures
        PNG of each of those files.
    """
    names = {name for effect in result["effects"] for name in (effect["name"], *effect["confusable_with"])}
    pictures = [
        {
            "data": base64.b64encode(figures[item["file"]]).decode(),
            "caption": item["caption"],
            "alt": item["caption"].split(".")[0],
        }
        for item in result["figures"]
    ]
    return (
        environment(Path(__file__).parent)
        .get_template(TEMPLATE)
        .render(
            t=result,
            words=in_words(result),
            errors=_error_rows(result),
            parameters=_parameter_rows(result),
            effects=[effect for effect in catalogue() if effect.name in names],
            figures=pictures,
            named=" + ".join(effect["name"] for effect in result["effects"]),
            alike=f"{result['alike']:.0f}",
        )
    )


def _error_rows(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Rows of the table of errors; one for both models where nothing was added."""
    augmented = " + ".join(effect["name"] for effect in result["effects"])
    rows = []
    stages = [("declared model", "before"), *([(f"with {augmented}", "after")] if augmented else [])]
    for model, key in stages:
        for part, words in (("heldout", "held out"), ("train", "fitted")):
            rows.append((f"{model}, {words}", result[key][part]))
    if result["multibody"]:
        rows += [(f"{model}, multibody", result["multibody"][key]) for model, key in stages]
    floor = result["noise_floor_deg"]
    return [{"name": n, **e, "over_noise": e["rmse_deg"] / floor if floor else None} for n, e in rows]


def _parameter_rows(result: Mapping[str, Any]) -> list[dict[str, Any]]:
    tables: Sequence[tuple[str, Mapping[str, Any]]] = [
        *((effect["name"], effect["parameters"]) for effect in result["effects"]),
        ("declared model", result["declared"]),
    ]
    return [{"of": of, "name": name, **p} for of, table in tables for name, p in table.items()]

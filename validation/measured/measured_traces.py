"""Traces of all measured records, with no help: the page docs/validation/measured-traces.md and its figures.

``python -m validation.measured.measured_traces --out DIR`` traces every group of records in one call, as the command does,
keeps what it found in DIR, and puts table and figures into the page; groups that are in DIR are not traced again.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.progress import track

from hysteresis.files import write_files
from hysteresis.record_file import read_record
from validation.measured.wrists import measured_folder
from validation.tracing.figures import residual_figure
from validation.tracing.next_experiment import next_experiment
from validation.tracing.report import in_words, to_dict
from validation.tracing.second_opinion import confirm
from validation.tracing.trace import trace_records

GROUPS: Mapping[str, str] = {
    "tee-probe": "tee-probe-antero-posterior.csv",
    "surgical-manipulator": "surgical-manipulator-0-80.csv",
    "surgical-manipulator-feedforward": "surgical-manipulator-feedforward.csv",
    "notched-wrist-90": "notched-wrist-90.csv",
    "notched-wrist-150": "notched-wrist-150.csv",
    "catheter-taut": "catheter-taut-*.csv",
    "catheter-slack": "catheter-slack-*.csv",
    "tendon-robot": "tendon-robot-*.csv",
    "davinci-tool": "davinci-tool-*.csv",
}
"""Records of one rig each, by name; those of a group are traced in one call."""
HEADING = "## What was found"
_DPI = 80


def trace_group(paths: Sequence[Path], threads: int) -> tuple[dict[str, Any], bytes]:
    """Trace records: plain values as in trace.json, with ``seconds``; and the figure of the residuals."""
    start = time.perf_counter()
    trace = trace_records([read_record(path) for path in paths], threads=threads)
    seconds = time.perf_counter() - start
    result = to_dict(trace, experiment=next_experiment(trace), confirmation=confirm(trace), seconds=seconds)
    return result, residual_figure(trace, dpi=_DPI)


def page(results: Mapping[str, Mapping[str, Any]]) -> str:
    """Markdown of all groups: a table, then each with its words, constants and figure."""
    head = ["records", "model", "verdict", "noise, deg", "before, deg", "after, deg", "after / before", "s"]
    rows = [head, ["---"] * len(head), *(_row(name, result) for name, result in results.items())]
    parts = ["\n".join("| " + " | ".join(row) + " |" for row in rows)]
    parts += [_section(name, result) for name, result in results.items()]
    return "\n\n".join(parts) + "\n"


def _row(name: str, result: Mapping[str, Any]) -> list[str]:
    before, after = (result[when]["heldout"]["rmse_deg"] for when in ("before", "after"))
    named = " + ".join(_alike(effect) for effect in result["effects"])
    numbers = [f"{value:.3g}" for value in (result["noise_floor_deg"], before, after)]
    nearest = [f"; nearest {_plus(c['name'])}, {c['heldout_rmse_deg']:.3g} deg" for c in result["candidates"][:1]]
    verdict = f"{result['verdict']}: {named}" if named else result["verdict"] + "".join(nearest)
    return [f"`{name}`", result["model"], verdict, *numbers, f"{after / before:.2f}", f"{result['seconds']:.0f}"]


def _plus(names: str) -> str:
    return " + ".join(f"`{name}`" for name in names.split(" + "))


def _alike(effect: Mapping[str, Any]) -> str:
    return " or ".join(f"`{name}`" for name in (effect["name"], *effect["confusable_with"]))


def _section(name: str, result: Mapping[str, Any]) -> str:
    parameters = [
        f"`{effect['name']}`: {key} = {p['value']:.3g} {p['unit']}{_interval(p)}"
        for effect in result["effects"]
        for key, p in effect["parameters"].items()
    ]
    lines = [
        f"### {name}",
        " ".join(in_words(result)),
        f"Held out: {result['heldout_by']}. Multibody: {_multibody(result)}.",
        *(["Constants: " + "; ".join(parameters) + "."] if parameters else []),
        f"Measure next: {result['next_experiment']}.",
        f"![Residual of {name} over drive, time, cycle and angle](../images/trace-{name}.png)",
    ]
    return "\n\n".join(lines)


def _multibody(result: Mapping[str, Any]) -> str:
    if (there := result["multibody"]) is None:
        return str(result["multibody_words"])
    return f"{there['before']['rmse_deg']:.3g} deg before, {there['after']['rmse_deg']:.3g} deg after"


def _interval(parameter: Mapping[str, Any]) -> str:
    low, high = parameter["low"], parameter["high"]
    return "" if low is None or high is None else f" ({low:.3g} to {high:.3g})"


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace, keep, and write the page."""
    parser = argparse.ArgumentParser(
        prog="python -m validation.measured.measured_traces", description="Trace measured records."
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for what is found")
    parser.add_argument("--threads", type=int, default=2, help="for derivatives")
    parser.add_argument("--docs", type=Path, default=Path(__file__).parents[2] / "docs", help="folder of the page")
    options = parser.parse_args(arguments)
    for name, pattern in track(GROUPS.items(), description="records"):
        kept = options.out / f"{name}.json"
        if not kept.exists():
            result, figure = trace_group(sorted(measured_folder().glob(pattern)), options.threads)
            write_files({kept: json.dumps(result, indent=2) + "\n", options.out / f"trace-{name}.png": figure})
    results = {name: json.loads((options.out / f"{name}.json").read_text(encoding="utf-8")) for name in GROUPS}
    text = options.docs / "validation" / "measured-traces.md"
    prose = text.read_text(encoding="utf-8").split(HEADING)[0]
    figures = {
        options.docs / "images" / f"trace-{n}.png": (options.out / f"trace-{n}.png").read_bytes() for n in GROUPS
    }
    write_files({**figures, text: f"{prose}{HEADING}\n\n{page(results)}"})


if __name__ == "__main__":
    main()

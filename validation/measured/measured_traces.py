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

from rich.progress import track

from hysteresis.files import write_files
from hysteresis.record_file import read_record
from hysteresis.uncertainty import Parameter
from validation.measured.wrists import measured_folder
from validation.tracing.figures import residual_figure
from validation.tracing.next_experiment import next_experiment
from validation.tracing.result import EffectReport, TraceReport, in_words, trace_report
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


def trace_group(paths: Sequence[Path], threads: int) -> tuple[TraceReport, bytes]:
    """Trace records: the report, with ``seconds``; and the figure of the residuals."""
    start = time.perf_counter()
    trace = trace_records([read_record(path) for path in paths], threads=threads)
    seconds = time.perf_counter() - start
    report = trace_report(trace, experiment=next_experiment(trace), confirmation=confirm(trace), seconds=seconds)
    return report, residual_figure(trace, dpi=_DPI)


def page(reports: Mapping[str, TraceReport]) -> str:
    """Markdown of all groups: a table, then each with its words, constants and figure."""
    head = ["records", "model", "verdict", "noise, deg", "before, deg", "after, deg", "after / before", "s"]
    rows = [head, ["---"] * len(head), *(_row(name, report) for name, report in reports.items())]
    parts = ["\n".join("| " + " | ".join(row) + " |" for row in rows)]
    parts += [_section(name, report) for name, report in reports.items()]
    return "\n\n".join(parts) + "\n"


def _row(name: str, report: TraceReport) -> list[str]:
    before, after = report.before.heldout.rmse_deg, report.after.heldout.rmse_deg
    named = " + ".join(_alike(effect) for effect in report.effects)
    numbers = [f"{value:.3g}" for value in (report.noise_floor_deg, before, after)]
    nearest = [f"; nearest {_plus(c.name)}, {c.heldout_rmse_deg:.3g} deg" for c in report.candidates[:1]]
    verdict = f"{report.verdict}: {named}" if named else report.verdict + "".join(nearest)
    return [f"`{name}`", report.model, verdict, *numbers, f"{after / before:.2f}", f"{report.seconds:.0f}"]


def _plus(names: str) -> str:
    return " + ".join(f"`{name}`" for name in names.split(" + "))


def _alike(effect: EffectReport) -> str:
    return " or ".join(f"`{name}`" for name in (effect.name, *effect.confusable_with))


def _section(name: str, report: TraceReport) -> str:
    parameters = [
        f"`{effect.name}`: {key} = {p.value:.3g} {p.unit}{_interval(p)}"
        for effect in report.effects
        for key, p in effect.parameters.items()
    ]
    lines = [
        f"### {name}",
        " ".join(in_words(report)),
        f"Held out: {report.heldout_by}. Multibody: {_multibody(report)}.",
        *(["Constants: " + "; ".join(parameters) + "."] if parameters else []),
        f"Measure next: {report.next_experiment}.",
        f"![Residual of {name} over drive, time, cycle and angle](images/trace-{name}.png)",
    ]
    return "\n\n".join(lines)


def _multibody(report: TraceReport) -> str:
    if (there := report.multibody) is None:
        return report.multibody_words
    return f"{there.before.rmse_deg:.3g} deg before, {there.after.rmse_deg:.3g} deg after"


def _interval(parameter: Parameter) -> str:
    low, high = parameter.low, parameter.high
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
            report, figure = trace_group(sorted(measured_folder().glob(pattern)), options.threads)
            write_files(
                {kept: json.dumps(report.to_dict(), indent=2) + "\n", options.out / f"trace-{name}.png": figure}
            )
    stored = {name: options.out / f"{name}.json" for name in GROUPS}
    reports = {
        name: TraceReport.from_dict(json.loads(path.read_text(encoding="utf-8")), str(path))
        for name, path in stored.items()
    }
    text = options.docs / "validation" / "measured-traces.md"
    prose = text.read_text(encoding="utf-8").split(HEADING)[0]
    figures = {
        options.docs / "images" / f"trace-{n}.png": (options.out / f"trace-{n}.png").read_bytes() for n in GROUPS
    }
    write_files({**figures, text: f"{prose}{HEADING}\n\n{page(reports)}"})


if __name__ == "__main__":
    main()

"""Writes the results and the figures of ``docs/validation/measured-traces.md``.

``python -m docs.make.measured_traces --out DIR`` traces every group of records in one call, as the command does. It
keeps the results in DIR, and does not trace again what DIR has.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from rich.progress import track

from docs.make.pages import DOCS, IMAGES, put_after_heading, table
from hysteresis.files import write_files
from hysteresis.fitting.uncertainty import Parameter
from validation.measured import measured_folder
from validation.measured.measured_traces import GROUPS, trace_group
from validation.tracing.result import EffectReport, MultibodyErrors, TraceReport, in_words

PAGE = DOCS / "validation" / "measured-traces.md"
HEADING = "## Results"


def page(reports: Mapping[str, TraceReport]) -> str:
    """Markdown of all groups: a table, a section each, what was held out, what to measure next."""
    head = ["records", "model", "verdict", "floor, deg", "before, deg", "after, deg", "share explained, %", "s"]
    parts = [table(head, [_row(name, report) for name, report in reports.items()])]
    parts += [_section(name, report) for name, report in reports.items()]
    parts += ["### What was held out", _by_text({name: report.heldout_by for name, report in reports.items()})]
    parts += ["### What to measure next", _by_text({name: report.next_experiment for name, report in reports.items()})]
    return "\n\n".join(parts) + "\n"


def _row(name: str, report: TraceReport) -> list[str]:
    before, after = report.before.heldout.rmse_deg, report.after.heldout.rmse_deg
    named = " + ".join(_alike(effect) for effect in report.effects)
    numbers = [f"{value:.3g}" for value in (report.noise_floor_deg, before, after)]
    there = [c for c in report.candidates if c.heldout_rmse_deg is not None]
    there.sort(key=lambda c: c.heldout_rmse_deg or 0.0)
    nearest = [f"; nearest {_plus(c.name)}, {c.heldout_rmse_deg:.3g} deg" for c in there[:1]]
    verdict = f"{report.verdict}: {named}" if named else report.verdict + "".join(nearest)
    return [f"`{name}`", report.model, verdict, *numbers, _share(report), f"{report.seconds:.0f}"]


def _share(report: TraceReport) -> str:
    if (share := report.explained_share) is None:
        return "-"
    if share.low >= 1.0:
        return "all"
    own = f"{100 * share.value:.0f} ({100 * share.low:.0f} to {100 * share.high:.0f})"
    return own if report.effects else f"nearest: {own}"


def _plus(names: str) -> str:
    return " + ".join(f"`{name}`" for name in names.split(" + "))


def _alike(effect: EffectReport) -> str:
    return " or ".join(f"`{name}`" for name in (effect.name, *effect.confusable_with))


def _section(name: str, report: TraceReport) -> str:
    parameters = [
        f"`{effect.name}`: {key} = {p.value:.3g}{'' if p.unit == '-' else f' {p.unit}'}{_interval(p)}"
        for effect in report.effects
        for key, p in effect.parameters.items()
    ]
    lines = [
        f"### {name}",
        " ".join(in_words(report)),
        *(["Parameters: " + "; ".join(parameters) + "."] if parameters else []),
        *([f"Multibody: {_multibody(report.multibody)}."] if report.multibody else []),
        f"![Residual of {name} over drive, time, cycle and angle: {_rows(report)}](../images/trace-{name}.png)",
    ]
    return "\n\n".join(lines)


def _rows(report: TraceReport) -> str:
    """Say what the rows of the picture are."""
    if not report.effects:
        return "one row, the baseline model, since no effect is named"
    return f"above the baseline model, below with {' and '.join(effect.name for effect in report.effects)}"


def _by_text(texts: Mapping[str, str]) -> str:
    """List texts, each once, with the records that it is of."""
    names = {text: [f"`{name}`" for name, own in texts.items() if own == text] for text in texts.values()}
    return "\n".join(f"- {', '.join(of)}: {text}." for text, of in names.items())


def _multibody(there: MultibodyErrors) -> str:
    return f"{there.before.rmse_deg:.3g} deg before, {there.after.rmse_deg:.3g} deg after"


def _interval(parameter: Parameter) -> str:
    low, high = parameter.low, parameter.high
    return "" if low is None or high is None else f" ({low:.3g} to {high:.3g})"


def main(arguments: Sequence[str] | None = None) -> None:
    """Trace, keep the results, and write page and figures."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.measured_traces", description="Trace measured records.")
    parser.add_argument("--out", type=Path, required=True, help="folder for the results")
    parser.add_argument("--threads", type=int, default=2, help="for derivatives")
    options = parser.parse_args(arguments)
    for name, pattern in track(GROUPS.items(), description="records"):
        kept = options.out / f"{name}.json"
        if not kept.exists():
            report, figure = trace_group(sorted(measured_folder().glob(pattern)), options.threads)
            files: dict[Path, str | bytes] = {
                kept: json.dumps(report.to_dict(), indent=2) + "\n",
                kept.with_name(f"trace-{name}.png"): figure,
            }
            write_files(files)
    stored = {name: options.out / f"{name}.json" for name in GROUPS}
    reports = {
        name: TraceReport.from_dict(json.loads(path.read_text(encoding="utf-8")), str(path))
        for name, path in stored.items()
    }
    put_after_heading(PAGE, HEADING, page(reports))
    write_files({IMAGES / f"trace-{n}.png": (options.out / f"trace-{n}.png").read_bytes() for n in GROUPS})


if __name__ == "__main__":
    main()

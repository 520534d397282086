"""The page of one trace: one HTML file with its figures in it."""

from __future__ import annotations

from dataclasses import dataclass

from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import from_plain
from hysteresis.records.metrics import Errors
from studies.report.parts.traced import trace_command, trace_plates
from studies.report.plots import draw
from studies.report.templates import environment
from studies.results.made import Made
from studies.results.trace import WHAT, StoredTrace
from studies.results.trace_samples import TraceSamples
from validation.tracing import catalogue
from validation.tracing.result import TraceReport, in_words, share_words


@dataclass(frozen=True)
class ErrorRow:
    """A row of the table of errors; ``over_noise`` is the rms error over the noise floor, None where that is 0."""

    name: str
    errors: Errors
    over_noise: float | None


@dataclass(frozen=True)
class ParameterRow:
    """A row of the table of parameters: effect or baseline, name, and value with its interval."""

    of: str
    name: str
    parameter: Parameter


def trace_page(report: TraceReport, samples: TraceSamples, made: Made | None = None) -> str:
    """HTML page of a trace; its charts are drawn from the samples of its records and references.

    ``made`` says how the trace came about, and stands at the top of the page.
    """
    names = {name for effect in report.effects for name in (effect.name, *effect.confusable_with)}
    stored = from_plain(StoredTrace, report.to_dict(), WHAT)
    return (
        environment()
        .get_template("trace-page.html")
        .render(
            t=report,
            words=in_words(report),
            share=share_words(report.explained_share),
            errors=_error_rows(report),
            parameters=_parameter_rows(report),
            effects=[effect for effect in catalogue() if effect.name in names],
            plates=[draw(plate) for plate in trace_plates(stored, samples)],
            made=made,
            command=trace_command(report.records, report.reference) if made is None else made.command,
            named=report.named,
            alike=f"{report.alike:.0f}",
        )
    )


def _error_rows(report: TraceReport) -> list[ErrorRow]:
    """Rows of the table of errors: of the baseline, and of the augmented model where there is one."""
    models = [("baseline model", report.before), (f"with {report.named}", report.after)][: 2 if report.named else 1]
    rows = [
        (f"{model}, {words}", errors)
        for model, pair in models
        for words, errors in (("held out", pair.heldout), ("fitted", pair.train))
    ]
    if report.multibody is not None:
        both = (report.multibody.before, report.multibody.after)
        rows += [(f"{model}, multibody", errors) for (model, _), errors in zip(models, both, strict=False)]
    floor = report.noise_floor_deg
    return [ErrorRow(name, errors, errors.rmse_deg / floor if floor else None) for name, errors in rows]


def _parameter_rows(report: TraceReport) -> list[ParameterRow]:
    tables = [
        *((effect.name, effect.parameters) for effect in report.effects),
        ("baseline model", report.baseline),
        ("file of the rig", report.declared),
    ]
    return [ParameterRow(of, name, parameter) for of, table in tables for name, parameter in table.items()]

"""Traces of the measured records, one group of records per rig."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from hysteresis import read_record
from validation.tracing import trace_records
from validation.tracing.figures import residual_figure
from validation.tracing.next_experiment import next_experiment
from validation.tracing.result import TraceReport, trace_report
from validation.tracing.second_opinion import second_opinion

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
"""Files of the records of one rig, by name; those of a group are traced in one call."""
_DPI = 80


def trace_group(paths: Sequence[Path], threads: int) -> tuple[TraceReport, bytes]:
    """Trace records: the report with the time it took, and the figure of the residuals as PNG."""
    start = time.perf_counter()
    trace = trace_records([read_record(path) for path in paths], threads=threads)
    seconds = time.perf_counter() - start
    report = trace_report(trace, experiment=next_experiment(trace), opinion=second_opinion(trace), seconds=seconds)
    return report, residual_figure(trace, dpi=_DPI)

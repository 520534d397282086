"""One device over days or uses: its parameters record by record, a control chart, change points, and limits."""

from hysteresis.drift.changes import ChangePoint, change_points
from hysteresis.drift.chart import Chart, control_chart
from hysteresis.drift.passing import Passing, when_passed
from hysteresis.drift.states import DeviceState, states_of

__all__ = [
    "ChangePoint",
    "Chart",
    "DeviceState",
    "Passing",
    "change_points",
    "control_chart",
    "states_of",
    "when_passed",
]

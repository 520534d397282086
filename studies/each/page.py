"""The page of many devices: what they have in common, which are unlike the others, and which could not be fitted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.each.result import EachResult, FittedDevice
from studies.report.charts import Chart, Line, Plate
from studies.report.plots import draw
from studies.report.templates import environment

HERE = Path(__file__).parent
SHOWN = ("saturation_deg", "slope_after_reversal", "reach_deg", "A", "n", "zero_deg")
"""Parameters that have a chart."""
UNLIKE = 5.0
"""Distance from the median, over the usual one and the device's own interval, from which a device is unlike others."""
MOST_UNLIKE = 20
CAPTION = (
    "Points: one device each, in the order of its value, with its 95 % interval. Devices whose record does not fix the "
    "parameter are left out."
)


@dataclass(frozen=True)
class Unlike:
    """A device with a parameter far from that of the others."""

    record: str
    name: str
    value: float
    unit: str
    times: float


def each_page(found: EachResult, table: str) -> str:
    """Give the HTML page of a result, whose table has this name."""
    charts = tuple(chart for name in SHOWN for chart in _charts(found, name))
    plates = [draw(Plate(charts, CAPTION, columns=2))] if charts else []
    names = {one.record: Path(one.record).name for one in found.devices}
    template = environment(HERE).get_template("each.html")
    return template.render(f=found, made=found.made, plates=plates, unlike=unlike(found), names=names, table=table)


def _charts(found: EachResult, name: str) -> list[Chart]:
    known = sorted((one.parameters[name] for one in found.fitted if name in one.fixed), key=lambda one: one.value)
    if len(known) < 2:
        return []
    values = np.array([one.value for one in known])
    halves = np.array([0.5 * ((one.high or 0.0) - (one.low or 0.0)) for one in known])
    unit = "" if known[0].unit == "1" else f", {known[0].unit}"
    alt = f"{name} of {len(known)} devices: from {values[0]:.3g} to {values[-1]:.3g}, median {np.median(values):.3g}."
    line = Line(np.arange(1.0, len(known) + 1), values, name, "blue", "points", spread=halves)
    return [Chart(name, "devices", f"{name}{unit}", (line,), alt)]


def unlike(found: EachResult) -> list[Unlike]:
    """Find the devices that are unlike the others, the farthest first.

    The usual distance is the median of the absolute distances, times 1.4826; a wide interval of the device adds to it.
    """
    out = list[Unlike]()
    for name in dict.fromkeys(name for one in found.fitted for name in one.parameters):
        known = [one for one in found.fitted if name in one.fixed and not name.startswith("h0_deg")]
        if len(known) >= 5:
            values = np.array([one.parameters[name].value for one in known])
            away = np.abs(values - np.median(values))
            usual = 1.4826 * float(np.median(away))
            times = away / np.maximum(np.hypot(usual, [_sigma(one, name) for one in known]), 1e-300)
            out += [
                Unlike(one.record, name, one.parameters[name].value, one.parameters[name].unit, float(far))
                for one, far in zip(known, times, strict=True)
                if far > UNLIKE
            ]
    return sorted(out, key=lambda one: -one.times)[:MOST_UNLIKE]


def _sigma(one: FittedDevice, name: str) -> float:
    low, high = one.parameters[name].low, one.parameters[name].high
    return 0.0 if low is None or high is None else 0.25 * (high - low)

"""The report page: one HTML file with everything in it, made from the stored results of a run."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import jinja2
import numpy as np

from hysteresis.files import write_files
from hysteresis.record import RecordError, read_record
from studies.report.figures import Series, fit_figure, loops_figure


def write_report(folder: Path) -> Path:
    """Write ``report.html`` into a folder that ``notchbend run`` has filled; return its path.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    run = _json(folder / "run.json")
    records = {loop["record"]: read_record(folder / "records" / f"{loop['record']}.csv") for loop in run["loops"]}
    theories = [read_record(folder / "records" / f"{loop['theory']}.csv") for loop in run["loops"]]
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["sig"] = significant
    labels = [f"{loop['record'].split('-')[-1].removesuffix('N')} N preload" for loop in run["loops"]]
    html = environment.get_template("template.html").render(
        run=run,
        loops_svg=loops_figure(list(records.values()), labels, theories),
        fits=[_fit(folder, item) for item in run["fits"]],
        picture=_picture(folder, run["picture"]),
    )
    path = folder / "report.html"
    write_files({path: html})
    return path


def significant(value: object, digits: int = 3) -> str:
    """Format a number with a few significant digits, without exponent for everyday sizes; other values as text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return "" if value is None else str(value)
    if value == 0 or isinstance(value, int):
        return str(value)
    size = abs(value)
    if 1e-3 <= size < 1e6:
        decimals = max(0, digits - 1 - int(np.floor(np.log10(size))))
        return f"{value:.{decimals}f}"
    return f"{value:.{digits - 1}e}"


def _fit(folder: Path, item: dict[str, Any]) -> dict[str, Any]:
    fit = _json(folder / f"identify-{item['name']}.json")
    path = folder / f"identify-{item['name']}.csv"
    try:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the samples of a fit; run `notchbend run` again") from None
    drive, angle, base, predicted, heldout = table.T
    series = Series(drive, angle, base, predicted, heldout != 0)
    unit = read_record(folder / "records" / f"{item['record']}.csv").drive_unit
    before, after = fit["baseline"]["heldout"]["rmse_deg"], fit["heldout"]["rmse_deg"]
    floor = fit["noise_floor_deg"]
    return {
        **item,
        "fit": fit,
        "svg": fit_figure(series, unit),
        "gain": before / after if after > 0 else None,
        "over_floor": after / floor if floor > 1e-3 else None,  # a record without noise has no floor,
    }


def _picture(folder: Path, picture: dict[str, str]) -> dict[str, str]:
    if "file" not in picture:
        return picture
    try:
        data = (folder / picture["file"]).read_bytes()
    except OSError as error:
        raise RecordError(f"{folder / picture['file']}: {error.strerror}: expected the picture of the run") from None
    return {**picture, "data": base64.b64encode(data).decode()}


def _json(path: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected results of `notchbend run`") from None
    except ValueError as error:
        raise RecordError(f"{path}: not JSON: {error}") from None

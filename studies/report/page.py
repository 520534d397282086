"""The report: one HTML file with everything in it, made from what stands in a folder of results.

Every part is shown where its results stand in the folder, and left out where they do not.
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from plotly.offline import get_plotlyjs

from hysteresis.files import write_files
from hysteresis.record import RecordError
from hysteresis.record_file import read_record
from studies.report import summary
from studies.report.plots import Drawn, Series, columns_plate, draw, fit_plate, loops_plate, parts_plate
from studies.report.study import StudySection, read_front, read_json, read_study
from studies.report.summary import Verdict
from studies.report.templates import environment
from studies.report.tube import VIEWS, read_tube

TEMPLATES = Path(__file__).parent / "template"
PARTS = ("run.json", "separate.json", "trace.json", "study.zarr", "pareto.json")
"""What makes a folder one of results; any of them is enough for a page."""


def stands_alone(folder: Path) -> bool:
    """Whether a folder has results that are not those of a main run, whose records have to be what they were."""
    return not (folder / "run.json").exists() and any((folder / name).exists() for name in PARTS)


def write_report(folder: Path) -> Path:
    """Write ``report.html`` into a folder of results; return its path.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    if not any((folder / name).exists() for name in PARTS):
        raise RecordError(f"{folder}: none of {', '.join(PARTS)}: expected results of a notchbend command")
    path = folder / "report.html"
    write_files({path: environment(TEMPLATES).get_template("page.html").render(**contents(folder))})
    return path


def contents(folder: Path) -> dict[str, Any]:
    """Give what the template takes, each part None or empty where the folder has none of it.

    Raises
    ------
    RecordError
        One line with the file that is missing or cannot be read.
    """
    run = _run(folder) if (folder / "run.json").exists() else None
    separations, traces = _separations(folder, run), _traces(folder)
    study, front = read_study(folder), read_front(folder / "pareto.json")
    study_command = study.command if study is not None else "notchbend study STUDY.toml --out DIR"
    verdicts: list[Verdict] = []
    if run is not None:
        verdicts += summary.run_verdicts(run, run["fits"], run["command"])
    verdicts += [summary.separation_verdict(s["result"], s["label"], s["command"]) for s in separations]
    verdicts += [summary.trace_verdict(t["result"], t["command"]) for t in traces]
    if study is not None:
        verdicts.append(summary.study_verdict(study.size, study.cases, study.failed, study.pending, study_command))
    if front is not None:
        verdicts.append(summary.front_verdict(len(front.rows), front.objectives, study_command))
    return {
        "title": _title(folder, run, study),
        "verdicts": verdicts,
        "run": run,
        "separations": separations,
        "traces": traces,
        "study": study,
        "study_plates": [draw(plate) for plate in study.plates] if study else [],
        "study_command": study_command,
        "front": front,
        "front_plate": draw(front.plate) if front else None,
        "versions": (run or {}).get("versions") or (study.facts.get("versions") if study else None) or {},
        "views": list(VIEWS),
        "plotly": get_plotlyjs(),
        "style": _text("style.css"),
        "script": _text("page.js"),
    }


def _text(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


def _title(folder: Path, run: Mapping[str, Any] | None, study: StudySection | None) -> str:
    if run is not None:
        return str(run["loops"][-1]["title"]).split(",")[0]
    return study.title if study is not None else folder.resolve().name


def _run(folder: Path) -> dict[str, Any]:
    """Read a main run with its charts, its fits, and the tube."""
    run = read_json(folder / "run.json")
    try:
        loops, theories = (
            [read_record(folder / "records" / f"{loop[key]}.csv") for loop in run["loops"]]
            for key in ("record", "theory")
        )
        labels = [f"{check['preload_N']:g} N" for check in run["crosscheck"]]
        command = f"notchbend run --out DIR --seed {run['seed']}"
        return {
            **run,
            "command": command,
            "loops_plate": draw(loops_plate(loops, labels, theories)),
            "fits": [_fit(folder, item, run["seed"], command) for item in run["fits"]],
            "picture": _picture(folder, run["picture"]),
            "simulate": [_simulate_command(check) for check in run["crosscheck"]],
        }
    except KeyError as error:
        raise RecordError(f"{folder / 'run.json'}: {error}: missing; run `notchbend run` again") from None


def _simulate_command(check: Mapping[str, Any]) -> str:
    return (
        f"notchbend simulate --preset {check['rig']} --preload {check['preload_N']:g} "
        f"--amplitude {check['amplitude_mm']:g} --cycles 3 --out loop.csv"
    )


def _fit(folder: Path, item: Mapping[str, Any], seed: int, command: str) -> dict[str, Any]:
    path = folder / f"identify-{item['name']}.csv"
    fit = read_json(path.with_suffix(".json"))
    if not fit:
        raise RecordError(f"{path.with_suffix('.json')}: No such file: expected results of `notchbend run`")
    try:
        table = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError) as error:
        raise RecordError(f"{path}: {error}: expected the samples of a fit; run `notchbend run` again") from None
    drive, angle, base, predicted, heldout = table.T
    series = Series(drive, angle, base, predicted, heldout != 0)
    unit = read_record(folder / "records" / f"{item['record']}.csv").drive_unit
    before, after = fit["baseline"]["heldout"]["rmse_deg"], fit["heldout"]["rmse_deg"]
    floor = fit["noise_floor_deg"]
    again = f"notchbend identify DIR/records/{item['record']}.csv --out DIR/again --seed {seed}"
    return {
        **item,
        "fit": fit,
        "plate": draw(fit_plate(series, unit, item["name"])),
        "gain": before / after if after > 0 else None,
        "over_floor": after / floor if floor > 1e-3 else None,  # a record without noise has no floor,
        # a record whose rig was left out on purpose is fitted by the run alone
        "command": again if item["name"] == item["record"] else command,
    }


def _picture(folder: Path, picture: Mapping[str, str]) -> dict[str, str]:
    """Read the picture of the tube for paper and, where it was stored, the tube to turn."""
    out = dict(picture)
    if "file" in picture:
        out["data"] = _image(folder / picture["file"])
    if "tube" in picture:
        try:
            out["view"] = read_tube(folder / picture["tube"])
        except (OSError, ValueError) as error:
            raise RecordError(f"{folder / picture['tube']}: {error}: expected the tube of the run") from None
    return out


def _separations(folder: Path, run: Mapping[str, Any] | None) -> list[dict[str, Any]]:
    listed = [] if run is None else run.get("separations", [])
    found = [(item["label"], item["command"], folder / item["file"]) for item in listed]
    alone = folder / "separate.json"
    if alone.exists():
        found.append(("the rig of separate.json", "notchbend separate --out DIR", alone))
    out = []
    for label, command, path in found:
        result = read_json(path)
        if "contributions" not in result:
            raise RecordError(f"{path}: contributions: missing, expected the result of `notchbend separate`")
        if path == alone:
            label, command = _own_words(result)
        plate = parts_plate(result)
        out.append({"label": label, "command": command, "result": result, "plate": draw(plate) if plate else None})
    return out


def _own_words(result: Mapping[str, Any]) -> tuple[str, str]:
    rig, (_, high) = result["rig"], result["drive_mm"]
    if result["calibration"] is not None:
        return f"{rig['name']}, calibrated on records", "notchbend separate RECORD --out DIR"
    options = f"--preload {rig['preload_N']:g} --amplitude {high:g} --engine {result['engine']}"
    return (
        f"{rig['name']}, {rig['preload_N']:g} N, {high:g} mm",
        f"notchbend separate --preset {rig['name']} {options} --out DIR",
    )


def _traces(folder: Path) -> list[dict[str, Any]]:
    """Every stored trace with the figures beside it."""
    out = []
    for path in sorted(folder.glob("trace*.json")):
        result = read_json(path)
        if "verdict" not in result:
            raise RecordError(f"{path}: verdict: missing, expected the result of `notchbend trace`")
        records = " ".join(Path(str(record)).name for record in result.get("records", ()))
        figures = [_figure(folder, item, path) for item in result.get("figures", ())]
        command = f"notchbend trace {records} --out DIR"
        out.append({"name": path.stem, "records": records, "result": result, "figures": figures, "command": command})
    return out


def _figure(folder: Path, item: Mapping[str, Any], path: Path) -> dict[str, Any]:
    """Read a picture (PNG), or a CSV whose first column is drawn against the others."""
    try:
        file, caption = folder / item["file"], str(item.get("caption", ""))
    except (KeyError, TypeError):
        raise RecordError(f"{path}: figures: {item!r}: expected a table with file and caption") from None
    if file.suffix == ".png":
        return {"caption": caption, "image": _image(file), "plate": None}
    return {"caption": caption, "image": None, "plate": _columns(file, caption)}


def _columns(file: Path, caption: str) -> Drawn:
    try:
        names = file.read_text(encoding="utf-8").splitlines()[0].split(",")
        table = np.loadtxt(file, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, ValueError, IndexError) as error:
        raise RecordError(f"{file}: {error}: expected a PNG, or a CSV with a header and numbers") from None
    if table.shape[1] != len(names) or len(names) < 2:
        raise RecordError(f"{file}: {len(names)} names over {table.shape[1]} columns: expected two or more alike")
    return draw(columns_plate(table, names, caption))


def _image(path: Path) -> str:
    try:
        return base64.b64encode(path.read_bytes()).decode()
    except OSError as error:
        raise RecordError(f"{path}: {error.strerror}: expected a picture beside the results") from None

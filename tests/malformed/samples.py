"""Good files of every kind that a command reads, which :mod:`tests.malformed.spoil` spoils."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import zarr
from results_folder import write_run, write_study, write_trace

from fem_models.chain.solve import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis import identify
from hysteresis.fitting.settings import IdentifySettings
from studies.commands.identification import write_fit
from studies.results.manifest import KEY, digests

RIG = """name = "mine"
preload_N = 10.0
[tube]
outer_diameter_mm = 1.62
inner_diameter_mm = 1.40
[notch]
shape = "rectangular"
count = 5
depth_mm = 1.2
width_mm = 0.8
spacing_mm = 1.2
[material]
youngs_modulus_GPa = 60.0
[tendon]
EA_N = 5000.0
moment_arm_mm = 0.6
free_length_mm = 200.0
[wheel]
radius_mm = 10.0
[friction]
capstan_coefficient = 0.1
[slack]
tendon_a_mm = 0.1
[eccentricity]
amplitude_mm = 0.1
"""
SIDECAR = """schema = 1
title = "bench"
kind = "measured"
[columns]
drive = "drive_mm"
angle = "angle_deg"
time = "time_s"
[drive]
unit = "mm"
[rig]
file = "mine.toml"
preload_N = 10.0
[kinematics]
file = "theory.csv"
"""
STUDY = """schema = 1
title = "small"
engine = "analytic"
[rig]
file = "mine.toml"
[program]
amplitude_mm = 0.3
step_mm = 0.1
[vary]
preload_N = [5.0, 10.0]
"notch.width_mm" = { from = 0.5, to = 0.8, count = 2 }
[quantities]
groups = ["loop", "strain"]
[sensitivity]
count = 8
quantities = ["full_scale_angle_deg"]
[pareto]
population = 8
generations = 2
[pareto.objectives]
full_scale_angle_deg = "max"
peak_strain_percent = "min"
[pareto.limits]
tension_max_N = { max = 40.0 }
"""


@dataclass(frozen=True)
class Reader:
    """A reader: the folder of good files, those of them that are spoiled, and the command that reads them."""

    name: str
    folder: Path
    files: tuple[str, ...]
    arguments: Callable[[Path], list[str]]


def readers(folder: Path, *, stored: bool = True) -> list[Reader]:
    """Make the good files, and give every reader of them; without ``stored`` only those of what a user writes."""
    records, fits, study = (folder / name for name in ("records", "fits", "study"))
    for one in (records, fits, study):
        one.mkdir(parents=True)
    _records(records)
    _fits(fits)
    _records(study)
    (study / "study.toml").write_text(STUDY)
    out = "out"
    simulate = ["simulate", "--engine", "chain", "--quiet", "--out"]
    own = [
        Reader("record", records, ("loop.csv", "loop.toml", "theory.csv", "mine.toml"),
               lambda at: ["separate", str(at / "loop.csv"), "--out", str(at / out), "--quiet"]),
        Reader("rig file", records, ("mine.toml",),
               lambda at: [*simulate, str(at / "x.csv"), "--rig", str(at / "mine.toml"), "--amplitude", "0.2"]),
        Reader("load program", records, ("program.csv",),
               lambda at: [*simulate, str(at / "x.csv"), "--preset", "du2018", "--program", str(at / "program.csv")]),
        Reader("study file", study, ("study.toml", "mine.toml"),
               lambda at: ["study", str(at / "study.toml"), "--out", str(at / out), "--quiet"]),
        Reader("fit and reference", fits, ("identify.json", "reference.csv"),
               lambda at: ["compensate", str(at / "identify.json"), "--reference", str(at / "reference.csv"),
                           "--out", str(at / "drive.csv"), "--quiet"]),
    ]  # fmt: skip
    return [*own, *_stored(folder)] if stored else own


def _stored(folder: Path) -> list[Reader]:
    run, trace, study = (folder / name for name in ("run", "trace", "results"))
    for one in (run, trace, study):
        one.mkdir()
    write_run(run)
    write_trace(trace)
    write_study(study)
    store = study / "study.zarr"
    zarr.open_group(store, mode="r+").attrs[KEY] = json.dumps(digests(store))
    return [
        Reader(f"stored {name}", at, _files(at), _report)
        for name, at in (("run", run), ("trace", trace), ("study", study))
    ]


def _report(at: Path) -> list[str]:
    return ["report", str(at), "--quiet"]


def _files(folder: Path) -> tuple[str, ...]:
    return tuple(path.relative_to(folder).as_posix() for path in sorted(folder.rglob("*")) if path.is_file())


def _records(folder: Path) -> None:
    (folder / "mine.toml").write_text(RIG)
    (folder / "loop.toml").write_text(SIDECAR)
    drive = np.concatenate([np.linspace(0, 0.3, 6), np.linspace(0.3, -0.3, 12)[1:], np.linspace(-0.3, 0.3, 12)[1:]])
    rows = [f"{0.1 * i:.2f},{x:.4f},{40 * x + (2 if i % 2 else -2) * 0.1:.4f}" for i, x in enumerate(drive)]
    (folder / "loop.csv").write_text("\n".join(["time_s,drive_mm,angle_deg", *rows]) + "\n")
    (folder / "theory.csv").write_text("drive_mm,angle_deg\n-1,-40\n0,0\n1,40\n")
    (folder / "program.csv").write_text("time_s,drive_mm\n0,0\n1,0.5\n2,-0.5\n3,0.5\n")


def _fits(folder: Path) -> None:
    record = simulate_chain(preset("du2018"), triangle(2.2, cycles=2))
    write_fit(identify(record, settings=IdentifySettings(method="least-squares")), [record], folder, "identify")
    (folder / "reference.csv").write_text("time_s,angle_deg\n0,0\n1,10\n2,0\n3,-10\n")

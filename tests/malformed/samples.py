"""Good files of every kind that a command reads, which :mod:`tests.malformed.spoil` spoils."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import zarr
from results_folder import write_run, write_study, write_trace

from fem_models.chain.solve import simulate_chain
from fem_models.load import triangle
from fem_models.rig import preset
from hysteresis import identify
from hysteresis.fitting.settings import IdentifySettings
from studies.commands.cli import call
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
WRIST = """name = "wrist"
preload_N = 5.0
[tube]
outer_diameter_mm = 3.5
inner_diameter_mm = 2.74
[notch]
shape = "rectangular_pair"
count = 4
depth_mm = 1.6
width_mm = 0.6
spacing_mm = 0.4
turn_deg = [0, 90, 0, 90]
[material]
youngs_modulus_GPa = 60.0
[tendon]
EA_N = 5000.0
moment_arm_mm = 1.5
free_length_mm = 200.0
[tendons]
angles_deg = [0, 180, 90, 270]
wheels = [1, 1, 2, 2]
[wheel]
radius_mm = 10.0
[friction]
capstan_coefficient = 0.1
[tip_load]
force_N = [0.0, 0.01, 0.02]
[gravity]
ring_mass_g = 0.1
direction = [0, -1, 0]
[tip_mass]
mass_g = 2
direction = [0, -1, 0]
"""
SIDECAR_IN_SPACE = """schema = 1
title = "two planes"
[columns]
drive = "drive_mm"
drive_2 = "drive_2_mm"
angle = "angle_deg"
angle_2 = "angle_2_deg"
torsion = "torsion_deg"
tension_a = "a_N"
tension_b = "b_N"
tension_c = "c_N"
tension_d = "d_N"
tip = ["x_mm", "y_mm", "z_mm"]
time = "time_s"
[rig]
file = "wrist.toml"
preload_N = 5.0
"""
STUDY_IN_SPACE = """schema = 1
title = "two planes"
[rig]
file = "wrist.toml"
[program]
amplitude_mm = 0.1
step_mm = 0.05
[vary]
preload_N = [5.0, 6.0]
"notch.turn_step_deg" = [0.0, 1.0]
[quantities]
groups = ["planes", "workspace", "compliance"]
"""
WANTED_IN_SPACE = "time_s,angle_deg,angle_2_deg\n0,0,0\n1,1,0.5\n2,0,1\n3,-1,0\n4,0,0\n"
BENCH = "# bench\nstroke_mm;angle_deg;note\n" + "".join(
    f"{x / 10:.1f};{4 * x};a\n".replace(".", ",") for x in (0, 1, 2, 3, 2, 1, 0, -1, -2, -3, -2, -1, 0, 1, 2, 3)
)


@dataclass(frozen=True)
class Reader:
    """A reader: the folder of good files, those of them that are spoiled, and the command that reads them."""

    name: str
    folder: Path
    files: tuple[str, ...]
    arguments: Callable[[Path], list[str]]


def readers(folder: Path, *, stored: bool = True) -> list[Reader]:
    """Make the good files, and give every reader of them; without ``stored`` only those of what a user writes."""
    records, fits, study, space = (folder / name for name in ("records", "fits", "study", "space"))
    for one in (records, fits, study, space):
        one.mkdir(parents=True)
    _in_space(space)
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
        Reader("rig in space", space, ("wrist.toml",),
               lambda at: [*simulate, str(at / "x.csv"), "--rig", str(at / "wrist.toml"), "--amplitude", "0.1"]),
        *(Reader(f"{name} in space", space, (file,), partial(_program, simulate, file))
          for name, file in (("program", "program.csv"), ("tensions", "tensions.csv"))),
        Reader("record in space", space, ("loop.csv", "loop.toml", "wrist.toml"),
               lambda at: ["trace", str(at / "loop.csv"), "--out", str(at / out), "--quiet"]),
        Reader("reference in space", space, ("wanted.csv",),
               lambda at: ["compensate", str(at / "wrist.toml"), "--reference", str(at / "wanted.csv"),
                           "--out", str(at / "drives.csv"), "--quiet"]),
        Reader("study in space", space, ("study.toml",),
               lambda at: ["study", str(at / "study.toml"), "--out", str(at / out), "--quiet"]),
        Reader("CSV of the bench", records, ("bench.csv", "mine.toml"),
               lambda at: ["record", "new", str(at / "bench.csv"), "--rig", str(at / "mine.toml"),
                           "--out", str(at / "new.csv"), "--quiet"]),
    ]  # fmt: skip
    return [*own, *_stored(folder)] if stored else own


def _program(simulate: list[str], file: str, at: Path) -> list[str]:
    return [*simulate, str(at / "x.csv"), "--rig", str(at / "wrist.toml"), "--program", str(at / file)]


def _in_space(folder: Path) -> None:
    (folder / "wrist.toml").write_text(WRIST)
    (folder / "program.csv").write_text("time_s,drive_1_mm,drive_2_mm\n0,0,0\n1,0.1,0\n2,0.1,-0.1\n3,-0.1,0\n")
    (folder / "tensions.csv").write_text("tension_1_N,tension_2_N,tension_3_N,tension_4_N\n5,5,5,5\n6,5,5,5\n5,5,6,4\n")
    (folder / "loop.toml").write_text(SIDECAR_IN_SPACE)
    (folder / "study.toml").write_text(STUDY_IN_SPACE)
    (folder / "wanted.csv").write_text(WANTED_IN_SPACE)
    columns = [
        "time_s",
        "drive_mm",
        "drive_2_mm",
        "angle_deg",
        "angle_2_deg",
        "torsion_deg",
        "a_N",
        "b_N",
        "c_N",
        "d_N",
    ]
    rows = []
    for i in range(49):
        x = 0.1 * (abs(((i + 12) / 12) % 4 - 2) - 1)
        values = [0.1 * i, x, 0, 20 * x, 0.5 * x, 0.1 * x, 5 - 20 * x, 5 + 20 * x, 5, 5, 4 - x * x, x, 0.1 * x]
        rows.append(",".join(f"{value:.5f}" for value in values))
    (folder / "loop.csv").write_text("\n".join([",".join([*columns, "x_mm", "y_mm", "z_mm"]), *rows]) + "\n")


def _stored(folder: Path) -> list[Reader]:
    run, trace, study = (folder / name for name in ("run", "trace", "results"))
    wrist, loop = str(folder / "space" / "wrist.toml"), str(folder / "records" / "loop.csv")
    wanted, turned = str(folder / "space" / "wanted.csv"), str(folder / "space" / "loop.csv")
    made = {
        "wrist": (["run", "--rig", wrist, "--amplitude", "0.1"], ""),
        "workspace": (["workspace", "--rig", wrist, "--amplitude", "0.1"], ""),
        "compensation": (["compensate", wrist, "--reference", wanted], "drives.csv"),
        "trace in space": (["trace", turned], ""),
        "fit": (["identify", loop], ""),
        "separation": (["separate", "--preset", "du2018"], ""),
    }
    for name, (command, file) in made.items():
        assert call([*command, "--out", str(folder / name / file), "--quiet"]) == 0
        (folder / name / "report.html").unlink(missing_ok=True)
    for one in (run, trace, study):
        one.mkdir()
    write_run(run)
    write_trace(trace)
    write_study(study)
    store = study / "study.zarr"
    zarr.open_group(store, mode="r+").attrs[KEY] = json.dumps(digests(store))
    return [
        Reader(f"stored {name}", at, _files(at), _report)
        for name, at in (("run", run), ("trace", trace), ("study", study), *((name, folder / name) for name in made))
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
    (folder / "bench.csv").write_text(BENCH)
    (folder / "program.csv").write_text("time_s,drive_mm\n0,0\n1,0.5\n2,-0.5\n3,0.5\n")


def _fits(folder: Path) -> None:
    record = simulate_chain(preset("du2018"), triangle(2.2, cycles=2))
    write_fit(identify(record, settings=IdentifySettings(method="least-squares")), [record], folder, "identify")
    (folder / "reference.csv").write_text("time_s,angle_deg\n0,0\n1,10\n2,0\n3,-10\n")

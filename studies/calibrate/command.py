"""``notchbend calibrate``: write the program, and say what it is expected to give."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from hysteresis.files import RecordError, write_files
from hysteresis.own import marked_values
from hysteresis.plain import to_plain
from studies.calibrate.excitation import STRAIN_PERCENT, Calibration, Demands, calibration
from studies.commands.options import Common, Overwrite, RigChoice
from studies.own_rig.strain import drive_to_angle_mm
from studies.progress import status
from studies.results.made import made_now

ENDING = "-calibrate.json"


@dataclass(frozen=True)
class DemandsChoice:
    """What a calibration has to meet."""

    amplitude: Annotated[
        float | None,
        typer.Option("--amplitude", help="Drive that the compensator has to reach, mm; by default that to 45 deg."),
    ] = None
    error: Annotated[
        float | None,
        typer.Option("--error", help="Error that noise may cause, deg; by default a fiftieth of the loop's width."),
    ] = None
    noise: Annotated[float, typer.Option("--noise", help="Noise of the angle, deg.")] = 0.05
    resolution: Annotated[float, typer.Option("--resolution", help="Step of the angle's sensor, deg.")] = 0.0
    speed: Annotated[float, typer.Option("--speed", help="Speed of the drive, mm/s.")] = 0.5
    rate: Annotated[float, typer.Option("--rate", help="Samples a second.")] = 20.0
    minutes: Annotated[float, typer.Option("--minutes", help="Longest motion, min.")] = 5.0
    strain: Annotated[
        float | None,
        typer.Option("--strain", help=f"Largest strain of a flexure, %; by default {STRAIN_PERCENT:g}."),
    ] = None
    tension: Annotated[
        float | None,
        typer.Option("--tension", help="Largest tension of a tendon, N; by default three times the preload."),
    ] = None


def calibrate(
    *,
    rig: RigChoice,
    out: Annotated[Path, typer.Option("--out", help="The program to write, CSV of drive_mm and time_s.")],
    demands: DemandsChoice,
    replacing: Overwrite,
    common: Common,
) -> None:
    """Find the shortest motion of a rig that fixes its compensator, within limits of strain and tension."""
    if out.suffix.lower() != ".csv":
        raise RecordError(f"--out {out}: expected a name that ends in .csv")
    summary = out.with_name(out.stem + ENDING)
    replacing.allow([out, summary])
    chosen, made = rig.read(), made_now(common.command)
    wanted = Demands(
        amplitude_mm=drive_to_angle_mm(chosen) if demands.amplitude is None else demands.amplitude,
        error_deg=demands.error,
        noise_deg=demands.noise,
        resolution_deg=demands.resolution,
        speed_mm_per_s=demands.speed,
        rate_Hz=demands.rate,
        minutes=demands.minutes,
        strain_percent=demands.strain,
        tension_N=demands.tension,
    )
    with status(common.shows_progress, f"calibrating {chosen.name}"):
        found = replace(calibration(chosen, wanted, out.name), made=made)
    write_files({summary: _stored(found), out: program_csv(found)})
    then = f"then: notchbend export RECORD.csv --to c --out {shlex.quote('firmware')}"
    common.show(found, *found.lines(), f"program: {out}", then)


def program_csv(found: Calibration) -> str:
    """Give the program as text, which ``notchbend simulate --program`` and benches read."""
    rows = zip(found.drive_mm, found.time_s, strict=True)
    return "\n".join(["drive_mm,time_s", *(f"{drive:.6g},{time:.9g}" for drive, time in rows)]) + "\n"


def _stored(found: Calibration) -> str:
    """Give the summary; the samples are in the program, which it names."""
    values = to_plain(found)
    return (
        json.dumps(marked_values({k: v for k, v in values.items() if k not in ("drive_mm", "time_s")}), indent=2) + "\n"
    )

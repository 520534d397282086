"""From no knowledge of a bench to a compensator in C: a rig file, `calibrate`, a motion, `export RECORD --to c`.

    python benchmarks/calibrated_compensators.py --seed 11 --rigs 6 --out scores.jsonl

The benches are lumped rigs, which share no code with the models and the laws. Their rig file has measured joints with
errors of 3 %. The angle has noise and steps of 14 bits, the drive is read by an encoder of 4,096 steps a turn. The C
file is compiled, and its drives for a reference that no fit has seen move the rig from rest.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fem_models.rig.of_record import declared_rig_of
from hysteresis.arrays import Floats
from hysteresis.laws.inverse import inverse_curve
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_columns, write_record
from studies.app.files import rig_text
from studies.commands.cli import call
from studies.commands.compensation import read_layer
from validation.practice.lumped.cases import _told_rig, drawn_rig
from validation.practice.lumped.reidentified import reference_cycle
from validation.practice.lumped.rig import LumpedRig, simulate_lumped

NOISE_DEG, STEP_DEG, COUNTS = 0.05, 360 / 2**14, 4096
AMPLITUDE_MM = 1.8
TICK_S = 0.05


def stepped(values: Floats, step: float) -> Floats:
    """Round to the steps of an encoder."""
    return np.round(values / step) * step


def measured(rig: LumpedRig, drive: Floats, time: Floats, rng: np.random.Generator) -> Record:
    """Run a program on the bench."""
    angle = simulate_lumped(rig, drive, time, np.zeros(drive.size, dtype=np.int64))[0]
    seen = stepped(angle + rng.normal(0.0, NOISE_DEG, angle.size), STEP_DEG)
    read = stepped(drive, 2 * np.pi * rig.wheel_radius_mm / COUNTS)
    return Record(drive=read, angle_deg=seen, time_s=time, kind="simulated", title="calibration of a made bench")


@dataclass(frozen=True)
class Bench:
    """What one bench gave: minutes of motion, errors in deg, and the factor between them."""

    bench: int
    minutes: float
    expected_deg: float
    law: str
    heldout_deg: float
    without_deg: float
    with_deg: float
    factor: float


def one_bench(number: int, seed: int, folder: Path) -> Bench:
    """Make a bench, calibrate it, export the compensator, and follow a reference."""
    rng = np.random.default_rng((seed, number))
    rig = replace(drawn_rig(rng), preload_N=20.0)
    told = _told_rig(rig, rng) | {"preload_N": 20.0}
    declared = declared_rig_of(Record(drive=[0, 1, 0], angle_deg=[0, 1, 0], rig=told))
    assert declared is not None
    (folder / "mine.toml").write_text(rig_text(declared))
    sensor = ["--noise", str(NOISE_DEG), "--resolution", f"{STEP_DEG:.4f}"]
    motion, log, made = folder / "motion.csv", folder / "bench.csv", folder / "firmware"
    _run("calibrate", "--rig", folder / "mine.toml", "--amplitude", AMPLITUDE_MM, *sensor, "--out", motion)
    columns = read_columns(motion, ["drive_mm", "time_s"])
    write_record(measured(rig, columns["drive_mm"], columns["time_s"], rng), log)
    _run("export", log, "--to", "c", "--out", made)
    said = json.loads((folder / "motion-calibrate.json").read_text())
    layer = read_layer(made / "identify.json")
    size = 0.7 * float(np.abs(layer.f(np.array(layer.drive_range))).min())
    wanted = np.concatenate([reference_cycle(size, k) for k in range(4)])
    drives = replayed(made, wanted)
    low, high = layer.drive_range
    plain = inverse_curve(layer.plain, np.clip(wanted, *np.sort(layer.plain(np.array([low, high])))), (low, high))
    errors = [rms(rig, drive, wanted) for drive in (plain, drives)]
    return Bench(
        bench=number,
        minutes=said["duration_s"] / 60,
        expected_deg=said["error_deg"],
        law=json.loads((made / "identify.json").read_text())["law"]["title"],
        heldout_deg=layer.heldout_rmse_deg,
        without_deg=errors[0],
        with_deg=errors[1],
        factor=errors[0] / errors[1],
    )


def _run(*words: object) -> None:
    code = call([*map(str, words), "--quiet"])
    if code:
        raise RuntimeError(f"{words[0]}: exit {code}")


def replayed(folder: Path, wanted: Floats) -> Floats:
    """Compile the C file, and let it answer."""
    program = folder / "replay"
    command = ["cc", "-std=c99", "-O2", "-DCOMPENSATOR_MAIN", "compensator.c", "-o", program.name, "-lm"]
    subprocess.run(command, cwd=folder, check=True)
    text = "\n".join(map(repr, wanted.tolist()))
    done = subprocess.run([str(program)], input=text, capture_output=True, text=True, check=True)
    return np.array([float(line.split(",")[1]) for line in done.stdout.splitlines()[1:]])


def rms(rig: LumpedRig, drive: Floats, wanted: Floats) -> float:
    """Error of the true angle over the whole path from rest, deg."""
    time = TICK_S * np.arange(1.0, drive.size + 1.0)
    angle = simulate_lumped(rig, drive, time, np.zeros(drive.size, dtype=np.int64))[0]
    return float(np.sqrt(np.mean((angle - wanted) ** 2)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print and store a line for each bench."""
    parser = argparse.ArgumentParser(prog="python benchmarks/calibrated_compensators.py", description=__doc__)
    parser.add_argument("--seed", type=int, required=True, help="of the benches and their noise")
    parser.add_argument("--rigs", type=int, default=6, help="how many")
    parser.add_argument("--out", type=Path, required=True, help="lines of JSON, appended")
    options = parser.parse_args(arguments)
    for number in range(options.rigs):
        with TemporaryDirectory() as folder:
            row = asdict(one_bench(number, options.seed, Path(folder)))
        with options.out.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")
        sys.stdout.write(json.dumps(row) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()

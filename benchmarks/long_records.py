"""Long records: processor time and memory of the commands from 1e4 samples of 10 cycles to 1e6 of 1,000.

``python -m benchmarks.long_records [COMMAND...]`` makes records of one simulated rig with noise, and runs ``identify``,
``compensate``, ``report`` and ``trace`` (or those that are named) on each as a user does. Each line has the processor
time and the largest memory of the command.
"""

from __future__ import annotations

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from hysteresis.laws.bouc_wen import BoucWen, hysteresis

SIZES = ((10_000, 10), (100_000, 100), (1_000_000, 1_000), (1_000_000, 10))
"""Samples and cycles."""
COMMANDS = ("identify", "report", "compensate", "trace")
NOISE_DEG, AMPLITUDE_MM, PERIOD_S = 0.05, 2.2, 10.0
_START = "import sys; from notchbend_start import main; sys.exit(main())"


def write_record(path: Path, samples: int, cycles: int) -> None:
    """Write a record of cycles that repeat, with white noise and a linear drift of 0.2 deg."""
    phase = np.arange(samples // cycles) / (samples // cycles)
    wave = np.where(phase < 0.25, 4 * phase, np.where(phase < 0.75, 2 - 4 * phase, 4 * phase - 4))
    drive = AMPLITUDE_MM * np.tile(wave, cycles)
    f = 18.0 * drive + 1.2 * drive**2
    angle = f + hysteresis(f, BoucWen(-0.9, 0.3, 0.1, 1.5)) + 0.2 * np.arange(drive.size) / drive.size
    angle += NOISE_DEG * np.random.default_rng(0).standard_normal(drive.size)
    time = np.arange(drive.size) * PERIOD_S * cycles / drive.size
    rows = zip(time.tolist(), drive.tolist(), angle.tolist(), strict=True)
    text = "".join(f"{t:.4f},{x:.5f},{y:.4f}\n" for t, x, y in rows)
    path.write_text("time_s,drive_mm,angle_deg\n" + text)


def run(arguments: list[str], log: Path) -> tuple[int, float, float]:
    """Run a command; give its exit code, processor time in s and largest memory in MB."""
    child = os.fork()
    if child == 0:
        with log.open("wb") as file:
            os.dup2(file.fileno(), 1)
            os.dup2(file.fileno(), 2)
            os.execv(sys.executable, [sys.executable, "-c", _START, *arguments])
    _, status, usage = os.wait4(child, 0)
    return os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def commands(record: Path, out: Path, reference: Path) -> dict[str, list[str]]:
    """Give the arguments of each command."""
    fit = str(out / "fit")
    return {
        "identify": ["identify", str(record), "--out", fit, "--quiet"],
        "report": ["report", fit, "--quiet"],
        "compensate": ["compensate", str(record), "--reference", str(reference), "--out", str(out / "drive.csv")],
        "trace": ["trace", str(record), "--out", str(out / "trace"), "--quiet"],
    }


def main(wanted: list[str]) -> None:
    """Print a line for each command and size."""
    sys.stdout.write("  samples  cycles  command      processor s  memory MB\n")
    with tempfile.TemporaryDirectory() as folder:
        for samples, cycles in SIZES:
            out = Path(folder) / f"{samples}-{cycles}"
            out.mkdir()
            record, reference = out / "record.csv", out / "reference.csv"
            write_record(record, samples, cycles)
            angles = 20.0 * np.sin(np.linspace(0.0, 4 * np.pi, 1_000))
            reference.write_text("angle_deg\n" + "\n".join(f"{angle:.4f}" for angle in angles) + "\n")
            for name in COMMANDS:
                if name in wanted or (name == "identify" and "report" in wanted):
                    code, spent, memory = run(commands(record, out, reference)[name], out / f"{name}.log")
                    failed = f"  exit code {code}" if code else ""
                    sys.stdout.write(f"{samples:9d}  {cycles:6d}  {name:11s}  {spent:11.1f}  {memory:9.0f}{failed}\n")
                    sys.stdout.flush()


if __name__ == "__main__":
    main(sys.argv[1:] or list(COMMANDS))

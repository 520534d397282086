"""Fits of every law as `identify.json` holds them, and how what `notchbend export --to c` makes of them is compiled."""

import json
import math
import shutil
import subprocess

import numpy as np
import pytest

CASES = {
    # sign, rows of values (log |A|, log S, the constants of the law, state), slope of f
    "bouc-wen": (-1.0, [[-0.4, 0.3, math.log(2.7), 0.4, -0.3]], 20.0),
    "two elements": (-1.0, [[0.9, 0.1, 0.0, -0.9, -0.5], [-1.5, 0.8, math.log(8.0), 1.0, 0.9]], 20.0),
    "leading": (1.0, [[-2.6, 0.02, 0.52, -0.81, 0.97]], -20.0),
    "asymmetric-bouc-wen": (-1.0, [[0.3, 0.4, 0.6, 0.2, 0.5, -0.7, 0.2]], 20.0),
    "prandtl-ishlinskii": (-1.0, [[-0.2, 0.5, 0.4, 0.3, -0.6]], 20.0),
    "generalised-prandtl-ishlinskii": (-1.0, [[-0.6, 0.5, 0.4, 0.3, 0.3, -0.4, 0.8]], 20.0),
    "slow": (-1.0, [[-3.0, 1.6, 0.0, 0.0, 0.9]], 20.0),  # far from saturation after a loop of all drives
    "no hysteresis": (0.0, [[0.0, 0.0, 0.0, 0.0, 0.0]], 20.0),
}
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic")
COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler (cc, gcc or clang) on this machine")


def stored_fit(path, case="bouc-wen", **changed):
    """Write an identify.json of a made-up fit; ``changed`` are keys of its ``law``."""
    sign, rows, slope = CASES[case]
    drive = np.linspace(-2.0, 2.0, 257)
    angle = slope * drive + 0.9 * drive**2 + 0.15 * slope * np.sin(1.3 * drive)
    errors = {"rmse_deg": 0.1234, "max_abs_deg": 0.3, "max_rel_percent": 1.0, "normalised": 0.01}
    name = case if "-" in case else "bouc-wen"
    f = {"drive": drive.tolist(), "angle_deg": angle.tolist()}
    law = {"name": name, "title": case, "sign": sign, "values": rows, "place": [1.5, 38.0], "delay_s": 0.0, "f": f}
    whole = {
        "maker": "notchbend", "schema": 1, "records": ["loops/bench-20N.csv"], "kinematics": "fitted",
        "parameters": {}, "heldout": errors, "warnings": [], "baseline": {"heldout": errors}, "elements": 1,
        "heldout_by": "cycle 3", "noise_floor_deg": 0.0456, "drive_unit": "mm", "first_drive": 0.25,
        "f": f | {"without_hysteresis_deg": f["angle_deg"]},
        "law": law | {"heldout": errors, "warnings": []} | changed,
    }  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(whole))
    return path


def compiled(source, *options, out=None):
    """Compile a file strictly; the program, or what ``out`` names."""
    made = source.with_suffix("") if out is None else out
    command = [
        COMPILER,
        *STRICT,
        "-O2",
        *options,
        str(source),
        "-o",
        str(made),
        *(["-lm"] if "-c" not in options else []),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return made


def replayed(program, values, *words):
    """Feed numbers to a program made with -DNAME_MAIN: its second column."""
    text = "\n".join(map(repr, np.asarray(values, dtype=float).tolist()))
    done = subprocess.run([str(program), *words], input=text, capture_output=True, text=True, check=True, timeout=60)
    return np.array([line.split(",")[1] for line in done.stdout.splitlines()[1:]], dtype=float)

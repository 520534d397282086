"""Run the same commands on two versions of notchbend and compare what they write, to the last digit.

    python tests/same_results.py run --python OLD/.venv/bin/python --out old
    python tests/same_results.py run --python NEW/.venv/bin/python --out new
    python tests/same_results.py compare old new

A change of the structure must leave every number alone. What may differ is left out: times, dates, versions, commits,
checksums of the code, and the files of a figure. Texts that differ are listed apart, for a reader to judge.
"""

from __future__ import annotations

import argparse
import csv
import itertools
import json
import math
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

ALL_EFFECTS = """\
name = "all-effects"
preload_N = 20.0
precurvature_deg = 0.1
[tube]
outer_diameter_mm = 6.2
inner_diameter_mm = 5.64
[notch]
shape = "v_pair"
count = 6
depth_mm = 2.825
width_mm = 1.4
spacing_mm = 1.2
root_width_mm = 0.8
[material]
youngs_modulus_GPa = 60.0
poissons_ratio = 0.33
loop_share = 0.3
loop_angle_deg = 2.2
[tendon]
EA_N = 17000.0
moment_arm_mm = 2.64
free_length_mm = 150.0
toe_N = 40.0
[tendon_b]
moment_arm_mm = 2.55
EA_N = 16000.0
[wheel]
radius_mm = 10.0
[friction]
capstan_coefficient = 0.1
guide_N = 0.01
sheath_N = 1.0
rest_wrap_deg = 5.0
[slack]
tendon_a_mm = 0.01
[backlash]
width_mm = 0.05
[eccentricity]
amplitude_mm = 0.05
phase_deg = 20.0
[superelastic]
plateau_MPa = 450.0
unloading_plateau_MPa = 220.0
[closure]
stiffness_Nmm_per_rad = 20000.0
[gravity]
ring_mass_g = 0.3
[tip_stop]
y_mm = 4.0
stiffness_N_per_mm = 1.0
[creep]
fraction = 0.2
time_s = 2.0
[drag]
sheath_N_s_per_mm = 0.05
joint_Nmm_s_per_rad = 0.05
[preload_loss]
fraction = 0.1
cycles = 2.0
[fatigue]
loop_loss = 0.2
residual_deg = 0.05
cycles = 2.0
"""
STUDY = """\
schema = 1
title = "twelve cases"
engine = "chain"
[rig]
preset = "du2018"
[program]
amplitude_mm = 2.2
cycles = 2
[vary]
preload_N = [10, 15, 20, 30]
"notch.depth_mm" = [2.8, 2.825, 3.2]
[quantities]
groups = ["loop", "strain", "contributions"]
"""
WRIST = """\
name = "wrist"
preload_N = 2.0
[tube]
outer_diameter_mm = 3.5
inner_diameter_mm = 2.74
[notch]
shape = "rectangular_pair"
count = 6
depth_mm = 1.6
width_mm = 0.6
spacing_mm = 0.4
turn_deg = [0, 90, 0, 90, 0, 90]
[material]
youngs_modulus_GPa = 62.9
poissons_ratio = 0.33
[tendon]
EA_N = 5500.0
moment_arm_mm = 1.56
free_length_mm = 150.0
[tendons]
angles_deg = {angles}
[wheel]
radius_mm = 5.0
[friction]
capstan_coefficient = 0.15
[tip_mass]
mass_g = 1.0
direction = [0.0, -1.0, 0.2]
"""
WRISTS = {"wrist": [0, 180, 90, 270], "wrist-three": [0, 120, 240], "wrist-one": [20]}
"""Rig files in space, by the angles of their tendons: two wheels, three, and one."""
PLANAR = WRIST.partition("[tip_mass]")[0].replace("[0, 90, 0, 90, 0, 90]", "0")
STUDY_IN_SPACE = """\
schema = 1
[rig]
file = "wrist.toml"
[program]
amplitude_mm = 0.3
step_mm = 0.1
[vary]
friction.capstan_coefficient = [0.0, 0.15]
[quantities]
groups = ["planes", "workspace", "compliance"]
"""
WANTED = "angle_deg,angle_2_deg\n0,0\n2,0\n2,2\n0,2\n-1,0\n"
TENSIONS = "tension_1_N,tension_2_N,tension_3_N,tension_4_N\n2,2,2,2\n3,2,2,2\n3,2,3,1.5\n2,2,2,2\n"
TRACED = {"known": ("backlash", "guide_friction"), "unknown": ("tendon_slack", "time_delay")}
LEFT_OUT = {"seconds", "wall_s", "versions", "sha256", "code", "version", "figures", "computed", "date", "commit"}
"""Keys of what no two runs, or no two versions, have in common."""
PATHS = ("file", "record", "records", "source", "reference")


def commands() -> Iterator[tuple[str, list[str]]]:
    """Give all command lines, after ``notchbend``, with a name each; they run in the folder of the results."""
    for engine, preload in itertools.product(("chain", "multibody", "analytic"), (10, 20)):
        given = ["--preset", "du2018", "--preload", str(preload), "--amplitude", "2.2", "--cycles", "2"]
        yield (
            f"simulate {engine} {preload} N",
            ["simulate", *given, "--engine", engine, "--out", f"{engine}-{preload}N.csv"],
        )
    for engine in ("chain", "multibody"):
        given = [
            "--rig",
            "all-effects.toml",
            "--amplitude",
            "1.2",
            "--rate",
            "0.5",
            "--cycles",
            "2",
            "--engine",
            engine,
        ]
        yield f"simulate {engine}, all effects", ["simulate", *given, "--out", f"all-{engine}.csv"]
    dynamic = ["--preset", "du2018", "--amplitude", "1.0", "--rate", "1", "--dynamic", "--out", "dynamic.csv"]
    yield "simulate --dynamic", ["simulate", *dynamic]
    yield "identify one", ["identify", "chain-20N.csv", "--out", "identify-one"]
    yield "identify two", ["identify", "chain-20N.csv", "chain-10N.csv", "--elements", "0", "--out", "identify-two"]
    yield "separate a rig", ["separate", "--preset", "du2018", "--preload", "20", "--out", "separate-rig"]
    yield "separate records", ["separate", "chain-20N.csv", "chain-10N.csv", "--out", "separate-records"]
    yield "effects", ["effects"]
    for kind, labels in TRACED.items():
        for label in labels:
            folder = Path("cases") / f"work-{kind}" / f"{label}-00"
            yield f"trace {kind} {label}", ["trace", str(folder), "--out", f"trace-{kind}-{label}"]
    yield "study", ["study", "study.toml", "--workers", "1", "--out", "study"]
    yield "validate", ["validate", "--out", "validate"]
    yield "run", ["run", "--out", "run"]
    yield from in_space()
    yield from refused()


def in_space() -> Iterator[tuple[str, list[str]]]:
    """Give the commands of rigs that bend in two planes."""
    small = ["--rig", "wrist.toml", "--amplitude", "0.3"]
    for name, words in {
        "chain": [],
        "multibody": ["--engine", "multibody"],
        "circle": ["--circle", "--cycles", "2"],
        "rate": ["--rate", "1"],
    }.items():
        yield f"space: simulate {name}", ["simulate", *small, *words, "--out", f"wrist-{name}.csv"]
    for name, words in {
        "tensions": ["--rig", "wrist.toml", "--program", "tensions.csv"],
        "program": ["--rig", "wrist.toml", "--program", "wrist-circle.csv", "--preload", "3"],
        "preset": ["--preset", "zhang2026", "--amplitude", "0.5"],
        "three": ["--rig", "wrist-three.toml", "--amplitude", "0.2", "--circle"],
        "one": ["--rig", "wrist-one.toml", "--amplitude", "0.2"],
        "planar": ["--rig", "planar.toml", "--amplitude", "0.2", "--engine", "chain"],
    }.items():
        yield f"space: simulate {name}", ["simulate", *words, "--out", f"{name}-of-wrist.csv"]
    for stem in WRISTS:
        reach = ["workspace", "--rig", f"{stem}.toml", "--amplitude", "0.2", "--circles", "2", "--directions", "8"]
        yield f"space: workspace {stem}", [*reach, "--out", f"reach-{stem}"]
        report = ["run", "--rig", f"{stem}.toml", "--amplitude", "0.2", "--preload", "2", "--preload", "3"]
        yield f"space: run {stem}", [*report, "--out", f"run-{stem}"]
        yield f"space: report {stem}", ["report", f"run-{stem}"]
    yield "space: run preset", ["run", "--preset", "zhang2026", "--amplitude", "0.4", "--out", "run-zhang"]
    yield "space: run planar", ["run", "--rig", "planar.toml", "--amplitude", "0.2", "--out", "run-planar"]
    yield "space: compensate", ["compensate", "wrist.toml", "--reference", "wanted.csv", "--out", "wrist-drives.csv"]
    yield "space: validate", ["validate", *small, "--out", "validate-wrist"]
    yield "space: study", ["study", "study-in-space.toml", "--workers", "1", "--out", "study-wrist"]
    yield "space: identify", ["identify", "wrist-chain.csv", "--out", "identify-wrist"]
    for to in ("dxf", "step", "stl", "svg", "pdf"):
        yield f"space: export {to}", ["export", "--rig", "wrist.toml", "--to", to, "--out", f"wrist.{to}"]


def refused() -> Iterator[tuple[str, list[str]]]:
    """Give command lines that end with one line: what a rig in space has not, and what a planar rig has not."""
    wrist, out = ["--rig", "wrist.toml"], ["--out", "refused"]
    simulate = ["simulate", *wrist, "--amplitude", "0.2", "--out", "refused.csv"]
    yield "refused: analytic", [*simulate, "--engine", "analytic"]
    yield "refused: dynamic", [*simulate, "--rate", "1", "--dynamic"]
    yield "refused: ensemble", [*simulate, "--ensemble"]
    yield "refused: forces", ["simulate", *wrist, "--program", "wanted.csv", "--out", "refused.csv"]
    yield "refused: circle", ["simulate", "--preset", "du2018", "--amplitude", "1", "--circle", "--out", "refused.csv"]
    yield "refused: circle of one", ["simulate", "--rig", "wrist-one.toml", "--amplitude", "1", "--circle", *out]
    yield "refused: separate", ["separate", *wrist, *out]
    yield "refused: separate preset", ["separate", "--preset", "zhang2026", *out]
    yield "refused: separate record", ["separate", "wrist-chain.csv", *out]
    yield "refused: calibrate", ["calibrate", *wrist, "--out", "refused.csv"]
    for to in ("mujoco", "c", "table"):
        yield f"refused: export {to}", ["export", *wrist, "--to", to, *out]
    yield "refused: run record", ["run", *wrist, "wrist-chain.csv", *out]
    yield "refused: run ensemble", ["run", "--preset", "zhang2026", "--ensemble", *out]
    yield "refused: workspace", ["workspace", "--preset", "du2018", "--amplitude", "1", *out]
    yield "refused: compensate", ["compensate", "planar.toml", "--reference", "wanted.csv", "--out", "refused.csv"]
    yield "refused: no preset", ["simulate", "--preset", "zhang", "--amplitude", "1", "--out", "refused.csv"]
    yield "refused: preload", ["simulate", *wrist, "--amplitude", "1", "--preload", "-1", "--out", "refused.csv"]
    yield "refused: drive", ["simulate", *wrist, "--amplitude", "90", "--step", "30", "--out", "refused.csv"]


def run(python: Path, out: Path, only: str = "") -> None:
    """Run all commands whose name has the pattern ``only``; the JSON of a command goes beside what it writes."""
    python = python.absolute()
    out.mkdir(parents=True)
    (out / "all-effects.toml").write_text(ALL_EFFECTS)
    (out / "study.toml").write_text(STUDY)
    for stem, angles in WRISTS.items():
        (out / f"{stem}.toml").write_text(WRIST.replace("{angles}", str(angles)))
    (out / "planar.toml").write_text(PLANAR.replace("{angles}", "[0, 180]"))
    (out / "study-in-space.toml").write_text(STUDY_IN_SPACE)
    (out / "wanted.csv").write_text(WANTED)
    (out / "tensions.csv").write_text(TENSIONS)
    for kind, labels in () if not any(re.search(only, f"trace {kind}") for kind in TRACED) else TRACED.items():
        given = ["--kind", kind, "--effects", ",".join(labels), "--count", "1", "--out", "cases"]
        subprocess.run([python, "-m", "validation.practice.cases", *given], cwd=out, check=True)
    for number, (name, arguments) in enumerate(commands()):
        if not re.search(only, name):
            continue
        expected = 2 if name.startswith("refused") else 0
        if arguments[0] == "trace":
            arguments[1:2] = sorted(str(path.relative_to(out)) for path in (out / arguments[1]).glob("*.csv"))
        start = time.perf_counter()
        done = subprocess.run(
            [python.parent / "notchbend", *arguments, "--json"], cwd=out, check=False, capture_output=True, text=True
        )
        print(f"{name}: exit {done.returncode}, {time.perf_counter() - start:.1f} s", flush=True)
        if done.returncode != expected:
            print(done.stderr, flush=True)
        (out / f"{number:02d}-{arguments[0]}.json").write_text(done.stdout)
        said = {"exit": done.returncode, "error": done.stderr.replace(str(out.absolute()), "OUT")}
        (out / f"{number:02d}-{arguments[0]}-said.json").write_text(json.dumps(said))


@dataclass
class Differences:
    """What differs: texts, and numbers with how far they are apart."""

    texts: list[str] = field(default_factory=list)
    numbers: list[tuple[float, str]] = field(default_factory=list)
    structure: list[str] = field(default_factory=list)
    compared: int = 0

    def number(self, where: str, a: float, b: float) -> None:
        """Compare two numbers to the last digit."""
        self.compared += 1
        if a != b and not (math.isnan(a) and math.isnan(b)):
            self.numbers.append((abs(a - b), f"{where}: {a!r} {b!r}"))

    def values(self, where: str, a: Any, b: Any) -> None:
        """Compare two values of JSON."""
        if isinstance(a, dict) and isinstance(b, dict):
            if list(a) != list(b):
                self.structure.append(f"{where}: keys {sorted(set(a) ^ set(b)) or 'in another order'}")
            for key in a.keys() & b.keys() - LEFT_OUT:
                self.values(f"{where}.{key}", a[key], b[key])
        elif isinstance(a, list) and isinstance(b, list):
            if len(a) != len(b):
                self.structure.append(f"{where}: {len(a)} and {len(b)} entries")
            for i, (x, y) in enumerate(zip(a, b, strict=False)):
                self.values(f"{where}[{i}]", x, y)
        elif isinstance(a, int | float) and isinstance(b, int | float) and not isinstance(a, bool):
            self.number(where, a, b)
        elif a != b:
            both_text = isinstance(a, str) and isinstance(b, str)
            (self.texts if both_text else self.structure).append(f"{where}:\n    {a!r}\n    {b!r}")
        else:
            self.compared += 1

    def tables(self, where: str, a: str, b: str) -> None:
        """Compare two CSV files."""
        rows_a, rows_b = (list(csv.reader(text.splitlines())) for text in (a, b))
        if [len(row) for row in rows_a] != [len(row) for row in rows_b] or rows_a[:1] != rows_b[:1]:
            self.structure.append(f"{where}: another shape or header")
            return
        for i, (x, y) in enumerate(zip(rows_a, rows_b, strict=True)):
            for j, (p, q) in enumerate(zip(x, y, strict=True)):
                if p == q:
                    self.compared += 1
                elif i == 0:
                    self.structure.append(f"{where}: column {p!r} {q!r}")
                else:
                    self.number(f"{where}:{i + 1}:{rows_a[0][j]}", float(p), float(q))


def compare(old: Path, new: Path) -> Differences:
    """Compare all CSV, TOML and JSON files and the datasets of two folders."""
    import xarray

    out = Differences()
    suffixes: dict[str, Callable[[str, str, str], None]] = {
        ".csv": out.tables,
        ".json": lambda where, a, b: out.values(where, *(json.loads(t) if t.strip() else None for t in (a, b))),
        ".toml": lambda where, a, b: out.values(where, a, b),
    }
    files = [{p.relative_to(top) for p in top.rglob("*") if ".zarr" not in str(p)} for top in (old, new)]
    only_in_one = [path for path in sorted(files[0] ^ files[1]) if (old / path).is_file() or (new / path).is_file()]
    out.structure += [f"{path}: in one folder only" for path in only_in_one]
    for path in sorted(files[0] & files[1]):
        if path.suffix in suffixes:
            suffixes[path.suffix](str(path), (old / path).read_text(), (new / path).read_text())
    for store in sorted(path.relative_to(old) for path in old.rglob("study.zarr")):
        if not (new / store).exists():
            out.structure.append(f"{store}: in one folder only")
            continue
        a, b = (xarray.open_zarr(top / store, consolidated=False).load() for top in (old, new))
        out.values(str(store), sorted(map(str, a.variables)), sorted(map(str, b.variables)))
        for name in a.variables.keys() & b.variables.keys() - LEFT_OUT:
            out.values(f"{store} {name}", a[name].values.tolist(), b[name].values.tolist())
    return out


def main() -> int:
    """Run, or compare; 1 where a number, a key or a file differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    one = verbs.add_parser("run")
    one.add_argument("--python", type=Path, required=True)
    one.add_argument("--out", type=Path, required=True)
    one.add_argument("--only", default="", help="regular expression of the names of commands")
    two = verbs.add_parser("compare")
    two.add_argument("old", type=Path)
    two.add_argument("new", type=Path)
    options = parser.parse_args()
    if options.verb == "run":
        run(options.python, options.out, options.only)
        return 0
    found = compare(options.old, options.new)
    for title, rows in (
        ("texts", found.texts),
        ("keys and files", found.structure),
        ("numbers", [f"{gap:.2g} {where}" for gap, where in sorted(found.numbers, reverse=True)]),
    ):
        print(f"{title} that differ: {len(rows)}")
        print(*(f"  {row}" for row in rows[:200]), sep="\n")
    print(f"{found.compared} values agree to the last digit")
    return 1 if found.structure or found.numbers else 0


if __name__ == "__main__":
    sys.exit(main())

"""What the page on the two readings is made from: figures that the command stores beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import repeat

from docs.make.calibration.sample import PRESETS
from docs.make.pages import DOCS
from fem_models.rig.ensemble import member_constants
from hysteresis.files import write_files
from hysteresis.plain import from_plain, to_plain
from validation.measured.readings.fit import SetFit, fit_set
from validation.measured.readings.layer_errors import MemberErrors, member_errors
from validation.measured.readings.mechanisms import SETS
from validation.measured.readings.paper_table import FACTORS, PaperTable, paper_table

STORED = DOCS / "validation" / "readings.json"
STARTS, SEED = 3, 1
EVERY = 2
"""Of the members of an ensemble, one in so many has equation 7 fitted to its loops."""
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Stored:
    """Figures by part; those of sets by name and reading, those of equation 7 by reading."""

    table: PaperTable | None = None
    sets: Mapping[str, Mapping[str, SetFit]] = field(default_factory=dict)
    layer: Mapping[str, tuple[MemberErrors, ...]] = field(default_factory=dict)


def read() -> Stored:
    """Read what is stored; nothing if there is no file."""
    if not STORED.exists():
        return Stored()
    return from_plain(Stored, json.loads(STORED.read_text(encoding="utf-8")), str(STORED.name))


def write(stored: Stored) -> None:
    """Write the file."""
    write_files({STORED: json.dumps(to_plain(stored), indent=1) + "\n"})


def make_table(_: Tell) -> None:
    """Work out what the paper's numbers imply."""
    write(replace(read(), table=paper_table()))


def make_sets(tell: Tell) -> None:
    """Fit all sets under both readings."""
    found: dict[str, dict[str, SetFit]] = {}
    for name, mechanisms in SETS.items():
        found[name] = {one: fit_set(mechanisms, one, starts=STARTS, seed=SEED) for one in FACTORS}
        tell(f"{name}: " + ", ".join(f"{one} {fit.judged.chi_square:.1f}" for one, fit in found[name].items()))
    write(replace(read(), sets=found))


def make_layer(tell: Tell) -> None:
    """Fit equation 7 to the loops of every second member of both ensembles."""
    found: dict[str, tuple[MemberErrors, ...]] = {}
    with ProcessPoolExecutor() as pool:
        for reading, name in PRESETS.items():
            members = member_constants(name)[::EVERY]
            asked = (members, repeat(reading), range(SEED, SEED + len(members)))
            found[reading] = tuple(pool.map(member_errors, *asked, chunksize=5))
            tell(f"{reading}: {len(found[reading])} members")
    write(replace(read(), layer=found))


PARTS: Mapping[str, Callable[[Tell], None]] = {
    "table": make_table,
    "sets": make_sets,
    "layer": make_layer,
}

"""What the page on the two readings is made from: figures that the command stores beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from docs.make.pages import DOCS
from hysteresis.files import write_files
from hysteresis.plain import from_plain, to_plain
from validation.measured.readings.fit import SetFit, fit_set
from validation.measured.readings.layer_errors import MemberErrors, member_errors
from validation.measured.readings.loops import has_rate
from validation.measured.readings.mechanisms import SAMPLED, SETS, rig_of
from validation.measured.readings.paper_table import FACTORS, PaperTable, paper_table
from validation.measured.readings.posterior import Samples, SampleSettings, met_but_peak, sample

STORED = DOCS / "validation" / "readings.json"
STARTS, SEED = 3, 1
Tell = Callable[[str], None]


@dataclass(frozen=True)
class Stored:
    """Figures by part; those of sets by name and reading."""

    table: PaperTable | None = None
    sets: Mapping[str, Mapping[str, SetFit]] = field(default_factory=dict)
    samples: Mapping[str, Mapping[str, Samples]] = field(default_factory=dict)
    layer: Mapping[str, Mapping[str, MemberErrors]] = field(default_factory=dict)


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


def make_samples(tell: Tell) -> None:
    """Draw the members of sets under both readings that are not stored yet: remove them to draw again."""
    for name, mechanisms in SAMPLED.items():
        for one in reversed(FACTORS):
            stored = read()
            if one in stored.samples.get(name, {}):
                continue
            found = sample(mechanisms, one, SampleSettings(seed=SEED), tell)
            tell(f"{name}, {one}: effective {found.effective:.0f}, R-hat {found.r_hat:.2f}, {sum(found.meets)} meet")
            stored = read()
            write(replace(stored, samples={**stored.samples, name: {**stored.samples.get(name, {}), one: found}}))


def make_layer(tell: Tell) -> None:
    """Fit equation 7 to the loops of the sets' rigs that are not stored yet: remove them to fit again."""
    for name, fits in read().sets.items():
        for one, fit in fits.items():
            stored = read()
            rates = rig_of(fit.constants)
            known = stored.layer.get(name, {})
            if one in known or not met_but_peak(fit.judged) or rates.camera or has_rate(rates.rig):
                continue
            known = {**known, one: member_errors(fit.constants, one, SEED)}
            write(replace(stored, layer={**stored.layer, name: known}))
            tell(f"{name}, {one}: {known[one].static}")


PARTS: Mapping[str, Callable[[Tell], None]] = {
    "table": make_table,
    "sets": make_sets,
    "samples": make_samples,
    "layer": make_layer,
}

"""Options of ``notchbend run``: a rig of the user's own, its preloads, amplitude and records."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from fem_models.rig import Rig, RigError, ensemble
from fem_models.rig.checks import require
from fem_models.rig.of_record import rig_of
from hysteresis.records.record import Record
from hysteresis.records.record_file import read_records
from hysteresis.records.thinning import thinned
from studies.commands.options import ALL, possible
from studies.results.run import RunSummary

if TYPE_CHECKING:
    from studies.own_rig.design import Design


@dataclass(frozen=True)
class OwnRigChoice:
    """A rig, its preloads and its amplitude."""

    rig: Annotated[Path | None, typer.Option("--rig", help="Rig file, TOML, or --preset: a report of your rig.")] = None
    preset: Annotated[str | None, typer.Option("--preset", help=f"In place of --rig, one of {', '.join(ALL)}.")] = None
    preload: Annotated[
        list[float] | None,
        typer.Option("--preload", help="Preload, N; may be repeated. By default those of the records, else the rig's."),
    ] = None
    amplitude: Annotated[
        float | None,
        typer.Option("--amplitude", help="Amplitude, mm; by default that of the records, else the one to 45 deg."),
    ] = None
    ensemble: Annotated[
        bool, typer.Option("--ensemble", help="Also give 90 % ranges over the ensemble of the preset.")
    ] = False

    def is_given(self, records: Sequence[Path]) -> bool:
        """Tell whether the report is of a rig that was named.

        Raises
        ------
        RigError
            An option or a record that needs a rig, without one.
        """
        if self.rig is not None or self.preset is not None:
            return True
        given = {f"--{one.name}": getattr(self, one.name) for one in fields(self)}
        clash = next((name for name, value in given.items() if value), None) or next(map(str, records), None)
        if clash is not None:
            raise RigError(f"{clash}: of which rig? expected --rig FILE or --preset NAME beside it")
        return False

    def read(self) -> Rig:
        """Read the rig, of one plane or in space.

        Raises
        ------
        RigError
            Both a file and a preset, options that exclude each other, an impossible rig.
        """
        from fem_models.rig.presets_in_space import any_preset
        from fem_models.rig.rig_file import read_any_rig

        if self.rig is not None and self.preset is not None:
            raise RigError(f"--rig {self.rig} and --preset {self.preset}: expected one of the two")
        if self.ensemble and self.preset is None:
            raise RigError(f"--ensemble with --rig {self.rig}: expected --preset")
        given = self.preload or []
        twice = next((value for i, value in enumerate(given) if value in given[:i]), None)
        if twice is not None:
            raise RigError(f"--preload {twice:g}: given twice: expected different preloads")
        if self.amplitude is not None:
            require(self.amplitude > 0, "--amplitude", self.amplitude, "above 0")
        return read_any_rig(self.rig) if self.rig is not None else any_preset(self.preset or "")

    def design(self, rig: Rig, paths: Sequence[Path]) -> tuple[Design, list[Record]]:
        """Take the rig to each preload, and read the records.

        Raises
        ------
        RigError, RecordError
            An impossible preload, a record that cannot be read or that is of another rig; records or --ensemble of a
            rig in space, whose report has neither.
        """
        from studies.own_rig.design import Design, amplitude_of

        if not rig.is_planar:
            self._require_neither(rig, paths)
        records = [thinned(one) for one in read_records(paths)]
        preloads = self.preload or _preloads(rig, records)
        _require_same_rig(rig, records, self.option())
        design = Design(
            name=self.preset if self.rig is None and self.preset else rig.name,
            option=self.option(),
            rigs=tuple(possible(rig.with_preload(value)) for value in preloads),
            amplitude_mm=self.amplitude or amplitude_of(rig, records),
            preset=self.preset,
            file=self.rig,
            members=ensemble(self.preset) if self.ensemble and self.preset else (),
        )
        return design, records

    def _require_neither(self, rig: Rig, paths: Sequence[Path]) -> None:
        """Refuse records and --ensemble with a rig in space."""
        if paths:
            found = f"{paths[0]}: rig {rig.name} bends in space, and its report takes no records"
            raise RigError(f"{found}: expected none, or notchbend trace, which takes them")
        if self.ensemble:
            raise RigError(f"--ensemble with rig {rig.name}, which bends in space: expected --preset of a planar rig")

    def option(self) -> str:
        """Name the rig on a command line."""
        return f"--preset {self.preset}" if self.rig is None else f"--rig {shlex.quote(str(self.rig))}"


def _preloads(rig: Rig, records: Sequence[Record]) -> list[float]:
    """Give the preloads of the records in rising order, else that of the rig."""
    found = {known.preload_N for record in records if (known := rig_of(record)) is not None}
    return sorted(found) or [rig.preload_N]


def _require_same_rig(rig: Rig, records: Sequence[Record], option: str) -> None:
    """Refuse a record whose sidecar names another rig; one without a rig is of unknown geometry."""
    names = [one.name for one in fields(rig) if one.name not in ("name", "preload_N")]
    for record in records:
        known = rig_of(record)
        if known is not None and any(getattr(known, name) != getattr(rig, name) for name in names):
            raise RigError(f"{record.source}: its sidecar names another rig, {known.name}: expected that of {option}")


def design_lines(summary: RunSummary) -> list[str]:
    """Give the lines of a terminal: the loop and its strain at each preload, records, parts, trace, notes."""
    from studies.report.summary import limit_words  # the page, which other commands do not need

    lines = []
    for loop in summary.loops:
        passed = [row for row in loop.strain_limits if row.passed_at_mm is not None]
        limits = ", ".join(f"{row.name} passed {limit_words(loop, row)}" for row in passed) or "within all limits"
        lines.append(
            f"{loop.record}: {loop.full_scale_deg:.4g} deg, loop {loop.loop_width_deg:.3g} deg wide, peak strain "
            f"{loop.peak_strain_percent:.3g} %, {limits if loop.strain_limits else 'its limits are not known'}"
        )
    if summary.own is not None:
        for one in summary.own.predictions:
            lines.append(
                f"{one.record}: {one.rmse_deg:.3g} deg rms from the rig as its file says, "
                f"noise {one.noise_floor_deg:.2g} deg"
            )
        lines += [f"note: {words}" for words in summary.own.notes]
    if summary.trace is not None:
        lines.append(f"trace: {summary.trace.verdict} {' + '.join(summary.trace.effects)}".rstrip())
    return lines

"""Results that only a notebook has: a compensation with its drive, and a study with its dataset."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hysteresis.arrays import Floats
from hysteresis.display import from_to, html_table, on_screen
from hysteresis.extras import require_extra
from hysteresis.plain import to_plain

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

    from studies.commands.compensation import CompensationSummary
    from studies.results.study import StudySummary


MOST_ROWS = 16
"""Quantities of a study that are printed: a screen holds them."""


@dataclass(frozen=True, eq=False, repr=False)
class Compensation:
    """The drive that makes the angle follow a reference.

    ``columns`` are those of the file that ``notchbend compensate`` writes: ``time_s`` if there are times, the drive in
    the unit of the record, and the reference ``angle_deg``, each of shape (m,). ``summary`` has the errors of the
    model and the largest correction.
    """

    columns: Mapping[str, Floats]
    summary: CompensationSummary

    @property
    def drive(self) -> Floats:
        """The drive, shape (m,), in ``summary.drive_unit``."""
        return self.columns[f"drive_{self.summary.drive_unit}"]

    def to_dict(self) -> dict[str, Any]:
        """Return plain values: the summary, and the columns as lists."""
        return {**to_plain(self.summary), "columns": to_plain(self.columns)}

    def to_dataframe(self) -> pd.DataFrame:
        """Return the columns as a table."""
        require_extra("study", "to_dataframe")
        import pandas as pd

        return pd.DataFrame(dict(self.columns))

    def __repr__(self) -> str:
        s = self.summary
        drive = from_to(self.drive, s.drive_unit)
        correction = f"largest correction {s.largest_correction:.3g} {s.drive_unit}"
        return f"Compensation({s.samples} samples, drive {drive}, {correction}, {len(s.warnings)} warnings)"

    def __str__(self) -> str:
        return on_screen([repr(self)])

    def _repr_html_(self) -> str:
        s = self.summary
        rows = [
            ("samples", str(s.samples)),
            ("reference", from_to(self.columns["angle_deg"], "deg")),
            ("drive", from_to(self.drive, s.drive_unit)),
            ("largest correction", f"{s.largest_correction:.4g} {s.drive_unit}"),
            ("held-out rmse of the model", f"{s.heldout_rmse_deg:.3g} deg"),
            ("without hysteresis", f"{s.without_hysteresis_rmse_deg:.3g} deg"),
        ]
        return html_table("compensation", rows, notes=(f"warning: {text}" for text in s.warnings))


@dataclass(frozen=True, repr=False)
class StudyResult:
    """A parametric study: ``summary`` is the content of study.json, ``folder`` has the dataset and the ``report``."""

    summary: StudySummary
    folder: Path
    report: Path

    def to_dict(self) -> dict[str, Any]:
        """Return the content of study.json."""
        return dict(to_plain(self.summary))

    def to_xarray(self) -> xr.Dataset:
        """Open the dataset of all cases, with units; numbers are read when they are used."""
        from studies.sweep.dataset import open_study

        return open_study(self.folder)

    def to_dataframe(self) -> pd.DataFrame:
        """Return all cases as a table, one row a case."""
        return self.to_xarray().to_dataframe().reset_index()

    def __repr__(self) -> str:
        s = self.summary
        return f"StudyResult({s.title!r}, {s.cases} cases, {s.failures.count} failed, {s.state}, in {self.folder})"

    def __str__(self) -> str:
        """Show a screen of it: how many cases there are, and the range of every quantity."""
        s = self.summary
        lines = [f"{s.title}: {s.cases} cases, {s.failures.count} failed, {s.state}"]
        rows = [
            f"  {name:<32} {found.min.value:>12.4g} to {found.max.value:>12.4g} {found.units}"
            for name, found in s.quantities.items()
        ]
        more = [f"  and {len(rows) - MOST_ROWS} more: to_xarray"] if len(rows) > MOST_ROWS else []
        return on_screen([*lines, *rows[:MOST_ROWS], *more, f"  report: {self.report}"])

    def _repr_html_(self) -> str:
        rows = [
            (name, f"{found.min.value:.4g}", f"{found.max.value:.4g}", found.units)
            for name, found in self.summary.quantities.items()
        ]
        s = self.summary
        title = f"{s.title}: {s.cases} cases, {s.failures.count} failed"
        return html_table(title, rows, ("quantity", "minimum", "maximum", "unit"), [f"report: {self.report}"])

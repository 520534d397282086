"""``separate.json``: the loop of a rig divided among friction, elasticity of the tendons and material."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hysteresis.display import html_table, on_screen
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.plain import named, optional, to_plain
from hysteresis.records.metrics import Errors
from studies.results.made import Made

Interval = tuple[float, float]


@dataclass(frozen=True)
class LoopSize:
    """Largest width, area (deg mm) and energy that a cycle dissipates."""

    width_deg: float
    area: float
    dissipated_mJ: float


@dataclass(frozen=True)
class Contribution:
    """What a part contributes to the loop, and its shares of the whole: of width, area and energy (``share``).

    Shares are None where there is no such loop. ``intervals`` by the name of the number are those of 95 % for rigs that
    are calibrated on records, and the ranges of 90 % of the members of an ensemble.
    """

    width_deg: float
    width_share: float | None
    area: float
    area_share: float | None
    dissipated_mJ: float
    share: float | None
    intervals: Mapping[str, Interval | None] | None = optional()

    def share_of(self, quantity: str) -> float | None:
        """Share of the energy (``share``), the width (``width_share``) or the area (``area_share``)."""
        value: float | None = getattr(self, quantity)
        return value

    def interval(self, quantity: str) -> Interval | None:
        """Interval of one of the numbers; None where there is none."""
        return None if self.intervals is None else self.intervals.get(quantity)


@dataclass(frozen=True)
class EnergyBalance:
    """Work of the wheel and losses of a cycle; ``closure_percent`` is the difference of the parts from the losses."""

    wheel_work_mJ: float
    friction_loss_mJ: float
    material_loss_mJ: float
    closure_percent: float


@dataclass(frozen=True)
class Combination:
    """The loop with only the sources in ``on`` switched on."""

    on: tuple[str, ...]
    width_deg: float
    area: float
    dissipated_mJ: float
    friction_mJ: float
    material_mJ: float


@dataclass(frozen=True)
class Law:
    """Bouc-Wen parameters of a combination's loop, with f fitted to it, and the error on its held-out samples."""

    parameters: Mapping[str, Parameter]
    saturation_deg: Parameter
    heldout: Errors


@dataclass(frozen=True, kw_only=True)
class NextExperiment:
    """A further record and what it brings: see :class:`validation.separation.rig_calibration.Experiment`."""

    what: str
    preload_N: float
    amplitude_mm: float
    gain: float
    parameter: str = named("constant")
    narrower: float


@dataclass(frozen=True, kw_only=True)
class ToMeasure:
    """The parameter that the share of a part depends on most, within what the records leave open.

    ``explains`` is the part of the variance of the energy share that is gone once the parameter is known, and ``how``
    says how to measure it by itself.
    """

    part: str
    parameter: str = named("constant")
    explains: float
    how: str


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Parameters of the rig fitted to the records; ``not_separated`` says which ones the records do not separate.

    ``laws`` has the probability of each law of the metal, ``effective_draws`` how many independent rigs the intervals
    rest on, and ``to_measure`` what would narrow the energy shares.
    """

    parameters: Mapping[str, Parameter] = named("constants")
    rmse_deg: float
    condition: float
    correlations: Mapping[str, float]
    not_separated: tuple[str, ...]
    next_experiments: tuple[NextExperiment, ...]
    noise_deg: float | None = None
    laws: Mapping[str, float] | None = optional()
    effective_draws: float | None = optional()
    to_measure: tuple[ToMeasure, ...] = ()


@dataclass(frozen=True)
class MeasuredLoop:
    """Width and area (deg mm) of the record's own loop."""

    width_deg: float
    area: float


@dataclass(frozen=True)
class LoopSensitivity:
    """d ln(number)/d ln(constant) of the loop: width, area, energy, and the whole range of the angle; None without."""

    width: float | None
    area: float | None
    energy: float | None
    range: float | None


@dataclass(frozen=True)
class OverEnsemble:
    """Ranges over an ensemble of rigs that meet the same facts: ``level`` is the share of the members within."""

    members: int
    level: float
    width_deg: Interval
    area: Interval
    dissipated_mJ: Interval


@dataclass(frozen=True, repr=False)
class Separation:
    """What ``separate.json`` holds.

    ``rig`` has the tables of a rig file. ``drive_mm`` are the ends of the loop. ``contributions`` and ``shapley`` have
    the parts by name; ``combinations`` the loops that they follow from. ``bouc_wen`` has a law for the loop of each
    source, None where there is no loop. ``sensitivity`` is by constant, for the chain; ``inseparable`` says in one line
    which constants one loop cannot separate. ``ensemble`` is there if the loop was divided over an ensemble.
    ``records`` are the files that the rig was calibrated on.
    """

    schema: int
    rig: Mapping[str, Any]
    engine: str
    drive_mm: tuple[float, float]
    total: LoopSize
    contributions: Mapping[str, Contribution]
    shapley: Mapping[str, Mapping[str, float] | None]
    energy: EnergyBalance
    rigid_rope_residual_percent: float | None
    combinations: tuple[Combination, ...]
    bouc_wen: Mapping[str, Law | None]
    calibration: Calibration | None
    measured: MeasuredLoop | None
    warnings: tuple[str, ...]
    sensitivity: Mapping[str, LoopSensitivity] | None = optional()
    inseparable: str | None = optional()
    ensemble: OverEnsemble | None = optional()
    records: tuple[str, ...] = ()
    made: Made | None = optional()

    def to_dict(self) -> dict[str, Any]:
        """Plain values, as in separate.json."""
        return dict(to_plain(self, finite=False))

    def __repr__(self) -> str:
        shares = ", ".join(f"{name.replace('_', ' ')} {_share(part)}" for name, part in self.contributions.items())
        return f"Separation({self.rig['name']}: {self.total.width_deg:.3g} deg wide; energy: {shares})"

    def __str__(self) -> str:
        """Show a screen of it: every part of the loop, and the numbers of a calibrated rig."""
        low, high = self.drive_mm
        lines = [
            f"loop of {self.rig['name']}, {low:.4g} to {high:.4g} mm, {self.engine}",
            f"  {'part':<18} {'of energy':>10} {'mJ a cycle':>12} {'width, deg':>12}",
        ]
        for name, part in self.contributions.items():
            words = name.replace("_", " ")
            lines.append(f"  {words:<18} {_share(part):>10} {part.dissipated_mJ:>12.4g} {part.width_deg:>12.4g}")
        total = self.total
        lines.append(f"  {'whole':<18} {'':>10} {total.dissipated_mJ:>12.4g} {total.width_deg:>12.4g}")
        if self.calibration is not None:
            lines += [f"  {name} = {parameter}" for name, parameter in self.calibration.parameters.items()]
        return on_screen([*lines, *(f"  warning: {text}" for text in self.warnings)])

    def _repr_html_(self) -> str:
        rows = [
            (name.replace("_", " "), _share(part), f"{part.dissipated_mJ:.4g}", f"{part.width_deg:.4g}")
            for name, part in self.contributions.items()
        ]
        total = self.total
        rows.append(("whole", "", f"{total.dissipated_mJ:.4g}", f"{total.width_deg:.4g}"))
        head = ("part", "share of energy", "mJ a cycle", "width, deg")
        notes = (f"warning: {text}" for text in self.warnings)
        return html_table(f"loop of {self.rig['name']}, {self.engine}", rows, head, notes)


def _share(part: Contribution) -> str:
    return "-" if part.share is None else f"{100 * part.share:.3g} %"

"""What an identification gives: :class:`Fit`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats, Mask
from hysteresis.bouc_wen import BoucWen, hysteresis_batch
from hysteresis.metrics import Errors
from hysteresis.record import DriveUnit
from hysteresis.search import Form, Point
from hysteresis.uncertainty import Parameter

Label = Literal["analytic", "chain", "fitted", "theory"]


_PLACES = 257  # of f in identify.json: between them a curve of 17 slopes is met to 1e-5 of its range


@dataclass(frozen=True, eq=False)
class Fit:
    """Result of :func:`hysteresis.identify.identify`: theta = f(x) + h, what it gets right, what to beware of.

    ``parameters`` holds A, beta, gamma, n, h0_deg, what else is free in h, and, for given kinematics, what was free in
    them; ``baseline_*`` are the errors of :meth:`plain`, the best single-valued f of the same freedom, fitted to the
    same samples. Records whose samples are met as well without hysteresis have A = 0, h = 0 and f = plain.
    ``heldout_masks``, shapes (m_i,), mark the samples of each record that were hidden from the fit.
    ``bootstrap`` has the intervals by blocks beside those of the Jacobian in ``parameters``; ``seeds_agreeing`` counts
    the searches, of ``seeds`` in all, that ended as well as the best one, to 1 %.
    """

    records: tuple[str, ...]
    kinematics: Label
    parameters: dict[str, Parameter]
    saturation_deg: Parameter
    train: Errors
    heldout: Errors
    baseline_train: Errors
    baseline_heldout: Errors
    heldout_of_records: tuple[Errors | None, ...]  # None for a record all of which was fitted
    heldout_by: str
    noise_floor_deg: float
    bootstrap: dict[str, Parameter]
    correlations: dict[str, float]  # of two coordinates of the law, "A ~ n"
    warnings: tuple[str, ...]
    form: Form
    point: Point
    plain_point: Point  # f without hysteresis
    heldout_masks: tuple[Mask, ...]
    drive_range: tuple[float, float]  # of all records
    drive_unit: DriveUnit
    first_drive: float  # of the first record
    method: str
    evaluations: int
    seconds: float
    seed: int
    seeds: int
    seeds_agreeing: int

    @property
    def models(self) -> list[BoucWen]:
        """Elements of h in the first record."""
        return self.point.models(self.form)

    @property
    def model(self) -> BoucWen:
        """First element of h in the first record."""
        return self.models[0]

    @property
    def delay_s(self) -> float:
        """Delay of the angle behind the drive."""
        return self.form.delay_s(self.point.q)

    @property
    def coefficients(self) -> Floats:
        """Coefficients of f, shape (p,)."""
        return self.point.c

    @property
    def heldout_mask(self) -> Mask:
        """Samples of the first record that were hidden from the fit, shape (m,)."""
        return self.heldout_masks[0]

    def f(self, drive: ArrayLike, record: int = 0) -> Floats:
        """Single-valued part of the angle, without the record's zero, shape (m,) -> (m,), deg."""
        return self.form.backbones[record].at(np.asarray(drive, dtype=float))(self.point.c)

    def plain(self, drive: ArrayLike, record: int = 0) -> Floats:
        """Angle of the best curve without hysteresis, the baseline, shape (m,) -> (m,), deg."""
        f = self.form.backbones[record].at(np.asarray(drive, dtype=float))(self.plain_point.c)
        return f + self._zero_deg(self.plain_point, record)

    def predict(self, drive: ArrayLike, time_s: ArrayLike | None = None, record: int = 0) -> Floats:
        """Angle along a path of the drive, shape (m,) -> (m,), deg; it starts in the state h0_deg of the record.

        ``time_s``, shape (m,), is needed where the fit has a delay, and of no account elsewhere.

        Raises
        ------
        ValueError
            No times, where there is a delay.
        """
        path, delay = np.asarray(drive, dtype=float), self.form.delay_s(self.point.q)
        if delay > 0:
            if time_s is None:
                raise ValueError(f"time_s: missing: the angle is {delay:g} s behind the drive: expected times")
            time = np.asarray(time_s, dtype=float)
            path = np.interp(time - delay, time, path)
        f = self.f(path, record)
        rows = self.form.rows(np.array([self.point.sign]), self.point.q[np.newaxis], record)[0]
        return f + hysteresis_batch(f, rows).sum(axis=0) + self._zero_deg(self.point, record)

    def _zero_deg(self, point: Point, record: int) -> float:
        return float(point.q[self.form.zeros][record - 1]) if record else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Give the contents of identify.json (docs/guide/identification.md)."""
        places = np.linspace(*self.drive_range, _PLACES)
        return {
            "schema": 1,
            "records": list(self.records),
            "kinematics": self.kinematics,
            "model": "bouc-wen",
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "train": self.train.to_dict(),
            "heldout": self.heldout.to_dict(),
            "evaluations": self.evaluations,
            "seconds": self.seconds,
            "warnings": list(self.warnings),
            "baseline": {"train": self.baseline_train.to_dict(), "heldout": self.baseline_heldout.to_dict()},
            "heldout_of_records": [None if e is None else e.to_dict() for e in self.heldout_of_records],
            "heldout_by": self.heldout_by,
            "noise_floor_deg": self.noise_floor_deg,
            "saturation_deg": self.saturation_deg.to_dict(),
            "elements": self.form.elements,
            "admissible": {
                "bounded": all(model.is_bounded() for model in self.models),
                "passive": all(model.is_passive() for model in self.models),
            },
            "bootstrap": {name: parameter.to_dict() for name, parameter in self.bootstrap.items()},
            "correlations": self.correlations,
            "f": {
                "drive": places.tolist(),
                "angle_deg": self.f(places).tolist(),
                "without_hysteresis_deg": self.plain(places).tolist(),
            },
            "drive_unit": self.drive_unit,
            "first_drive": self.first_drive,
            "method": self.method,
            "seed": self.seed,
            "seeds": self.seeds,
            "seeds_agreeing": self.seeds_agreeing,
        }

    def __str__(self) -> str:
        lines = [f"Bouc-Wen on {', '.join(self.records)}, kinematics {self.kinematics}"]
        lines += [f"  {name:<12} {parameter}" for name, parameter in self.parameters.items()]
        lines += [f"  {'saturation':<12} {self.saturation_deg}"]
        pairs = (("train", self.train, self.baseline_train), ("held out", self.heldout, self.baseline_heldout))
        for name, mine, plain in pairs:
            lines.append(
                f"  {name:<12} {mine.rmse_deg:.3g} deg rmse, {mine.max_abs_deg:.3g} deg at most; "
                f"without hysteresis {plain.rmse_deg:.3g} deg rmse"
            )
        lines += [f"  held out by  {self.heldout_by}", f"  noise floor  {self.noise_floor_deg:.2g} deg"]
        return "\n".join([*lines, *(f"  warning: {text}" for text in self.warnings)])

"""The result of an identification: :class:`Fit`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from hysteresis.arrays import Floats, Mask
from hysteresis.display import html_table, on_screen
from hysteresis.extras import require_extra
from hysteresis.fitting.form import Form, Point
from hysteresis.fitting.law_choice import LawChoice
from hysteresis.fitting.response import Open
from hysteresis.fitting.settings import IdentifySettings
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import BOUC_WEN, Element
from hysteresis.records.metrics import Errors
from hysteresis.records.record import DriveUnit, Record

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

KinematicsLabel = Literal["analytic", "chain", "fitted", "theory"]
"""Origin of f: a model of the rig, a fit to the data, or the record's own theory."""

_LAYER_WORDS = {
    "saturation_deg": "saturation",
    "slope_after_reversal": "slope after a reversal",
    "reach_deg": "reach",
}
_PLACES = 257  # samples of f in identify.json: interpolation of a curve of 17 slopes is within 1e-5 of its range


@dataclass(frozen=True, eq=False, repr=False)
class Fit:
    """Result of :func:`hysteresis.fitting.identification.identify`: theta = f(x) + h, its errors, and warnings.

    ``observed`` are the records that were fitted. ``parameters`` holds A, beta, gamma, n, h0_deg, the other parameters
    of h, and, for given kinematics, their fitted parameters. ``baseline_*`` are the errors of :meth:`plain`, the best
    single-valued f of the same form, fitted to the same samples. If h is not significant, A = 0, h = 0 and f = plain.
    ``heldout_masks``, shapes (m_i,), mark the held-out samples of each record. ``bootstrap`` has the intervals by
    blocks, ``parameters`` those of the Jacobian; ``seeds_agreeing`` counts the searches that ended within 1 %
    of the best one. ``layer`` describes the hysteresis in a form that the data can fix, ``not_fixed`` says which of A,
    beta, gamma and n they leave open (:mod:`hysteresis.fitting.response`). ``notes`` say what was left out. ``choice``
    is how the law was chosen, if it was. ``bouc_wen`` is the Bouc-Wen fit that accompanies a fit of another law; None
    if this is the one.
    """

    observed: tuple[Record, ...]
    kinematics: KinematicsLabel
    settings: IdentifySettings
    parameters: dict[str, Parameter]
    saturation_deg: Parameter
    train: Errors
    heldout: Errors
    baseline_train: Errors
    baseline_heldout: Errors
    heldout_of_records: tuple[Errors | None, ...]  # None for a record without held-out samples
    heldout_by: str
    noise_floor_deg: float
    bootstrap: dict[str, Parameter]
    correlations: dict[str, float]  # of two parameters of the law, "A ~ n"
    warnings: tuple[str, ...]
    form: Form
    point: Point
    baseline_point: Point  # f without hysteresis
    heldout_masks: tuple[Mask, ...]
    evaluations: int
    seeds_agreeing: int
    seconds: float
    layer: dict[str, Parameter]
    not_fixed: Open | None
    notes: tuple[str, ...] = ()
    choice: LawChoice | None = None
    bouc_wen: Fit | None = None

    @property
    def records(self) -> tuple[str, ...]:
        """Names of the records: their files, else their titles."""
        return tuple(record.source or record.title or "record" for record in self.observed)

    @property
    def drive_unit(self) -> DriveUnit:
        """Unit of the drive, the same in all records."""
        return self.observed[0].drive_unit

    @property
    def drive_range(self) -> tuple[float, float]:
        """Ends of the drives of all records."""
        drives = np.concatenate([record.drive for record in self.observed])
        return float(drives.min()), float(drives.max())

    @property
    def first_drive(self) -> float:
        """Drive at the first sample of the first record."""
        return float(self.observed[0].drive[0])

    @property
    def elements(self) -> list[Element]:
        """Elements of h in the first record, of any law."""
        return self.point.elements(self.form)

    @property
    def models(self) -> list[BoucWen]:
        """Elements of h in the first record, of the Bouc-Wen law.

        Raises
        ------
        ValueError
            The fit has another law.
        """
        return self.point.models(self.form)

    @property
    def law_title(self) -> str:
        """Name of the law in words."""
        title, number = self.form.base_law.title, self.form.elements
        return title if number == 1 else f"{number} {title} elements"

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

    def f(self, drive: ArrayLike, record: int = 0) -> Floats:
        """Evaluate the single-valued part of the angle, without the record's zero, shape (m,) -> (m,), deg."""
        return self.form.backbones[record].at(np.asarray(drive, dtype=float))(self.point.c)

    def plain(self, drive: ArrayLike, record: int = 0) -> Floats:
        """Evaluate the baseline, the best curve without hysteresis, shape (m,) -> (m,), deg."""
        f = self.form.backbones[record].at(np.asarray(drive, dtype=float))(self.baseline_point.c)
        return f + self._zero_deg(self.baseline_point, record)

    def predict(self, drive: ArrayLike, time_s: ArrayLike | None = None, record: int = 0) -> Floats:
        """Predict the angle along a path of the drive, shape (m,) -> (m,), deg.

        The path starts in the initial state h0_deg of the record. ``time_s``, shape (m,), is required if the fit has a
        delay, and ignored otherwise.

        Raises
        ------
        ValueError
            A delay without times.
        """
        path, delay = np.asarray(drive, dtype=float), self.delay_s
        if delay > 0:
            if time_s is None:
                raise ValueError(f"time_s: missing: the angle is {delay:g} s behind the drive: expected times")
            time = np.asarray(time_s, dtype=float)
            path = np.interp(time - delay, time, path)
        f = self.f(path, record)
        h = self.form.hysteresis_along(f, np.array([self.point.sign]), self.point.q[np.newaxis], record)[0]
        return f + h + self._zero_deg(self.point, record)

    def _zero_deg(self, point: Point, record: int) -> float:
        return float(point.q[self.form.zeros][record - 1]) if record else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the contents of identify.json (documented in docs/guide/identification.md).

        It is that of the Bouc-Wen layer; another law is under ``law``.
        """
        if self.bouc_wen is not None:
            return self.bouc_wen.to_dict() | {"seconds": self.seconds, "law": self._of_law()}
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
            "method": self.settings.method,
            "seed": self.settings.seed,
            "seeds": self.settings.seeds,
            "seeds_agreeing": self.seeds_agreeing,
            "layer": {name: parameter.to_dict() for name, parameter in self.layer.items()},
            "not_fixed": None if self.not_fixed is None else self.not_fixed.to_dict(),
            "notes": list(self.notes),
            "law": self._of_law(),
        }

    def _of_law(self) -> dict[str, Any]:
        """Return the law of this fit, with all that :func:`hysteresis.laws.elements.elements_of` and a reader need."""
        places = np.linspace(*self.drive_range, _PLACES)
        return {
            "name": self.form.base_law.name,
            "title": self.law_title,
            "choice": None if self.choice is None else self.choice.to_dict(),
            "parameters": {name: parameter.to_dict() for name, parameter in self.parameters.items()},
            "layer": {name: parameter.to_dict() for name, parameter in self.layer.items()},
            "train": self.train.to_dict(),
            "heldout": self.heldout.to_dict(),
            "warnings": list(self.warnings),
            "sign": self.point.sign,
            "values": self.form.values(self.point.q[np.newaxis], 0)[0].tolist(),
            "place": list(self.form.place),
            "delay_s": self.delay_s,
            "f": {"drive": places.tolist(), "angle_deg": self.f(places).tolist()},
        }

    def to_dataframe(self, record: int = 0) -> pd.DataFrame:
        """Return a record sample by sample, with the columns of the CSV that ``notchbend identify`` writes.

        The columns are drive, angle_deg, f_alone_deg (:meth:`plain`), predicted_deg and heldout.
        """
        require_extra("study", "to_dataframe")
        import pandas as pd  # takes a quarter of a second, and only this needs it

        return pd.DataFrame(self.columns(record))

    def to_xarray(self, record: int = 0) -> xr.Dataset:
        """Return a record sample by sample as a dataset: the columns of :meth:`to_dataframe` along ``sample``.

        Each variable has the attribute ``units``; the attributes of the dataset are the parameters and the errors.
        """
        require_extra("study", "to_xarray")
        import xarray as xr

        units = {"drive": self.drive_unit, "heldout": "1"}
        data = {n: ("sample", c, {"units": units.get(n, "deg")}) for n, c in self.columns(record).items()}
        facts = {name: parameter.value for name, parameter in self.parameters.items()}
        facts |= {"train_rmse_deg": self.train.rmse_deg, "heldout_rmse_deg": self.heldout.rmse_deg}
        return xr.Dataset(data, attrs={"record": self.records[record], **facts})

    def columns(self, record: int = 0) -> dict[str, Floats | Mask]:
        """Return the columns of :meth:`to_dataframe` by name, each of shape (m,)."""
        observed = self.observed[record]
        return {
            "drive": observed.drive,
            "angle_deg": observed.angle_deg,
            "f_alone_deg": self.plain(observed.drive, record),
            "predicted_deg": self.predict(observed.drive, observed.time_s, record),
            "heldout": self.heldout_masks[record],
        }

    def __repr__(self) -> str:
        shown = ("A", "beta", "gamma", "n") if self.form.base_law is BOUC_WEN else tuple(self.layer)
        known = self.parameters | self.layer
        law = ", ".join(f"{name} = {known[name].value:.4g}" for name in shown)
        law = law if self.form.base_law is BOUC_WEN else f"{self.law_title}, {law}"
        errors = f"{self.heldout.rmse_deg:.3g} deg, without hysteresis {self.baseline_heldout.rmse_deg:.3g} deg"
        names = ", ".join(Path(name).name for name in self.records)
        return f"Fit({names}: f {self.kinematics}, {law}, held-out rmse {errors}, {len(self.warnings)} warnings)"

    def _words(self, *, brief: bool = False) -> list[str]:
        """Say what a reader needs with the numbers: the choice of the law, what is not fixed, notes and warnings.

        A brief choice is without the errors of the other laws.
        """
        words = [] if self.choice is None else [f"law: {self.choice.why if brief else self.choice.reason}"]
        words += [] if self.not_fixed is None else [f"not fixed: {self.not_fixed.words}"]
        return [*words, *(f"note: {text}" for text in self.notes), *(f"warning: {text}" for text in self.warnings)]

    def _repr_html_(self) -> str:
        shown = self.layer | self.parameters | {"saturation_deg": self.saturation_deg}
        rows = [
            (name, f"{p.value:.4g}", *("" if end is None else f"{end:.4g}" for end in (p.low, p.high)), p.unit)
            for name, p in shown.items()
        ]
        notes = [
            f"rmse: training {self.train.rmse_deg:.3g} deg, held out {self.heldout.rmse_deg:.3g} deg; "
            f"without hysteresis {self.baseline_train.rmse_deg:.3g} and {self.baseline_heldout.rmse_deg:.3g} deg",
            f"held out: {self.heldout_by}",
            f"noise floor: {self.noise_floor_deg:.2g} deg",
            *self._words(),
        ]
        title = f"{self.law_title} on {', '.join(self.records)}, kinematics {self.kinematics}"
        return html_table(title, rows, ("parameter", "value", "low (95 %)", "high (95 %)", "unit"), notes)

    def __str__(self) -> str:
        """Show a screen of it; ``parameters`` has the intervals of all, ``choice`` and ``bouc_wen`` the other laws."""
        lines = [f"{self.law_title} on {', '.join(self.records)}, kinematics {self.kinematics}"]
        layer = self.layer or {"saturation_deg": self.saturation_deg}
        lines += [f"  {_LAYER_WORDS.get(name, name):<22} {parameter}" for name, parameter in layer.items()]
        values = (f"{name} = {replace(p, low=None, high=None)}" for name, p in self.parameters.items())
        papers = " of the paper" if self.form.base_law is BOUC_WEN else ""
        lines.append(f"  parameters{papers}: {', '.join(values)}")
        pairs = (("train", self.train, self.baseline_train), ("held out", self.heldout, self.baseline_heldout))
        for name, mine, plain in pairs:
            lines.append(
                f"  {name:<8} {mine.rmse_deg:.3g} deg rmse, {mine.max_abs_deg:.3g} deg at most; "
                f"without hysteresis {plain.rmse_deg:.3g} deg"
            )
        if self.bouc_wen is not None:
            lines.append(f"  Bouc-Wen alone: held out {self.bouc_wen.heldout.rmse_deg:.3g} deg rmse")
        lines += [f"  held out by: {self.heldout_by}", f"  noise floor: {self.noise_floor_deg:.2g} deg"]
        return on_screen([*lines, *(f"  {text}" for text in self._words(brief=True))])

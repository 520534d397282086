"""Forms of effects on a curve in the units of the records: what fits a drive in mm fits one in motor steps."""

from __future__ import annotations

from dataclasses import dataclass

from validation.tracing.effect import CurveForm, FreeParameter, RelativeParameter, Values


@dataclass(frozen=True)
class PlacedForm:
    """A form with its parameters in the units of the records."""

    form: CurveForm
    parameters: tuple[FreeParameter, ...]
    starts: tuple[Values, ...]

    def relative_values(self, values: Values) -> Values:
        """Values under the names that the operators of the form know."""
        return {
            relative.name: values[placed.name]
            for relative, placed in zip(self.form.parameters, self.parameters, strict=True)
        }


@dataclass(frozen=True)
class CurveScale:
    """Sizes of the records, which relative parameters are multiplied with.

    ``drive`` is half the stroke in ``unit``, ``angle`` half the largest range, deg, ``time`` the shortest record, s.
    """

    drive: float
    angle: float
    time: float
    unit: str

    def factor(self, unit: str) -> float:
        """Size of a relative unit, a product or quotient of ``drive``, ``angle``, ``time`` and ``-``."""
        top, _, bottom = unit.partition("/")
        return self._size(top) / self._size(bottom or "-")

    def _size(self, name: str) -> float:
        return {"drive": self.drive, "angle": self.angle, "time": self.time}.get(name, 1.0)

    def placed(self, form: CurveForm) -> PlacedForm:
        """Give a form the units of the records."""
        parameters = tuple(map(self._placed, form.parameters))
        pairs = [(a.name, b.name, self.factor(a.unit)) for a, b in zip(form.parameters, parameters, strict=True)]
        starts = tuple({b: start[a] * factor for a, b, factor in pairs} for start in form.starts)
        return PlacedForm(form, parameters, starts)

    def _placed(self, parameter: RelativeParameter) -> FreeParameter:
        """Give a parameter its unit, and its name that unit."""
        factor = self.factor(parameter.unit)
        names = {"drive": self.unit, "angle": "deg", "time": "s"}
        unit = "/".join(names.get(part, part) for part in parameter.unit.split("/"))
        name = f"{parameter.name}_{self.unit}" if parameter.unit == "drive" else parameter.name
        scale = parameter.scale if parameter.log else parameter.scale * factor
        return FreeParameter(
            name,
            unit,
            parameter.low * factor,
            parameter.high * factor,
            scale,
            log=parameter.log,
            amount=parameter.amount,
            sensible=parameter.sensible,
        )

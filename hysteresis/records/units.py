"""Units that the names of columns say, and their factors to those of a record: mm, deg, s and N."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Literal

Measured = Literal["drive", "angle", "time", "force"]
"""What a column of a record measures; a drive may be a length, an angle, steps or a force."""


@dataclass(frozen=True)
class Unit:
    """A unit: what it is of, its factor to mm, deg, s or N (nan where there is none), and how it is written."""

    kind: str
    factor: float
    symbol: str


_FACTORS: dict[str, dict[str, float]] = {
    "length": {
        "mm millimeter millimeters millimetre millimetres 毫米": 1.0,
        "um µm μm micron microns micrometer micrometers micrometre micrometres": 1e-3,
        "cm centimeter centimeters centimetre centimetres 厘米": 10.0,
        "dm": 100.0,
        "m meter meters metre metres": 1e3,
        "in inch inches": 25.4,
        "mil mils thou": 0.0254,
        "ft feet": 304.8,
    },
    "angle": {
        "deg degs degree degrees ° º grad": 1.0,  # grad: degrees in some languages
        "degrés grados gradi graus grader graden 度": 1.0,
        "rad rads radian radians 弧度": 180.0 / math.pi,
        "mrad mrads milliradian milliradians": 0.18 / math.pi,
        "turn turns rev revs revolution revolutions": 360.0,
        "urad µrad μrad": 0.18e-3 / math.pi,
        "ddeg": 0.1,
        "cdeg": 0.01,
        "mdeg millideg": 1e-3,
        "gon": 0.9,
        "arcmin": 1.0 / 60.0,
        "arcsec": 1.0 / 3600.0,
    },
    "time": {
        "s sec secs second seconds 秒": 1.0,
        "ms msec msecs millis millisec millisecond milliseconds 毫秒": 1e-3,
        "us µs μs usec micros microsec microsecond microseconds": 1e-6,
        "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds": 1e-9,
        "min mins minute minutes": 60.0,
        "h hr hrs hour hours": 3600.0,
    },
    "force": {
        "n newton newtons": 1.0,
        "mn millinewton millinewtons": 1e-3,
        "cn": 1e-2,
        "dan": 10.0,
        "oz ozf": 0.27801385,
        "kn kilonewton kilonewtons": 1e3,
        "g gf gram grams": 9.80665e-3,
        "kg kgf kilogram kilograms": 9.80665,
        "lb lbs lbf": 4.4482216152605,
    },
}
_WITHOUT_FACTOR = {
    "steps": "step steps",
    "counts": "tick ticks count counts cnt cnts inc incs increments pulse pulses lsb digits raw adc bit bits pwm duty",
    "voltage": "v mv volt volts voltage vdc vac",
    "current": "a ma amp amps ampere amperes",
    "torque": "nm n·m mnm nmm ncm n*m n.m",
    "pressure": "pa kpa mpa bar mbar psi",
    "strain": "strain ustrain microstrain ue µε",
    "percent": "pct % percent ppm",
    "temperature": "°c degc celsius kelvin",
    "frequency": "hz khz",
    "rate": "dps rpm mm/s deg/s rad/s m/s °/s",
    "pixels": "px pixel pixels",
    "function": "sin cos tan",
}
UNITS: dict[str, Unit] = {
    symbol: Unit(kind, factor, symbol)
    for kind, group in _FACTORS.items()
    for symbols, factor in group.items()
    for symbol in symbols.split()
} | {symbol: Unit(kind, math.nan, symbol) for kind, symbols in _WITHOUT_FACTOR.items() for symbol in symbols.split()}
"""Units by how they are written, in small letters."""
_SHORT: dict[Measured, frozenset[str]] = {
    "drive": frozenset({"m", "in", "N", "n", "V", "mn", "kn", "dm", "mil", "inc", "dan", "daN", "oz"}),
    "angle": frozenset({"V", "N", "kn"}),
    "time": frozenset({"s", "h", "min", "us", "ns"}),
    "force": frozenset({"N", "n", "g", "V", "dan", "daN", "oz"}),
}
"""Short words that are a unit at the end of a name of what is measured; elsewhere they may number or label a column."""
_LABELS = frozenset(
    ["m", "g", "h", "s", "n", "v", "a", "in", "min", "raw", "us", "bit", "bits", "duty", "dm", "mil", "dan", "oz",
     "inc"]
)  # fmt: skip
_WORDS = {
    "force": "force load tension weight",
    "torque": "torque tau moment",
    "strain": "strain strains",
    "voltage": "volt volts voltage",
    "current": "current amps",
    "pressure": "pressure",
    "temperature": "temperature temp",
    "counts": "counts ticks pulses pwm adc",
    "angle": "angle theta bend bending winkel phi yaw tilt rotation",
    "length": "displacement stroke position travel",
}
_KIND_OF_WORD = {word: kind for kind, words in _WORDS.items() for word in words.split()}
_OTHER_KINDS = {
    "drive": frozenset({"torque", "strain", "voltage", "current", "pressure", "temperature", "counts"}),
    "angle": frozenset({"force", "torque", "strain", "voltage", "current", "pressure", "temperature", "counts"}),
    "time": frozenset[str](),
    "force": frozenset({"torque", "strain", "voltage", "current", "pressure", "temperature", "counts"}),
}
_RATES = frozenset(["per", "rate", "speed", "velocity", "vel", "dot", "omega", "acceleration", "accel", "acc"])
_NO_UNITS = frozenset(
    ["tip", "base", "left", "top", "ref", "cmd", "act", "avg", "mean", "rel", "abs", "x", "y", "z", "l", "r", "a", "b",
     "up", "down", "imu", "cam", "em", "hall", "tcp", "enc", "filt", "meas", "true", "set", "sim", "exp", "fit", "rot",
     "bend", "pos"]
)  # fmt: skip
"""Short words in brackets that say which column it is."""
_CALLED = {"counts": "counts of a converter or encoder", "rate": "a rate", "percent": "a percentage",
           "pixels": "pixels", "function": "a function of it", "scaled": "a multiple of a unit"}  # fmt: skip
EXPECTED: dict[Measured, str] = {
    "drive": "mm, deg, steps or N",
    "angle": "degrees",
    "time": "seconds",
    "force": "newtons",
}
_OF_KEY: dict[str, Measured] = {
    "drive": "drive",
    "drive_2": "drive",
    "drive_3": "drive",
    "drive_4": "drive",
    "angle": "angle",
    "angle_2": "angle",
    "torsion": "angle",
    "notches": "angle",
    "force": "force",
    "tension_a": "force",
    "tension_b": "force",
    "tension_c": "force",
    "tension_d": "force",
    "time": "time",
}
"""Key of ``[columns]`` -> what is measured."""


def called(kind: str) -> str:
    """Name what a unit is of in a message: "a force", "counts of an encoder"."""
    return _CALLED.get(kind, f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}")


def unit_of(measured: Measured, name: str, given: str = "") -> Unit | None:
    """Find the unit of a column; None where neither its name nor a row of units says one.

    A name says it in brackets (``x [mm]``), after a slash or "in" (``x / mm``), or as a word: the last one that is a
    unit counts (``current_position_mm``). Without a unit, a word may say what is measured, as in ``motor_torque``.

    Parameters
    ----------
    measured
        What the column is to be. Short words that may as well number a column are a unit of some of these only.
    given
        What a row of units below the names says of the column.
    """
    if given and (unit := unit_called(given)) is not None:
        return unit
    attached = re.findall(r"[\W_](10+[^\W\d_]+)$", name)  # pos_10um
    for part in [*reversed(_in_brackets(name)), *attached]:
        if (unit := unit_called(part)) is not None:
            return unit
    after = re.search(r"[^/]\s*(?:/|\bin\b)\s*([^\s/]+)\s*$", name)
    if after is not None and name.count("/") <= 1 and (unit := _lookup(after[1])) is not None:
        return unit
    return _unit_of_words(measured, _words(name))


def unit_called(text: str) -> Unit | None:
    """Give the unit that a text is, or the multiple of one (of the kind "scaled"); None where it is neither."""
    return _lookup(text) or _scaled(text)


def unknown_unit(name: str) -> str | None:
    """Give what stands in brackets at the end of a name, as a unit does, and is none; None where nothing does."""
    found = re.search(r"[\[(<]\s*([^\[\]()<>\s]{1,4})\s*[\])>]\s*$", name)
    if found is None or re.search(r"\d", found[1]) or found[1].lower() in _NO_UNITS:
        return None
    return found[1] if unit_of("drive", f"[{found[1]}]") is None else None


def _in_brackets(name: str) -> list[str]:
    return re.findall(r"[\[(<{]([^\[\]()<>{}]*)[\])>}]", name)


def _scaled(text: str) -> Unit | None:
    """Tell a multiple of a unit, such as ``0.01 mm``, ``mm x100``, ``10^-2 mm`` or ``pi rad``."""
    words = [] if re.fullmatch(r"\s*[^\W\d_]+\d+\s*", text) else re.findall(r"[^\W\d_]+|[°º]", text.lower())
    units = [word for word in words if word in UNITS and UNITS[word].factor > 0]
    others = set(words) - set(units) - {"x", "e", "pi", "π"}
    of_number = re.search(r"\d|\bpi\b|π", text.lower()) and not re.search(r"[=:±]|\+-|\d\s*([-–]|\.\.)\s*\d", text)
    return Unit("scaled", math.nan, text.strip()) if len(units) == 1 and not others and of_number else None


def _lookup(text: str) -> Unit | None:
    return UNITS.get(re.sub(r"\s+|\^1", "", text.strip(" []()")).lower())


def _words(name: str) -> list[str]:
    """Split a name at what is no letter, and where a small letter is followed by a capital (``angleDeg``)."""
    words = re.findall(r"[^\W\d_]+|[°º%]", name)
    return [part for word in words for part in ([word] if _lookup(word) else re.findall(r"[A-Z]*[^A-Z]+|[A-Z]+", word))]


def _unit_of_words(measured: Measured, words: list[str]) -> Unit | None:
    small = [word.lower() for word in words]
    if measured != "time" and _is_rate(small):
        return UNITS["mm/s"]
    if words[-2:] == ["N", "m"]:
        return UNITS["nm"]
    kinds = [_KIND_OF_WORD[word] for word in small if word in _KIND_OF_WORD]
    if "angle" in kinds and "length" not in kinds and small[-1] in ("m", "in"):  # theta_m: of the motor, no length
        words = words[:-1]
    units = [_unit_of_word(measured, word, last=i == len(words) - 1) for i, word in enumerate(words)]
    if (found := next(filter(None, reversed(units)), None)) is not None:
        return found
    return Unit(kinds[-1], math.nan, "") if kinds and kinds[-1] in _OTHER_KINDS[measured] else None


def _is_rate(words: list[str]) -> bool:
    """Tell whether words are of a rate: ``deg_s``, ``mm_per_min``, ``wheel_speed``."""
    if _RATES & set(words):
        return True
    of = UNITS.get(words[-2]) if words[-1:] in (["s"], ["sec"], ["min"]) and len(words) > 1 else None
    return of is not None and of.kind in ("length", "angle", "force")


def _unit_of_word(measured: Measured, word: str, *, last: bool) -> Unit | None:
    unit = _lookup(word)
    if unit is None or word in ("°", "º", "%") or (len(word) > 1 and word.lower() not in _LABELS):
        return unit
    return unit if last and word in _SHORT[measured] else None


def expected_unit(key: str, name: str) -> str | None:
    """Say which unit was expected of a column, by its key of ``[columns]``, if its name says another; else None."""
    measured = _OF_KEY.get(key)
    unit = None if measured is None else unit_of(measured, name)
    if measured is None or unit is None:
        return None
    return None if declared_unit(measured, unit) is not None else EXPECTED[measured]


def declared_unit(measured: Measured, unit: Unit) -> str | None:
    """Give a unit as a record has it, such as "mm" or "step" of a drive; None if a record has no such unit there."""
    if unit.kind == "steps" and measured == "drive":
        return "step"
    of: dict[Measured, tuple[str, ...]] = {"drive": ("length", "angle", "force")}
    fits = unit.kind in of.get(measured, (measured,)) and unit.factor == 1.0
    return {"length": "mm", "angle": "deg", "time": "s", "force": "N"}[unit.kind] if fits else None

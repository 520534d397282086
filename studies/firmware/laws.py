"""The law of h as C: the constants of its elements, and which templates compute it."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.bouc_wen import BoucWen
from hysteresis.laws.elements import AsymmetricElement, Element, StopsElement
from hysteresis.laws.flow import LIMITS, T_ABOVE, U_TOP, Y_ABOVE, Y_BELOW, Y_OVER, Y_TOP, R, Y, set_kappa, workspace
from hysteresis.laws.stops import FARTHEST, THRESHOLDS, thresholds, width_factor

_UNLIMITED = 1e30  # in place of an infinite limit; a state is of order 1
_A_LINE = 100
_SMOOTH = 1e-5  # of the f over which h saturates: the third power is below rounding
_STRAIGHT = {
    "growth": "", "width": "way->scale", "moving": "moves", "moves": "of_last", "keeps_width": "",
    "settled_width": "way->scale", "width_member": "", "bends": "",
}  # fmt: skip
_BENDING = {  # the thresholds change with f
    "growth": ", growth = 0, bend = 0, width = way->scale * width_at(f, &PLACES[i], &growth, &bend)",
    "width": "width",
    "moving": "(moves + growth * held)",
    "moves": "(of_last + growth * (1 - of_last) * stop)",
    "bends": "        slopes[1] += bend * (e->weight * held + e->more_of_last * (1 - of_last) * stop);\n",
    "keeps_width": "        way->width[i] = width;\n",
    "settled_width": "way->width[i]",
    "width_member": "    real width[ELEMENTS];\n",
}


@dataclass(frozen=True)
class LawInC:
    """One law in C.

    ``templates`` are the files of the folder ``c`` that compute it and ``values`` what stands in them. ``memory`` is
    the initial state, shape (k,), deg, and ``remembers`` says what it is. ``functions`` are those of math.h.
    ``stack_bytes`` bounds the stack of all calls together: gcc 12, -O2, x86-64, double. ``smooth_deg`` is a change of f
    over which the third term of the Taylor series of h is below rounding; 0 for a law with corners.
    """

    templates: tuple[str, ...]
    values: dict[str, str]
    memory: Floats
    remembers: str
    functions: tuple[str, ...]
    stack_bytes: int
    smooth_deg: float = 0.0


def law_in_c(elements: Sequence[Element], f_start_deg: float) -> LawInC:
    """Give the law of elements that are all of one kind, in their present state at an f, deg.

    Raises
    ------
    ValueError
        A constant that is not finite.
    """
    moving = [one for one in elements if one.saturation_deg > 0.0]  # one with A = 0 has no hysteresis
    match moving:
        case [BoucWen(), *_]:
            return _bouc_wen([one for one in moving if isinstance(one, BoucWen)])
        case [AsymmetricElement(), *_]:
            return _asymmetric([one for one in moving if isinstance(one, AsymmetricElement)])
        case [StopsElement(), *_]:
            return _stops([one for one in moving if isinstance(one, StopsElement)], f_start_deg)
    return LawInC(("nothing.c",), {}, np.zeros(1), "not used: the fit has no hysteresis", (), 600)


def number(value: float) -> str:
    """Give a constant of C with all its digits.

    Raises
    ------
    ValueError
        One that is not finite.
    """
    if not math.isfinite(value):
        raise ValueError(f"a constant of the law is {value}: expected finite numbers")
    return f"R({float(value)!r})"


def listed(values: Iterable[float], indent: str = "    ") -> str:
    """Give constants between commas, in lines of at most 100 characters."""
    lines, line = list[str](), ""
    for word in map(number, values):
        if line and len(line) + len(word) + 2 > _A_LINE:
            lines.append(line)
            line = ""
        line += f", {word}" if line else word
    return ",\n".join(indent + one for one in [*lines, line])


def _flows(exponents: Sequence[float]) -> str:
    """Tabulate the series of :mod:`hysteresis.laws.flow`, one for each element."""
    rows = []
    for n in exponents:
        work = workspace(n)
        limits = [n, *(work[LIMITS][i] for i in (T_ABOVE, Y_ABOVE, U_TOP, Y_TOP, Y_OVER)), work[LIMITS][T_ABOVE] ** n]
        rows.append(
            f"    {{\n{listed(limits)},\n    {{\n{listed(work[R])}\n    }},\n    {{\n{listed(work[Y])}\n    }}}}"
        )
    return f"static const struct flow FLOWS[{len(rows)}] = {{\n" + ",\n".join(rows) + "\n};"


def _y_below(n: float, kappa: float) -> float:
    work = workspace(n)
    set_kappa(work, n, kappa)
    return min(_UNLIMITED, float(work[LIMITS][Y_BELOW]))


def _bouc_wen(elements: Sequence[BoucWen]) -> LawInC:
    rows = []
    for one in elements:
        kappa = (one.beta - one.gamma) / (one.beta + one.gamma)
        scale = math.copysign(one.saturation_deg, one.A)
        row = [scale, abs(one.A) / one.saturation_deg, kappa, _y_below(one.n, kappa)]
        rows.append(f"    {{\n{listed(row)}\n    }}")
    smooth = _SMOOTH * min(one.saturation_deg / abs(one.A) for one in elements)
    return replace(_by_flows(elements, rows, "bouc_wen.c"), smooth_deg=smooth)


def _asymmetric(elements: Sequence[AsymmetricElement]) -> LawInC:
    rows = []
    for one in elements:
        cell = [", ".join(map(number, (limit, one.kappa, _y_below(one.n, one.kappa)))) for limit in _limits(one)]
        cells = f"{{{{{cell[0]}}}, {{{cell[1]}}}}},\n     {{{{{cell[2]}}}, {{{cell[3]}}}}}"
        head = listed([abs(one.A), math.copysign(1.0, one.A), one.centre_deg, one.saturation_deg])
        rows.append(f"    {{\n{head},\n    {{{cells}}}\n    }}")
    return _by_flows(elements, rows, "asymmetric.c")


def _by_flows(elements: Sequence[BoucWen] | Sequence[AsymmetricElement], rows: list[str], template: str) -> LawInC:
    """Give the law of elements that follow a series of :mod:`hysteresis.laws.flow` each, with their rows in C."""
    return LawInC(
        templates=("smaller.c", "flow.c", template),
        values={
            "flows": _flows([one.n for one in elements]),
            "count": str(len(elements)),
            "elements": ",\n".join(rows),
        },
        memory=np.array([one.h0_deg for one in elements]),
        remembers="h of each element",
        functions=("exp", "pow"),
        stack_bytes=1800,
    )


def _limits(one: AsymmetricElement) -> list[float]:
    """Limits below and above the centre, f falling and rising, in the order of the table in C."""
    return [limit for side in one.limits_deg for limit in side]


def _stops(elements: Sequence[StopsElement], f_start_deg: float) -> LawInC:
    rows, places, memory = [], [], []
    bends = any(one.constants[4] or one.constants[5] for one in elements)
    for one in elements:
        A, saturation, power, share, skew, bow = one.constants.tolist()
        r = thresholds(saturation / abs(A), power, share)
        each = A * (1.0 - share) / THRESHOLDS
        rows.append(f"    {{\n{listed([each, A * share - each])},\n    {{\n{listed(r)}\n    }}}}")
        places.append(f"    {{{', '.join(map(number, (skew, bow, *one.place)))}}}")
        limits = r * width_factor(f_start_deg, skew, bow, *one.place)
        memory.append(f_start_deg - np.clip(one.stops, -limits, limits))
    return LawInC(
        templates=("smaller.c", "stops.c") if bends else ("stops.c",),
        values={
            "count": str(len(elements)),
            "stops": str(THRESHOLDS + 1),
            "elements": ",\n".join(rows),
            "places": ",\n".join(places),
            "farthest": repr(FARTHEST),
            **(_BENDING if bends else _STRAIGHT),
        },
        memory=np.concatenate(memory),
        remembers="f minus each stop",
        functions=("exp",) if bends else (),
        stack_bytes=1400,
    )

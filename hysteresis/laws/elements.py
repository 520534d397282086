"""Laws of h that a form may have: Bouc-Wen and Prandtl-Ishlinskii, and an asymmetric or generalised form of each.

Each law has two constants in common: |A|, the slope of h after a start from rest, and S, the largest |h|. A row of
values holds log |A|, log S, the other constants, and the initial state from -1 to 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, Protocol, get_args

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.laws.asymmetric import table_batch
from hysteresis.laws.bouc_wen import BoucWen, hysteresis_batch
from hysteresis.laws.stops import advanced, follow_stops, largest_factor, start_of, thresholds

LawName = Literal["bouc-wen", "asymmetric-bouc-wen", "prandtl-ishlinskii", "generalised-prandtl-ishlinskii"]
LAW_NAMES: tuple[LawName, ...] = get_args(LawName)


class Place(NamedTuple):
    """Where f is measured from in a law that depends on position: the centre of the angle, and half its range, deg."""

    centre_deg: float = 0.0
    half_deg: float = 1.0


EVERYWHERE = Place()
"""Place of a law that does not depend on position."""


class Element(Protocol):
    """One law with its constants and its present state."""

    @property
    def saturation_deg(self) -> float:
        """Largest |h| on any path."""

    @property
    def corner_deg(self) -> float | None:
        """Place of f at which the slope of h changes at once on a straight way; None for a law without one."""

    def along(self, f_deg: Floats, /) -> Floats:
        """Compute h along a path that starts in the present state, shape (m,) -> (m,), deg."""

    def after(self, f_deg: Floats, /) -> Element:
        """Return the element with the state at the end of a path."""

    def widened(self, factor: float, /) -> Element:
        """Return the element with a saturation times a factor above 0; its slope after a reversal, and h, stay."""

    @property
    def state(self) -> Floats:
        """What the element remembers, shape (p,), deg; linear in h."""

    def in_state(self, state: Floats, /) -> Element:
        """Return the element with another memory, shape (p,), deg, held within its limits at the next sample."""


class Constant(NamedTuple):
    """One constant of a law beside |A| and S: its coordinate's name and bounds, and its value for a play operator."""

    name: str
    low: float
    high: float
    play: float


@dataclass(frozen=True)
class Law:
    """A law of h.

    ``follow`` computes h, shape (k, m), from a path, shape (m,), signs of A, shape (k,), rows of values, shape
    (k, 3 + constants), and the place. ``element`` makes one of them. ``named`` gives the constants as a reader knows
    them, with their units, from one sign and row.
    """

    name: LawName
    title: str
    constants: tuple[Constant, ...]
    follow: Callable[[Floats, Floats, Floats, Place], Floats]
    element: Callable[[float, Floats, Place], Element]
    named: Callable[[float, Floats], dict[str, tuple[float, str]]]
    half_width_deg: Callable[[float, Floats], float] = lambda sign, values: math.exp(values[1])

    @property
    def size(self) -> int:
        """Number of constants, |A| and S among them."""
        return 2 + len(self.constants)

    def play(self, log_saturation: float) -> list[float]:
        """Return the coordinates of about a play operator: slope 1 after a reversal, then a sudden stop."""
        return [0.0, log_saturation, *(constant.play for constant in self.constants)]


# --- Bouc-Wen ----------------------------------------------------------------------------------------------------


def bouc_wen_rows(sign: Floats, values: Floats) -> Floats:
    """Rows (A, beta, gamma, n, h0_deg): shapes (k,), (k, 5) -> (k, 5); values log |A|, log S, log n, rho, state."""
    slope, saturation, n = np.exp(values[:, :3]).T
    rho, state = values[:, 3], values[:, 4]
    beta = slope / saturation**n / (1 + rho)
    return np.stack([sign * slope, beta, rho * beta, n, np.abs(sign) * state * saturation], axis=1)


def _bouc_wen(path: Floats, sign: Floats, values: Floats, place: Place) -> Floats:
    return hysteresis_batch(path, bouc_wen_rows(sign, values))


def _bouc_wen_element(sign: float, values: Floats, place: Place) -> BoucWen:
    return BoucWen(*bouc_wen_rows(np.array([sign]), values[np.newaxis])[0].tolist())


def _bouc_wen_named(sign: float, values: Floats) -> dict[str, tuple[float, str]]:
    A, beta, gamma, n, _ = bouc_wen_rows(np.array([sign]), values[np.newaxis])[0].tolist()
    return {"A": (A, "1"), "beta": (beta, "deg^-n"), "gamma": (gamma, "deg^-n"), "n": (n, "1")}


# --- asymmetric Bouc-Wen -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class AsymmetricElement:
    """Asymmetric Bouc-Wen law with a limit for each side and direction.

    ``limits_deg``, shape (2, 2): largest |h| below and above the centre, f falling and rising. On each side and in
    each direction the law is eq. 7 with that limit: psi of :mod:`hysteresis.laws.asymmetric` is |A| / limit^n with the
    motion and -kappa |A| / limit^n against it, kappa = (beta - gamma) / (beta + gamma). In b1 to b6 of Song and Der
    Kiureghian this takes a constant (gamma of eq. 7) and a term in sgn(f f' h) more.
    """

    A: float
    n: float
    kappa: float
    limits_deg: tuple[tuple[float, float], tuple[float, float]]
    centre_deg: float
    h0_deg: float = 0.0

    @property
    def saturation_deg(self) -> float:
        """Largest |h| on any path."""
        return max(max(side) for side in self.limits_deg) if self.A else 0.0

    @property
    def corner_deg(self) -> float:
        """The centre: the limit of h changes there."""
        return self.centre_deg

    def along(self, f_deg: Floats) -> Floats:
        """Compute h along a path, shape (m,) -> (m,), deg."""
        if self.A == 0.0:
            return np.zeros(len(f_deg))
        limits = np.array(self.limits_deg)
        law = np.array([[self.A, self.n, self.centre_deg, self.h0_deg]])
        table = _psi_of(abs(self.A) / limits[np.newaxis] ** self.n, np.array([self.kappa]))
        h, admissible = table_batch(np.ascontiguousarray(f_deg, dtype=float), law, table)
        if not admissible.all():
            raise ValueError(f"asymmetric Bouc-Wen: {self}: expected n >= 1, kappa >= 0, |h0_deg| within the limits")
        return h[0]

    def after(self, f_deg: Floats) -> AsymmetricElement:
        """Return the law with the state at the end of a path."""
        return replace(self, h0_deg=float(self.along(f_deg)[-1]))

    def widened(self, factor: float) -> AsymmetricElement:
        """Return the law with limits times a factor above 0; h is held within the largest."""
        (a, b), (c, d) = self.limits_deg
        limits = ((factor * a, factor * b), (factor * c, factor * d))
        most = max(max(side) for side in limits)
        return replace(self, limits_deg=limits, h0_deg=min(most, max(-most, self.h0_deg)))

    @property
    def state(self) -> Floats:
        """Give h, shape (1,), deg."""
        return np.array([self.h0_deg])

    def in_state(self, state: Floats) -> AsymmetricElement:
        """Return the law with another h, shape (1,), deg, held within the largest limit."""
        most = self.saturation_deg
        return replace(self, h0_deg=min(most, max(-most, float(state[0]))))


def _psi_of(onward: Floats, kappa: Floats) -> Floats:
    """Tabulate psi, shape (k, 2, 2, 2), from its values with the motion, (k, 2, 2), and kappa, (k,)."""
    return np.stack([onward, -kappa[:, np.newaxis, np.newaxis] * onward], axis=3)


def _asymmetric_limits(values: Floats) -> Floats:
    """Limits of |h|, shape (k, 2, 2), below and above the centre, f falling and rising."""
    ways = np.array([-1.0, 1.0])
    direction = values[:, 4, np.newaxis, np.newaxis] * ways
    side = values[:, 5, np.newaxis, np.newaxis] * ways[:, np.newaxis]
    return np.exp(values[:, 1, np.newaxis, np.newaxis] + direction + side)


def _asymmetric(path: Floats, sign: Floats, values: Floats, place: Place) -> Floats:
    slope, n, rho = np.exp(values[:, 0]), np.exp(values[:, 2]), values[:, 3]
    limits = _asymmetric_limits(values)
    onward = slope[:, np.newaxis, np.newaxis] / limits ** n[:, np.newaxis, np.newaxis]
    start = values[:, 6] * np.exp(values[:, 1])
    law = np.stack([sign * slope, n, np.full(len(values), place.centre_deg), np.abs(sign) * start], axis=1)
    h, admissible = table_batch(np.ascontiguousarray(path), law, _psi_of(onward, (1 - rho) / (1 + rho)))
    if not admissible.all():
        raise ValueError(
            f"asymmetric Bouc-Wen: values {values[int(np.argmin(admissible))]}: expected within the bounds"
        )
    return h


def _asymmetric_element(sign: float, values: Floats, place: Place) -> AsymmetricElement:
    rho, saturation = float(values[3]), math.exp(values[1])
    below, above = (tuple(side) for side in _asymmetric_limits(values[np.newaxis])[0].tolist())
    return AsymmetricElement(
        A=sign * math.exp(values[0]),
        n=math.exp(values[2]),
        kappa=(1 - rho) / (1 + rho),
        limits_deg=((below[0], below[1]), (above[0], above[1])),
        centre_deg=place.centre_deg,
        h0_deg=abs(sign) * float(values[6]) * saturation,
    )


def _asymmetric_named(sign: float, values: Floats) -> dict[str, tuple[float, str]]:
    (low_falling, low_rising), (high_falling, high_rising) = _asymmetric_limits(values[np.newaxis])[0].tolist()
    return {
        "A": (sign * math.exp(values[0]), "1"),
        "n": (math.exp(values[2]), "1"),
        "gamma_over_beta": (float(values[3]), "1"),
        "limit_below_falling_deg": (low_falling, "deg"),
        "limit_below_rising_deg": (low_rising, "deg"),
        "limit_above_falling_deg": (high_falling, "deg"),
        "limit_above_rising_deg": (high_rising, "deg"),
    }


def _asymmetric_half_width(sign: float, values: Floats) -> float:
    """Mean of the limits with f falling and rising, and of both sides of the centre."""
    return float(_asymmetric_limits(values[np.newaxis]).mean())


# --- Prandtl-Ishlinskii ------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class StopsElement:
    """Prandtl-Ishlinskii law with the state of its stops; ``constants`` is a row of :mod:`hysteresis.laws.stops`."""

    constants: Floats
    place: Place
    stops: Floats

    @property
    def saturation_deg(self) -> float:
        """Largest |h| on any path."""
        A, saturation, _, _, skew, bow = self.constants.tolist()
        return saturation * largest_factor(skew, bow) if A else 0.0

    @property
    def corner_deg(self) -> None:
        """None: the limits change gradually."""
        return None

    def along(self, f_deg: Floats) -> Floats:
        """Compute h along a path, shape (m,) -> (m,), deg."""
        return advanced(f_deg, self.constants, self.place, self.stops)[0]

    def after(self, f_deg: Floats) -> StopsElement:
        """Return the law with the state at the end of a path."""
        return replace(self, stops=advanced(f_deg, self.constants, self.place, self.stops)[1])

    def widened(self, factor: float) -> StopsElement:
        """Return the law with thresholds times a factor above 0; stops beyond theirs are held at the next sample."""
        constants = self.constants.copy()
        constants[1] *= factor
        return replace(self, constants=constants)

    @property
    def state(self) -> Floats:
        """Give the stops, shape (p,), deg."""
        return self.stops

    def in_state(self, state: Floats) -> StopsElement:
        """Return the law with other stops, shape (p,), deg, held within their thresholds at the next sample."""
        return replace(self, stops=np.asarray(state, dtype=float))


def _stops_rows(sign: Floats, values: Floats) -> Floats:
    """Rows of :func:`hysteresis.laws.stops.follow_stops`; a law without position dependence has a = c = 0."""
    slope, saturation, power = np.exp(values[:, :3]).T
    bends = values[:, 4:6] if values.shape[1] == 7 else np.zeros((len(values), 2))
    return np.column_stack([sign * slope, saturation, power, values[:, 3], bends, values[:, -1]])


def _stops(path: Floats, sign: Floats, values: Floats, place: Place) -> Floats:
    return follow_stops(np.ascontiguousarray(path), _stops_rows(sign, values), *place)


def _stops_element(sign: float, values: Floats, place: Place) -> StopsElement:
    row = _stops_rows(np.array([sign]), values[np.newaxis])[0]
    A, saturation, power, share, skew, bow, state = row.tolist()
    r = thresholds(saturation / max(abs(A), 1e-300), power, share)
    return StopsElement(row[:6], place, start_of(math.copysign(1.0, A) * state, largest_factor(skew, bow) * r))


def _stops_named(sign: float, values: Floats) -> dict[str, tuple[float, str]]:
    A, saturation, power, share, skew, bow, _ = _stops_rows(np.array([sign]), values[np.newaxis])[0].tolist()
    r = thresholds(saturation / abs(A), power, share) if A else np.zeros(1)
    found = {
        "A": (A, "1"),
        "chi": (power - 1.0, "1"),
        "largest_threshold_deg": (float(r[-1]), "deg"),
        "share_at_largest": (share, "1"),
    }
    if len(values) == 7:
        found |= {"width_at_low_end": (math.exp(bow - skew), "1"), "width_at_high_end": (math.exp(bow + skew), "1")}
    return found


# --- all ---------------------------------------------------------------------------------------------------------

_N = Constant("n", 0.0, math.log(10.0), math.log(5.0))
_RHO = Constant("gamma / beta", -0.95, 1.0, 0.9)
_DENSITY = (Constant("chi + 1", math.log(0.1), math.log(10.0), math.log(10.0)), Constant("share at R", 0.0, 0.95, 0.5))

BOUC_WEN = Law("bouc-wen", "Bouc-Wen", (_N, _RHO), _bouc_wen, _bouc_wen_element, _bouc_wen_named)
LAWS: dict[LawName, Law] = {
    "bouc-wen": BOUC_WEN,
    "prandtl-ishlinskii": Law(
        "prandtl-ishlinskii", "Prandtl-Ishlinskii", _DENSITY, _stops, _stops_element, _stops_named
    ),
    "asymmetric-bouc-wen": Law(
        "asymmetric-bouc-wen",
        "asymmetric Bouc-Wen",
        (_N, _RHO, Constant("direction", -1.5, 1.5, 0.0), Constant("side", -1.5, 1.5, 0.0)),
        _asymmetric,
        _asymmetric_element,
        _asymmetric_named,
        _asymmetric_half_width,
    ),
    "generalised-prandtl-ishlinskii": Law(
        "generalised-prandtl-ishlinskii",
        "generalised Prandtl-Ishlinskii",
        (*_DENSITY, Constant("a", -1.0, 1.0, 0.0), Constant("c", -1.0, 1.0, 0.0)),
        _stops,
        _stops_element,
        _stops_named,
    ),
}
"""The laws from the simplest on: of those that predict equally well, the first is chosen."""


def elements_of(name: LawName, sign: float, values: Sequence[Sequence[float]], place: Sequence[float]) -> list[Element]:
    """Make the elements of h again from numbers that were stored: name, sign, rows of values, and place.

    Raises
    ------
    ValueError
        Rows or a place that do not have the form of the law.
    """
    law = LAWS[name]
    if len(place) != 2 or any(len(row) != law.size + 1 for row in values):
        raise ValueError(f"values of {law.title}: expected rows of {law.size + 1} numbers and a place of 2")
    with np.errstate(over="ignore"):  # a law that is not finite is refused where it is used
        return [law.element(sign, np.array(row, dtype=float), Place(*place)) for row in values]

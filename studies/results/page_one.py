"""``page-one.json``: what the first page of a design report decides by, with a requirement or without."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from hysteresis.files import present
from hysteresis.plain import optional
from studies.results.files import read_result

FILE = "page-one.json"
WHAT = "the first page of a design report"
DRAWING = "drawing.svg"
Met = Literal["met", "at risk", "not met", "not known"]
"""``at risk``: met with nominal numbers, but less surely than was asked."""


@dataclass(frozen=True)
class KeyNumber:
    """A number that a design is decided by.

    Parameters
    ----------
    name, unit
        What it is, in words; "" without a unit.
    value
        None where no model gives it; ``note`` then says why.
    required
        The bound in words, "at least 60"; "" without a requirement.
    margin
        Distance to the bound in the unit, positive where it is kept.
    p_met
        Probability that the requirement is met under the tolerances, 0 to 1.
    met
        The verdict; None without a requirement.
    note
        What the number means, or how it comes about.
    p_low, p_asked
        Lower end of the 95 % interval of ``p_met``, and the probability that was asked for.
    """

    name: str
    unit: str
    value: float | None
    required: str = ""
    margin: float | None = None
    p_met: float | None = None
    met: Met | None = None
    note: str = ""
    p_low: float | None = optional()
    p_asked: float | None = optional()


@dataclass(frozen=True)
class ToleranceCost:
    """What one tolerance costs a design.

    ``given`` says the tolerance in words. ``p_all`` is P(all requirements met) with it half as wide. ``change`` is the
    quantity that limits the design, at one standard deviation above the nominal number less that at one below, and
    ``share`` the total Sobol index of that quantity, at most 1, with half its 95 % interval ``within``; None where they
    are not known.
    """

    name: str
    given: str
    p_all: float
    change: float | None
    share: float | None
    within: float | None


@dataclass(frozen=True)
class Tightening:
    """What a small change of one number costs, the others as they are; None where the rig could not follow.

    ``change`` has its unit. ``bend_deg`` is the change of the bend at the same drive, ``tension_percent`` and
    ``strain_percent`` those of the tension and of the largest strain at the same bend, over what they are.
    """

    name: str
    change: str
    bend_deg: float | None
    tension_percent: float | None
    strain_percent: float | None


@dataclass(frozen=True, kw_only=True)
class PageOne:
    """Rows of the first page. ``at`` says of which load they are, ``drawing`` names the file of the drawing.

    ``first`` are sentences that say what to tighten first. ``derived`` are numbers that follow from those of the rig,
    by name, with the unit at the end of it.

    Of a tube for a requirement: ``title`` of the requirement; ``made_of`` says what to buy and to cut, a line a part;
    ``surely`` how many tubes meet all of it; ``costs`` what each tolerance costs, and ``limiting`` the quantity, with
    its unit, that they are told of; ``rests_on`` are sentences on what the numbers rest on; ``loop`` names the record
    of a cycle.
    """

    schema: int = 1
    at: str
    rows: tuple[KeyNumber, ...]
    tighten: tuple[Tightening, ...] = ()
    first: tuple[str, ...] = ()
    derived: Mapping[str, float] = field(default_factory=dict)
    drawing: str | None = optional()
    title: str | None = optional()
    made_of: Mapping[str, str] = field(default_factory=dict)
    surely: str = ""
    costs: tuple[ToleranceCost, ...] = ()
    limiting: str = ""
    rests_on: tuple[str, ...] = ()
    loop: str | None = optional()


def read_page_one(folder: Path) -> PageOne | None:
    """Read the first page of a folder; None where it has none.

    Raises
    ------
    RecordError
        One line with the file that cannot be read.
    """
    path = folder / FILE
    return read_result(PageOne, path, WHAT) if present(path) else None

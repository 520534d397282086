"""Settings of an identification, with their defaults: one frozen value for the command, the notebook and the tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from hysteresis.arguments import checked_class
from hysteresis.fitting.optimizers import METHODS, Method
from hysteresis.laws.elements import LAW_NAMES, LawName

Fitness = Literal["rmse", "paper-signed-mean"]


@checked_class()
@dataclass(frozen=True)
class IdentifySettings:
    """How :func:`hysteresis.fitting.identification.identify` searches, and what the model may contain.

    Parameters
    ----------
    method
        Of the global search, see :func:`hysteresis.fitting.optimizers.evolve`.
    seed, seeds
        First seed, and number of searches with consecutive seeds. The same settings give the same fit.
    elements
        Number of Bouc-Wen elements of h, 1 or 2; None chooses by validation within the training data.
    law
        Of h, see :mod:`hysteresis.laws.elements`; ``"auto"`` chooses by folds within the training data, from these and
        two Bouc-Wen elements. The Bouc-Wen layer is fitted in any case.
    delay
        Whether the angle may lag the drive in time, by up to 2 % of the shortest record.
    fitness
        ``"rmse"``: root mean square error, followed by least squares of all unknowns together.
        ``"paper-signed-mean"``: eq. 8 of the paper, a mean in which errors cancel; for comparison, without least
        squares.
    population, generations
        Size of one search: individuals, at least 8, and generations, at least 3.
    forward
        Whether least squares of one Bouc-Wen element on one record, without a delay, are compiled and take forward
        derivatives in place of differences: the same minimum, in a tenth of the time. Intervals are then those of noise
        that is correlated from sample to sample (:mod:`hysteresis.fitting.serial`), without a bootstrap by blocks, and
        nothing is said of the asymmetry.

    Raises
    ------
    ValueError
        An unknown fitness or method, a number of elements other than 1, 2 or None, or a search that is too small.
    """

    method: Method = "genetic"
    seed: int = 0
    seeds: int = 1
    elements: int | None = 1
    law: LawName | Literal["auto"] = "bouc-wen"
    delay: bool = False
    fitness: Fitness = "rmse"
    population: int = 100
    generations: int = 90
    forward: bool = False

    def __post_init__(self) -> None:
        if self.fitness not in ("rmse", "paper-signed-mean"):
            raise ValueError(f"fitness = {self.fitness!r}: expected 'rmse' or 'paper-signed-mean'")
        if self.method not in METHODS:
            raise ValueError(f"method = {self.method!r}: expected one of {', '.join(METHODS)}")
        if self.law not in (*LAW_NAMES, "auto") or (self.law != "bouc-wen" and self.fitness != "rmse"):
            expected = f"expected auto or one of {', '.join(LAW_NAMES)}; bouc-wen for the paper's fitness"
            raise ValueError(f"law = {self.law!r}: {expected}")
        if self.law not in ("bouc-wen", "auto") and self.elements != 1:
            raise ValueError(f"elements = {self.elements}: expected 1 for law = {self.law!r}")
        if self.elements not in (None, 1, 2) or (self.elements != 1 and self.fitness != "rmse"):
            raise ValueError(f"elements = {self.elements}: expected 1, 2 or None; 1 for the paper's fitness")
        for name, least in (("population", 8), ("generations", 3), ("seeds", 1), ("seed", 0)):
            if (value := getattr(self, name)) < least:
                raise ValueError(f"{name} = {value}: expected at least {least}")


DEFAULTS = IdentifySettings()

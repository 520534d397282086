"""Draws of a set's constants from what the paper's static statements say, with what tells their quality.

Widths and full scale fix three combinations of the constants far better than the others, and no step of a sampler
finds the bent region that is left. So the others are drawn from their priors, EA, toe region and sheath friction are
solved for (:mod:`validation.measured.ensemble.draws`), and each draw is weighted by the likelihood of the statements in
words (:mod:`validation.measured.readings.statements`). Resampled draws are the members. Walkers of emcee start from
them, with the width at 10 N in place of the sheath's friction; R-hat says how far single walkers get. The tests at 1 Hz
are left out.

emcee: Foreman-Mackey et al. 2013, doi 10.1086/670067; split R-hat: Gelman et al., Bayesian Data Analysis, 2013,
section 11.4, each walker being a chain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit, log_expit, logit

from fem_models.rig import Rig, RigError, preset
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.measured.ensemble.draws import draw
from validation.measured.ensemble.facts import Facts
from validation.measured.ensemble.priors import Model, Prior
from validation.measured.readings.fit import COARSE_MM
from validation.measured.readings.loops import Loop, loops_of, static_loop
from validation.measured.readings.mechanisms import MechanismSet, rig_of
from validation.measured.readings.paper_table import FACTORS, FULL_SCALE_DEG, WIDTHS_DEG
from validation.measured.readings.statements import (
    APART,
    MET,
    PEAK,
    READ_DEG,
    STATEMENTS,
    STATIC_SIZE,
    Judged,
    judge,
    residual_vector,
)

SOLVED = "friction.sheath_N"
_WITH_TOE = ("tendon.EA_N", "tendon.toe_N", SOLVED)
NUMBERS_SIZE = 4
"""Residuals of full scale and widths, which come before those of the other static statements."""
ENSEMBLES = 2
_FIRST_N = (0.2, 1.2)  # friction at which the secants begin
_CLOSE_DEG, _SECANTS = 1e-3, 8


@dataclass(frozen=True)
class SampleSettings:
    """Draws from the priors, a power of two; walkers of an ensemble and steps; members that are kept; the seed."""

    draws: int = 2048
    walkers: int = 40
    steps: int = 40
    members: int = 200
    seed: int = 1


@dataclass(frozen=True)
class Samples:
    """Members of a set under one reading, and the quality of the draws.

    ``rows`` has the constants ``names`` of each member, ``meets`` whether it meets all static statements, ``met`` how
    many members meet each. ``solved`` is the share of the draws that show the numbers, ``effective`` the number of
    equally weighted draws (Kish) that would say as much. Of emcee: ``r_hat`` is the largest split R-hat of a constant,
    ``steps_a_draw`` the longest integrated autocorrelation time in steps, ``accepted`` the share of the steps that
    moved, ``walkers`` and ``steps`` their number.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    meets: tuple[bool, ...]
    met: Mapping[str, int]
    draws: int
    solved: float
    effective: float
    r_hat: float
    steps_a_draw: float
    accepted: float
    walkers: int
    steps: int

    def members(self, *, meeting: bool) -> list[dict[str, float]]:
        """Constants of all members, or of those that meet all static statements, by name."""
        return [
            dict(zip(self.names, row, strict=True))
            for row, meets in zip(self.rows, self.meets, strict=True)
            if meets or not meeting
        ]


def met_but_peak(judged: Judged) -> bool:
    """Whether all statements but the peak at 1 Hz are met; a rig without a rate mechanism has the rest by itself."""
    return all(met for name, met in judged.met.items() if name != PEAK)


class Density:
    """Logarithm of the density of a row: logits of the quantiles of all constants but one, and of the width at 10 N.

    The last number is that width less the paper's, in standard deviations.
    """

    def __init__(self, mechanisms: MechanismSet, reading: str) -> None:
        self.mechanisms, self.reading = mechanisms, reading
        self.free = tuple(name for name in mechanisms.names if name != SOLVED)
        self.size = len(self.free) + 1

    def solved(self, z: Floats) -> Solved | None:
        """Solve for the friction; None where no friction within its prior gives the width.

        Raises
        ------
        RigError, SolverError
            Of the rig.
        """
        priors = self.mechanisms.priors
        pairs = zip(self.free, expit(z), strict=False)
        values = {name: float(priors[name].at(q)) for name, q in pairs} | dict(self.mechanisms.fixed)
        goal = FACTORS[self.reading] * (WIDTHS_DEG[10.0] + READ_DEG / MET * float(z[-1]))
        return _solved(values, replace(rig_of(values).rig, preload_N=10.0), goal, priors[SOLVED])

    def point(self, constants: Mapping[str, float]) -> Floats:
        """Row of constants that show the paper's width at 10 N, shape (p,)."""
        quantiles = [self.mechanisms.priors[name].quantile(constants[name]) for name in self.free]
        return np.append(logit(np.clip(quantiles, 1e-6, 1 - 1e-6)), 0.0)

    def __call__(self, z: Floats) -> float:
        """Logarithm of the density, not normalised; -inf where there is no such rig."""
        try:
            found = self.solved(z)
            if found is None:
                return -np.inf
            loops = loops_of(found.rig, None, COARSE_MM, found.low)
        except (RigError, SolverError):
            return -np.inf
        row = residual_vector(loops, self.reading)[:STATIC_SIZE]
        prior = float(np.sum(log_expit(z[:-1]) + log_expit(-z[:-1])))
        return prior + float(np.log(found.derivative)) - 0.5 * float(row @ row)


@dataclass(frozen=True)
class Solved:
    """A rig with the wanted width at 10 N, its loop there, its constants, and d ln friction/d width in 1/deg."""

    constants: Mapping[str, float]
    rig: Rig
    low: Loop
    derivative: float


def _solved(values: Mapping[str, float], rig: Rig, goal_deg: float, prior: Prior) -> Solved | None:
    """Find the root within the prior by secants: the width is nearly linear in the friction."""

    def tried(friction_N: float) -> tuple[Rig, Loop, float]:
        one = replace(rig, friction=replace(rig.friction, sheath_N=friction_N))
        low = static_loop(one, step_mm=COARSE_MM)
        return one, low, float(low.width_deg.max()) - goal_deg

    (x, y), before, last = _FIRST_N, tried(_FIRST_N[0])[2], tried(_FIRST_N[1])
    for _ in range(_SECANTS):
        slope = (last[2] - before) / (y - x)
        if slope <= 0:
            return None
        if abs(last[2]) < _CLOSE_DEG:
            inside = prior.low <= y <= prior.high
            return Solved({**values, SOLVED: y}, last[0], last[1], 1 / (slope * y)) if inside else None
        x, y = y, float(np.clip(y - last[2] / slope, 0.5 * prior.low, 1.1 * prior.high))
        if x == y:
            return None
        before, last = last[2], tried(y)
    return None


def sample(
    mechanisms: MechanismSet, reading: str, settings: SampleSettings, tell: Callable[[str], None] = lambda _: None
) -> Samples:
    """Draw members of a set under a reading; the same ones for a seed."""
    drawn, weight = weighted_draws(mechanisms, reading, settings)
    effective = float(weight.sum() ** 2 / (weight**2).sum())
    tell(f"{len(drawn)} of {settings.draws} draws show the numbers, {effective:.0f} effective")
    random = np.random.RandomState(settings.seed)  # emcee's kind of generator
    chance = weight / weight.sum()
    constants = [drawn[k] for k in random.choice(len(drawn), settings.members, p=chance)]
    judged = [_judged(one, reading) for one in constants]
    walk = _walked(mechanisms, reading, settings, [drawn[k] for k in random.choice(len(drawn), 64, p=chance)])
    return Samples(
        names=(names := tuple(constants[0])),
        rows=tuple(tuple(float(f"{one[name]:.6g}") for name in names) for one in constants),
        meets=tuple(met_but_peak(one) for one in judged),
        met={name: sum(one.met.get(name, False) for one in judged) for name in STATEMENTS},
        draws=settings.draws,
        solved=len(drawn) / settings.draws,
        effective=effective,
        r_hat=walk.r_hat,
        steps_a_draw=walk.steps_a_draw,
        accepted=walk.accepted,
        walkers=ENSEMBLES * settings.walkers,
        steps=settings.steps,
    )


def weighted_draws(
    mechanisms: MechanismSet, reading: str, settings: SampleSettings
) -> tuple[list[Mapping[str, float]], Floats]:
    """Constants of the draws that show the numbers, and their weights, shape (k,)."""
    model = Model(mechanisms.priors, mechanisms.fixed, _WITH_TOE)
    low, high = (FACTORS[reading] * width for width in WIDTHS_DEG.values())
    goal = Facts(FULL_SCALE_DEG, (low, high), (0.0, 0.0))
    found = draw(preset("du2018"), model, settings.draws, settings.seed, goal=goal)
    drawn: list[Mapping[str, float]] = []
    logs = []
    for row in found.rows[np.isfinite(found.rows[:, 0])]:
        values = dict(zip(found.columns, row.tolist(), strict=True))
        constants = {name: values[name] for name in mechanisms.names} | dict(mechanisms.fixed)
        try:
            loops = loops_of(rig_of(constants).rig)
        except (RigError, SolverError):
            continue
        said = residual_vector(loops, reading)[NUMBERS_SIZE:STATIC_SIZE]
        drawn.append(constants)
        logs.append(values["log_density"] - 0.5 * float(said @ said))
    return drawn, np.exp(np.array(logs) - max(logs))


@dataclass(frozen=True)
class _Walk:
    """Quality of emcee's steps."""

    r_hat: float
    steps_a_draw: float
    accepted: float


def _walked(
    mechanisms: MechanismSet, reading: str, settings: SampleSettings, starts: list[Mapping[str, float]]
) -> _Walk:
    """Walk from members by emcee, in two ensembles."""
    import emcee  # needed where members are made

    density = Density(mechanisms, reading)
    points = [density.point(one) for one in starts]
    usable = np.array([z for z in points if np.isfinite(density(z))])
    chains, accepted = [], []
    for k in range(ENSEMBLES):
        random = np.random.RandomState(settings.seed + k)
        start = usable[random.choice(len(usable), settings.walkers, replace=len(usable) < settings.walkers)]
        start = start + 1e-3 * random.standard_normal(start.shape)
        moves = [(emcee.moves.DEMove(), 0.6), (emcee.moves.StretchMove(), 0.4)]
        sampler = emcee.EnsembleSampler(settings.walkers, density.size, density, moves=moves)
        state = emcee.State(start, random_state=random.get_state())
        sampler.run_mcmc(state, settings.steps, skip_initial_state_check=True)
        chains.append(sampler.get_chain())
        accepted.append(float(np.mean(sampler.acceptance_fraction)))
    both = np.concatenate(chains, axis=1)
    moving = both[:, (np.ptp(both, axis=0) > 0).all(axis=1)]
    longest = float(np.max(emcee.autocorr.integrated_time(moving, tol=0)))
    return _Walk(split_r_hat(both), longest, float(np.mean(accepted)))


def split_r_hat(chains: Floats) -> float:
    """Largest split R-hat of chains of shape (steps, chains, p)."""
    half = chains.shape[0] // 2
    parts = np.concatenate([chains[:half], chains[half : 2 * half]], axis=1)
    within = parts.var(axis=0, ddof=1).mean(axis=0)
    between = parts.mean(axis=0).var(axis=0, ddof=1)
    return float(np.sqrt((half - 1) / half + between / within).max())


def _judged(constants: Mapping[str, float], reading: str) -> Judged:
    chosen = rig_of(constants)
    try:
        return judge(loops_of(chosen.rig, chosen.camera), reading)
    except (RigError, SolverError):  # at the paper's step of the drive, not at that of the search
        return Judged({APART: np.inf}, {APART: False}, {})

"""Draws of a set's constants from what the paper's static statements say, by emcee, with what tells their quality.

The likelihood is that of :mod:`validation.measured.readings.statements`; the tests at 1 Hz are left out. Priors are
uniform in the quantiles of the set. Two ensembles of walkers start from least squares that begin at different draws of
the prior. The widths fix one combination of the constants a hundred times better than the others, which no step finds.
So the width at 10 N takes the place of the sheath's friction, which is solved for; its prior gets the derivative.

emcee: Foreman-Mackey et al. 2013, doi 10.1086/670067; split R-hat: Gelman et al., Bayesian Data Analysis, 2013,
section 11.4, each walker being a chain.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from scipy.special import expit, log_expit, logit

from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from hysteresis.arrays import Floats
from validation.measured.ensemble.priors import Prior
from validation.measured.readings.fit import COARSE_MM, Residuals
from validation.measured.readings.loops import Loop, loops_of, static_loop
from validation.measured.readings.mechanisms import MechanismSet, rig_of
from validation.measured.readings.paper_table import FACTORS, WIDTHS_DEG
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
ENSEMBLES = 2
BURN_IN = 0.25
"""Part of the steps that is dropped."""
_FIRST_N = (0.2, 1.2)  # friction at which the secants begin
_CLOSE_DEG, _SECANTS = 1e-3, 8
_START_RUNS, _START_CHI_SQUARE = 15, 60.0


@dataclass(frozen=True)
class SampleSettings:
    """Walkers of an ensemble, its steps, members that are kept, and the seed."""

    walkers: int = 24
    steps: int = 400
    members: int = 200
    seed: int = 1


@dataclass(frozen=True)
class Samples:
    """Members of a set under one reading, and the quality of the draws.

    ``rows`` has the constants ``names`` of each member, ``meets`` whether it meets all static statements, ``met`` how
    many members meet each. ``effective`` is the least effective sample size of a constant, ``r_hat`` the largest split
    R-hat, ``steps_a_draw`` the longest integrated autocorrelation time in steps, ``accepted`` the share of the steps
    that moved.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]
    meets: tuple[bool, ...]
    met: Mapping[str, int]
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
    import emcee  # needed where members are made

    density = Density(mechanisms, reading)
    chains, accepted = [], []
    for k in range(ENSEMBLES):
        random = np.random.RandomState(settings.seed + k)  # emcee's kind of generator
        start = _starts(density, random, settings.walkers)
        moves = [(emcee.moves.DEMove(), 0.6), (emcee.moves.StretchMove(), 0.4)]
        sampler = emcee.EnsembleSampler(settings.walkers, density.size, density, moves=moves)
        state = emcee.State(start, random_state=random.get_state())
        sampler.run_mcmc(state, settings.steps, skip_initial_state_check=True)
        chains.append(sampler.get_chain(discard=int(BURN_IN * settings.steps)))
        accepted.append(float(np.mean(sampler.acceptance_fraction)))
        tell(f"ensemble {k + 1}: {100 * accepted[-1]:.0f} % of the steps moved")
    longest = [float(np.max(emcee.autocorr.integrated_time(chain, tol=0))) for chain in chains]
    both = np.concatenate([chain.reshape(-1, chain.shape[2]) for chain in chains])
    effective = sum(chain.shape[0] * chain.shape[1] / tau for chain, tau in zip(chains, longest, strict=True))
    constants = _members(density, both[np.linspace(0, len(both) - 1, settings.members).astype(int)])
    judged = [_judged(one, reading) for one in constants]
    return Samples(
        names=(names := tuple(constants[0])),
        rows=tuple(tuple(float(f"{one[name]:.6g}") for name in names) for one in constants),
        meets=tuple(met_but_peak(one) for one in judged),
        met={name: sum(one.met.get(name, False) for one in judged) for name in STATEMENTS},
        effective=effective,
        r_hat=split_r_hat(np.concatenate(chains, axis=1)),
        steps_a_draw=max(longest),
        accepted=float(np.mean(accepted)),
        walkers=ENSEMBLES * settings.walkers,
        steps=settings.steps,
    )


def split_r_hat(chains: Floats) -> float:
    """Largest split R-hat of chains of shape (steps, chains, p)."""
    half = chains.shape[0] // 2
    parts = np.concatenate([chains[:half], chains[half : 2 * half]], axis=1)
    within = parts.var(axis=0, ddof=1).mean(axis=0)
    between = parts.mean(axis=0).var(axis=0, ddof=1)
    return float(np.sqrt((half - 1) / half + between / within).max())


def _members(density: Density, rows: Floats) -> list[Mapping[str, float]]:
    found = [density.solved(z) for z in rows]
    return [one.constants for one in found if one is not None]


def _starts(density: Density, random: np.random.RandomState, walkers: int) -> Floats:
    """Give ends of short least squares from draws of the prior, shape (walkers, p); the best of eight draws each."""
    found: list[Floats] = []
    residuals = Residuals(density.mechanisms, density.reading)
    names = density.mechanisms.names
    free = [names.index(name) for name in density.free]

    def static(quantiles: Floats) -> Floats:
        return residuals(quantiles)[:STATIC_SIZE]

    while len(found) < walkers:
        draws = random.uniform(0.05, 0.95, (8, len(names)))
        best = min(draws, key=lambda q: float(np.sum(static(q) ** 2)))
        end = least_squares(static, best, bounds=(0.01, 0.99), diff_step=2e-3, x_scale=0.2, max_nfev=_START_RUNS)
        z = np.append(logit(end.x[free]), 0.3 * random.standard_normal())
        if 2 * end.cost < _START_CHI_SQUARE and np.isfinite(density(z)):
            found.append(z)
    return np.array(found)


def _judged(constants: Mapping[str, float], reading: str) -> Judged:
    chosen = rig_of(constants)
    try:
        return judge(loops_of(chosen.rig, chosen.camera), reading)
    except (RigError, SolverError):  # at the paper's step of the drive, not at that of the search
        return Judged({APART: np.inf}, {APART: False}, {})

"""Calibrate a known rig on its measured loops: the posterior of its numbers, and what the records say of them.

Fitted are all numbers of :data:`validation.separation.priors.PRIORS`, those that no drawing has (friction, loop of the
material, toe region) and those that differ from the drawing by tolerances (arm, depth of the notches, modulus, free
length), under each law that the metal may have. The zero of the angle is free. The rest of the rig stays as given.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from fem_models.analytic.of_record import require_the_rigs_unit
from fem_models.chain import simulate_chain, solve_chain
from fem_models.chain.along import line_along, moved_along, moved_run, moved_series, taped_run
from fem_models.chain.solve import chain_angle_deg
from fem_models.load import LoadProgram
from fem_models.rig import Rig, RigError
from fem_models.rig.checks import SolverError
from fem_models.rig.of_record import require_the_rigs_sense, rig_of
from hysteresis import Record
from hysteresis.arrays import Floats, Mask
from hysteresis.fitting.uncertainty import Parameter
from hysteresis.records.metrics import noise_floor
from hysteresis.records.path import branches, require_reversal
from hysteresis.records.record import RecordError
from hysteresis.sensors.lateness import late_words
from hysteresis.sensors.readings import Cleaned, cleaned, require_rows, sensor_notes
from validation.separation.contributions import loop_program
from validation.separation.posterior import (
    Optimum,
    Sample,
    about,
    effective,
    flattened,
    optimum,
    quantiles,
    sampled,
    weights_of,
)
from validation.separation.priors import LOOP, PLAY, PRIORS, Law, laws_of

SAMPLES = 300
"""Samples of a record that the fit keeps. The mechanics is quasi-static: only the reversals are indispensable."""
DRAWS = 32
"""Rigs that are drawn from the posterior, of all laws and optima together."""
ENOUGH = 14.0
"""Effective number of draws: with fewer, the weights are flattened."""
CORRELATED = 0.95
"""Magnitude of the correlation above which two parameters are reported as inseparable."""
MISFIT = 2.0
"""What the rig leaves over the noise, from which on the result warns."""
LEVELS = (0.025, 0.975)
_STEP = 1e-3  # of finite differences of z
_FAILED = 1e3  # residual where no rig has these numbers or follows the drive: far from any posterior
_AT_REST = 0.05  # share of the drive's range: a record that begins this close to zero begins from rest
_OTHER_LOOPS = (0.5, 2.0)  # slip angles over that of the rig, from which the fit starts again
_FAR_FROM_FILE = 4.0  # standard deviations: of a rig as its file says, one number in 16,000 is as far away
_LEAST_RANGE = 10.0  # of the angle, over its noise: the range of noise alone is 6
_LEAST_NOISE = 1e-6  # of the range of the angle: less comes from a simulation
_HOPELESS = 4.0  # times the sum of squares of another law: twice its misfit
_FAR = 60.0  # sum of squares above the least: odds of exp(-30)
_LEAST_ODDS = 0.005  # of a law or an optimum: one that is less likely has a third of a draw
_LEAST_DRAWS = 6  # of a law or an optimum that counts
_NEAR_PLATEAU = 0.7  # of the lowest plateau: a metal that is stressed less is linear, whatever its tolerances
_ALIKE = 1.0  # standard deviations between two optima that are the same


@dataclass(frozen=True)
class Experiment:
    """Information gain of a further record: gain in half the log-determinant of the information (D-optimality), nats.

    ``narrower`` is the factor by which the record narrows the interval of ``parameter``, the one that gains most.
    """

    what: str
    preload_N: float
    amplitude_mm: float
    gain: float
    parameter: str
    narrower: float

    def to_dict(self) -> dict[str, str | float]:
        """Values as in ``separate.json``, where the parameter's key is ``constant``."""
        return {("constant" if name == "parameter" else name): value for name, value in vars(self).items()}


@dataclass(frozen=True, eq=False)
class RigCalibration:
    """Posterior of a rig, with its best rig.

    Parameters
    ----------
    rig
        At the best optimum of the likeliest law, with the preload of the first record.
    parameters
        Values of that rig, with 95 % intervals under its law.
    rigs, weights
        Rigs drawn from the posterior, of all laws, with weights of shape (n,) that add up to 1.
    laws
        Probability of each law of the metal.
    noise_deg
        Of the angle, from cycles that repeat or from neighbouring samples. All intervals are wider by :attr:`misfit`
        where that is more than 1.
    notes
        What was taken out of the records before the fit.
    condition
        Condition number of the Jacobian of records and prior, with columns scaled to length 1.
    correlations
        By pair of parameters.
    inseparable
        Sentences about parameters that the records do not identify.
    experiments
        Further records, the most informative first.
    """

    rig: Rig
    parameters: dict[str, Parameter]
    rigs: tuple[Rig, ...]
    weights: Floats
    laws: dict[str, float]
    rmse_deg: float
    noise_deg: float
    condition: float
    correlations: dict[str, float]
    inseparable: tuple[str, ...]
    experiments: tuple[Experiment, ...]
    notes: tuple[str, ...] = ()

    @property
    def misfit(self) -> float:
        """Residual of the rig over the noise."""
        return self.rmse_deg / self.noise_deg

    @property
    def has_play(self) -> bool:
        """Whether any of :attr:`rigs` has play."""
        return any(rig.backlash is not None and rig.backlash.width_mm > 0 for rig in self.rigs)

    @property
    def effective_draws(self) -> float:
        """Effective number of :attr:`rigs`."""
        return effective(self.weights)


@dataclass(frozen=True)
class _Loop:
    """A thinned record with the rig and the load program that reproduce it; ``read`` are its readings."""

    rig: Rig
    program: LoadProgram
    skip: int  # samples of the approach
    angle_deg: Floats
    read: Mask

    def residual_deg(self, angle_deg: Floats) -> Floats:
        """Difference of an angle of the whole program from the readings; the zero of the angle is free."""
        difference = (angle_deg[self.skip :] - self.angle_deg)[self.read]
        return np.asarray(difference - difference.mean())


@dataclass(frozen=True, eq=False)
class _Problem:
    """Loops under a law of the metal, with the standard deviation of their angles."""

    law: Law
    loops: tuple[_Loop, ...]
    sigma_deg: float

    def residual(self, z: Floats) -> Floats:
        """Residuals over their standard deviation, and z below them: the prior. Shape (m + p,)."""
        try:
            angles = [chain_angle_deg(self.law.rig_at(z, loop.rig), loop.program) for loop in self.loops]
        except (SolverError, RigError):  # no equilibrium with these values: the large residual shortens the step
            return np.concatenate([np.full(int(loop.read.sum()), _FAILED) for loop in self.loops] + [z])
        rows = [loop.residual_deg(angle) / self.sigma_deg for loop, angle in zip(self.loops, angles, strict=True)]
        return np.concatenate([*rows, z])

    def is_possible(self, z: Floats) -> bool:
        """Whether there is a rig at z, such as one whose notches leave metal."""
        try:
            self.law.rig_at(z, self.loops[0].rig)
        except RigError:
            return False
        return True

    def columns(self, z: Floats) -> Floats:
        """Jacobian of the residual, shape (m + p, p), by rigs that are moved along the steps of the rig."""
        rows = [self._columns_of(loop, z) / self.sigma_deg for loop in self.loops]
        return np.vstack([*rows, np.eye(z.size)])

    def _columns_of(self, loop: _Loop, z: Floats) -> Floats:
        found = np.zeros((int(loop.read.sum()), z.size))
        try:
            base = taped_run(self.law.rig_at(z, loop.rig), loop.program)
            line, here = line_along(base), loop.residual_deg(base.series.angle_deg)
        except (SolverError, RigError):
            return found
        for i, step in enumerate(np.eye(z.size) * _STEP):
            try:
                moved = moved_run(base, self.law.rig_at(z + step, loop.rig), loop.program)
                angle = moved_series(base, moved, moved_along(line, moved)).angle_deg
            except (SolverError, RigError):
                continue
            found[:, i] = (loop.residual_deg(angle) - here) / _STEP
        return found

    def residual_deg(self, found: Optimum) -> Floats:
        """Residual of the records at an optimum, shape (m,)."""
        return found.residual[: -found.z.size] * self.sigma_deg


@dataclass(frozen=True, eq=False)
class _Mode:
    """An optimum with its problem."""

    problem: _Problem
    best: Optimum

    @property
    def square(self) -> float:
        """Sum of squares of records and prior."""
        return self.best.square

    def at_optimum(self) -> Sample:
        """Give the optimum as a draw."""
        return Sample(self.best.z, self.best.log_evidence)

    def is_like(self, other: _Mode) -> bool:
        """Whether two optima of a law are the same."""
        if self.problem.law is not other.problem.law:
            return False
        return bool(np.linalg.norm(self.best.columns @ (other.best.z - self.best.z)) <= _ALIKE)


def calibrate_rig(records: Sequence[Record], *, seed: int = 0) -> RigCalibration:
    """Fit the parameters of a known rig jointly to its records; each record gives its own preload.

    Raises
    ------
    RecordError
        No record; or a record without a known rig, without a loop, with a drive that is not in mm, or that is wrong as
        recorded: rows in no order, an angle that is wrapped, in radians or of the other sense.
    RigError
        The rig is invalid, cannot follow its record, or needs times or cycles.
    """
    for record in records:
        require_rows(record)
    for record in records[1:]:
        if "tolerance" in record.rig and record.rig["tolerance"] != records[0].rig.get("tolerance"):
            raise RecordError(f"{record.source or record.title}: rig.tolerance: expected it in the first record only")
    sensed = [cleaned(record) for record in records]
    loops = tuple(_loop(one) for one in sensed)
    noise_deg = _noise_deg([one.record for one in sensed])
    laws = _possible(_laws(records[0], loops[0].rig), loops)
    found = _optima([_Problem(law, loops, noise_deg) for law in laws])
    sigma_deg = _sigma_deg(found[0], noise_deg)
    scale = (sigma_deg / noise_deg) ** 2
    close = [mode for mode in found if mode.square - found[0].square <= _FAR * scale]
    modes = _distinct([_refitted(mode, sigma_deg) for mode in close])
    notes = (*sensor_notes(sensed), *map(_late, records), *_far_from_file(modes[0]))
    return replace(_calibration(modes, noise_deg, seed), notes=tuple(filter(None, notes)))


def _late(record: Record) -> str:
    words = late_words(record)
    return f"{record.source or record.title or 'record'}: {words}, and its lag counts as loss here" if words else ""


def _far_from_file(mode: _Mode) -> tuple[str, ...]:
    """Warn of numbers that records put far from what the rig's file says."""
    law, z = mode.problem.law, mode.best.z
    numbers = zip(law.coordinates.items(), law.values(z).values(), z.tolist(), strict=True)
    return tuple(
        f"{name} = {value:.3g} {PRIORS[name].unit} is {abs(at):.1f} standard deviations from the {one.middle:.3g} "
        f"{PRIORS[name].unit} in the file of the rig: the file is wrong, or an effect is missing"
        for (name, one), value, at in numbers
        if abs(at) > _FAR_FROM_FILE and not one.may_be_none
    )


def _laws(record: Record, rig: Rig) -> tuple[Law, ...]:
    try:
        return laws_of(rig, record.rig.get("tolerance"))
    except RigError as error:
        raise RigError(f"{record.source or record.title or 'record'}: {error}") from None


def _optima(problems: Sequence[_Problem]) -> list[_Mode]:
    """Optima of all laws that are not the same, the likeliest first.

    The first law of each name, and the first one with play, begin with the stated rig. The first begins again with
    other loops of the material, which may be several optima away. All others begin from its best, and those with play
    from the first with play, too: play that has once been taken for friction is not found from there. A name that
    leaves far more than another is not followed further.
    """
    firsts = {one.law.name: one for one in reversed(problems)}
    with_play = {one.law.name: one for one in reversed(problems) if PLAY in one.law.coordinates}
    begun = {name: dict.fromkeys([one, with_play.get(name, one)]) for name, one in firsts.items()}
    found = {
        name: [_Mode(one, optimum(one, np.zeros(len(one.law.coordinates)))) for one in ones]
        for name, ones in begun.items()
    }
    least = min(mode.square for modes in found.values() for mode in modes)
    for name, modes in found.items():
        if min(mode.square for mode in modes) > _HOPELESS * least:
            continue
        first, z = firsts[name], modes[0].best.z
        modes += [_Mode(first, optimum(first, start)) for start in _with_other_loops(first.law, z)]
        of_first = [mode for mode in modes if mode.problem is first]
        best = min(of_first, key=lambda mode: mode.square).best.z
        played = [mode for mode in modes if mode.problem is not first]
        for one in (one for one in problems if one.law.name == name and one is not first):
            starts = [
                (best, first.law),
                *((mode.best.z, mode.problem.law) for mode in played if mode.problem is not one),
            ]
            use = starts if PLAY in one.law.coordinates else starts[:1]
            modes += [_Mode(one, optimum(one, _carried(z, law, one.law))) for z, law in use]
    return _without_repetition([mode for modes in found.values() for mode in modes])


def _with_other_loops(law: Law, z: Floats) -> list[Floats]:
    names = list(law.coordinates)
    if not all(name in names for name in LOOP):
        return []
    share, angle = LOOP
    starts = []
    for factor in _OTHER_LOOPS:
        start = z.copy()
        start[names.index(share)], start[names.index(angle)] = 0.0, math.log(factor) / law.coordinates[angle].spread
        starts.append(start)
    return starts


def _carried(z: Floats, law: Law, other: Law) -> Floats:
    """Give z of the numbers of another law, 0 of those that the first one does not have."""
    known = dict(zip(law.coordinates, z.tolist(), strict=True))
    return np.array([known.get(name, 0.0) for name in other.coordinates])


def _without_repetition(modes: Sequence[_Mode]) -> list[_Mode]:
    kept: list[_Mode] = []
    for mode in sorted(modes, key=lambda mode: -mode.best.log_evidence):
        if not any(one.is_like(mode) for one in kept):
            kept.append(mode)
    return kept


def _refitted(mode: _Mode, sigma_deg: float) -> _Mode:
    problem = replace(mode.problem, sigma_deg=sigma_deg)
    return _Mode(problem, optimum(problem, mode.best.z))


def _distinct(modes: Sequence[_Mode]) -> list[_Mode]:
    """Optima without repetition, the likeliest first, and without those that do not count."""
    kept = _without_repetition(modes)
    top = kept[0].best.log_evidence
    return [mode for mode in kept if mode.best.log_evidence > top + math.log(_LEAST_ODDS)]


def _possible(laws: tuple[Law, ...], loops: Sequence[_Loop]) -> tuple[Law, ...]:
    """Leave out the flag where the stated metal stays below the lowest plateau: it is then a linear metal."""
    stated = tuple(law for law in laws if law.metal is None)
    others = [law for law in laws if law.metal is not None]
    if not others:
        return laws
    plateau = others[0].coordinates["plateau_MPa"].at(-3.0)
    try:
        strain = max(float(np.abs(solve_chain(loop.rig, loop.program).peak_strain).max()) for loop in loops)
    except (SolverError, RigError):
        return laws
    stress = 1e3 * loops[0].rig.material.youngs_modulus_GPa * strain
    return laws if stress > _NEAR_PLATEAU * plateau else stated


def _sigma_deg(mode: _Mode, noise_deg: float) -> float:
    """Give the standard deviation of residuals, as if they were independent.

    Autocorrelated residuals (first order) count as fewer samples, and those beyond the noise widen all intervals.
    """
    residual = mode.problem.residual_deg(mode.best)
    m, p = residual.size, mode.best.z.size
    r = max(0.0, float(residual[1:] @ residual[:-1]) / max(float(residual @ residual), 1e-300))
    of_each = m / max(1.0, m * (1 - r) / (1 + r))
    rmse_deg = math.sqrt(float(residual @ residual) / m)
    unbiased = math.sqrt(float(residual @ residual) / max(1, m - p))
    return max(unbiased, 1e-3 * noise_deg) * math.sqrt(of_each) * max(1.0, rmse_deg / noise_deg)


def _noise_deg(records: Sequence[Record]) -> float:
    """Give the noise of all records together, at least what their digits resolve."""
    floor = math.sqrt(sum(noise_floor(record) ** 2 for record in records) / len(records))
    return max(floor, _LEAST_NOISE * max(float(np.ptp(record.angle_deg)) for record in records))


def _loop(sensed: Cleaned) -> _Loop:
    record, read = sensed.record, sensed.read
    name = record.source or record.title or "record"
    rig = rig_of(record)
    if rig is None:
        expected = "expected [rig] with preset, file or measured joints, and preload_N"
        raise RecordError(f"{name}: the rig is unknown: {expected}")
    if record.drive_unit != "mm":
        raise RecordError(f"{name}: drive in {record.drive_unit}: expected mm for a known rig")
    require_reversal(record)
    covered, floor = float(np.ptp(record.angle_deg[read])), noise_floor(record)
    if covered < _LEAST_RANGE * floor:
        expected = f"expected at least {_LEAST_RANGE:g} times the noise"
        raise RecordError(f"{name}: the angle covers {covered:.3g} deg, at a noise of {floor:.2g} deg: {expected}")
    require_the_rigs_sense(record)
    require_the_rigs_unit(record)
    every = max(1, math.ceil(int(read.sum()) / SAMPLES))
    keep = np.zeros(record.drive.size, dtype=bool)
    keep[np.flatnonzero(read)[::every]] = True
    keep[[0, *(b.stop - 1 for b in branches(record.drive))]] = True
    drive = record.drive[keep]
    # a record that does not begin at rest has a history: assume that the same drive went before it
    from_rest = abs(drive[0]) <= _AT_REST * np.ptp(drive)
    path = drive if from_rest else np.concatenate([drive, drive])
    try:
        loop = _Loop(rig, LoadProgram(path), path.size - drive.size, record.angle_deg[keep], read[keep])
        simulate_chain(rig, loop.program)
    except (RigError, SolverError) as error:
        raise RigError(f"{name}: {error}") from None
    return loop


def _calibration(modes: Sequence[_Mode], noise_deg: float, seed: int) -> RigCalibration:
    """Draw rigs from the posterior, and say what the records say of each number."""
    first = modes[0]
    law, best, loops = first.problem.law, first.best, first.problem.loops
    residual = first.problem.residual_deg(best)
    rmse_deg = math.sqrt(float(residual @ residual) / residual.size)
    drawn = _drawn(modes, seed)
    weights = flattened([one.log_weight for one in drawn], ENOUGH)
    pairs, condition = _correlations(list(law.coordinates), best.columns)
    parameters = _parameters(law, best.z, drawn, weights)
    return RigCalibration(
        rig=law.rig_at(best.z, loops[0].rig),
        parameters=parameters,
        rigs=tuple(one.law.rig_at(one.z, loops[0].rig) for one in drawn),
        weights=weights,
        laws=_of_laws(drawn, weights),
        rmse_deg=rmse_deg,
        noise_deg=noise_deg,
        condition=condition,
        correlations=pairs,
        inseparable=_inseparable(parameters, pairs),
        experiments=_experiments(first),
    )


@dataclass(frozen=True, eq=False)
class _Drawn:
    """A rig drawn from the posterior: its law, its coordinates, and the logarithm of its weight."""

    law: Law
    z: Floats
    log_weight: float


def _drawn(modes: Sequence[_Mode], seed: int) -> list[_Drawn]:
    """Draw rigs about all optima, in proportion to their evidence."""
    odds, rng = weights_of([mode.best.log_evidence for mode in modes]), np.random.default_rng([seed, 56])
    found = []
    for mode, share in zip(modes, odds.tolist(), strict=True):
        count = max(_LEAST_DRAWS, round(share * DRAWS))
        draws = sampled(mode.problem, mode.best, count, rng)
        draws = draws if len(draws) >= _LEAST_DRAWS else about(mode.best, count, rng)
        kept = [one for one in draws if mode.problem.is_possible(one.z)] or [mode.at_optimum()]
        found += [_Drawn(mode.problem.law, one.z, one.log_weight - math.log(len(kept))) for one in kept]
    return found


def _of_laws(drawn: Sequence[_Drawn], weights: Floats) -> dict[str, float]:
    names = list(dict.fromkeys(one.law.name for one in drawn))
    return {
        name: float(sum(w for one, w in zip(drawn, weights, strict=True) if one.law.name == name)) for name in names
    }


def _parameters(law: Law, z: Floats, drawn: Sequence[_Drawn], weights: Floats) -> dict[str, Parameter]:
    """Values at z, with the 95 % intervals of the draws of its law of the metal, which reach to the value.

    A number that may be 0 is 0 in a draw that does not have it; no interval reaches below that.
    """
    own = [(one.law.values(one.z), w) for one, w in zip(drawn, weights, strict=True) if one.law.name == law.name]
    best, found = law.values(z), {}
    for name, prior in PRIORS.items():
        known = [(one.get(name, 0.0), w) for one, w in own if name in one or prior.unstated is not None]
        if not (name in best if prior.unstated is None else any(name in one for one, _ in own)):
            continue
        values, share = (np.array(one) for one in zip(*known, strict=True))
        is_log = prior.shape == "log" and bool((values > 0).all())
        ends = quantiles(np.log(values) if is_log else values, share / share.sum(), LEVELS)
        value, (low, high) = best.get(name, 0.0), np.exp(ends).tolist() if is_log else ends
        found[name] = Parameter(value, max(0.0, min(low, value)), max(high, value), prior.unit)
    return found


def _correlations(names: Sequence[str], columns: Floats) -> tuple[dict[str, float], float]:
    """Correlations of the parameters by pair, and the condition number of the Jacobian with columns of length 1."""
    norms = np.linalg.norm(columns, axis=0)
    _, singular, basis = np.linalg.svd(columns / norms, full_matrices=False)
    unit = (basis.T / singular**2) @ basis / np.outer(norms, norms)
    correlation = unit / np.sqrt(np.outer(np.diag(unit), np.diag(unit)))
    pairs = {f"{names[i]} ~ {names[j]}": float(correlation[i, j]) for i, j in combinations(range(len(names)), 2)}
    return pairs, float(singular[0] / singular[-1])


def _inseparable(parameters: Mapping[str, Parameter], pairs: Mapping[str, float]) -> tuple[str, ...]:
    sentences = [
        f"{pair.replace(' ~ ', ' and ')}: correlation {r:+.3f}, identified only in combination"
        for pair, r in sorted(pairs.items(), key=lambda item: -abs(item[1]))
        if abs(r) > CORRELATED
    ]
    for name, c in parameters.items():
        assert c.low is not None
        assert c.high is not None
        if c.high - c.low > 2 * abs(c.value):
            unit = "" if c.unit == "-" else f" {c.unit}"
            sentences.append(f"{name}: interval {c.low:.3g} to {c.high:.3g}{unit}, wider than its value")
    return tuple(sentences)


def _experiments(mode: _Mode) -> tuple[Experiment, ...]:
    """Information gain of a further loop at other preloads and amplitudes, simulated with the fitted parameters."""
    problem, z, loop = mode.problem, mode.best.z, mode.problem.loops[0]
    known = mode.best.columns.T @ mode.best.columns
    drive, preload, records = loop.program.drive_mm, loop.rig.preload_N, len(problem.loops)
    low, high = float(drive.min()), float(drive.max())
    before, names, found = np.sqrt(np.diag(np.linalg.inv(known))), list(problem.law.coordinates), []
    samples = mode.best.residual.size - z.size
    for p, a in ((1.0, 1.0), (0.5, 1.0), (2.0, 1.0), (1.0, 0.5), (1.0, 0.25), (0.5, 0.5), (2.0, 0.5)):
        if preload == 0 and p != 1:
            continue
        rig, program = replace(loop.rig, preload_N=p * preload), loop_program(a * low, a * high, cycles=1)
        angles = np.zeros(program.drive_mm.size)
        other = replace(problem, loops=(_Loop(rig, program, 0, angles, angles == 0),))
        more = other.columns(z)[: -z.size]
        if not more.any():
            continue
        information = known + more.T @ more * samples / records / more.shape[0]
        gain = 0.5 * float(np.linalg.slogdet(information)[1] - np.linalg.slogdet(known)[1])
        narrower = before / np.sqrt(np.diag(np.linalg.inv(information)))
        i = int(np.argmax(narrower))
        what = "the same again" if p == a == 1 else f"preload x {p:g}, amplitude x {a:g}"
        amplitude = a * max(abs(low), abs(high))
        found.append(Experiment(what, p * preload, amplitude, gain, names[i], float(narrower[i])))
    return tuple(sorted(found, key=lambda e: -e.gain))

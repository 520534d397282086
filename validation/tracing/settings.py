"""Thresholds and limits of the tracer, each with its unit and the reason for its value.

Ratios to the noise floor are of root mean square errors (rms, deg). Differences of the Bayesian information criterion
(BIC) are in units of twice the natural logarithm of a likelihood ratio. Coordinates of a fit are parameters over their
``scale``, a change of the parameter that matters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

BaselineName = Literal["rig", "equivalent rig", "curve", "play operators"]
"""Kind of baseline model, as in trace.json."""

# --- verdict: when there is something to explain, and when it is explained -------------------------------------------

SIGNIFICANT, SIGNIFICANT_LOOSE = 1.15, 1.3
"""Rms residual over the noise floor from which there is something to explain. The first value is for the baseline of a
rig, known or equivalent. The second is for a curve with a loop, which no rig meets exactly, and for the residual of a
first effect."""
SMALL_SAMPLE_MARGIN = 3.0
"""Over the square root of the number of samples: by how much the estimated noise may be too small (97.5 % of white
noise in branches of 16 to 44 samples, by simulation with third differences and five parameters fitted)."""
AT_FLOOR = 1.5
"""Rms residual over the noise floor up to which a residual counts as explained in any case."""
EXPLAINED_SHARE = 0.75
"""Part of the mean square above the noise that the effects must explain together to be named."""
WORTH_NAMING = 0.9
"""Rms residual after an effect over the one before: an effect with more is not worth naming."""
NOT_ALIKE = 0.08
"""Rms residual over half the largest range of the angle: an equivalent rig that is further off did not make the
records."""
FAR_BEYOND_CHANCE = 30.0
"""BIC that one effect must gain where the residual of an equivalent rig is at most :data:`SIGNIFICANT` times the noise.
In twelve cases without an effect the best of 23 gained 1 at most."""
VERY_STRONG_EVIDENCE = 10.0
"""BIC difference below which effects are not distinguished: very strong evidence starts there (Kass, Raftery 1995, doi
10.1080/01621459.1995.10476572)."""
SIMILAR_SHARE = 0.03
"""The same as a part of the whole BIC gain where the geometry is unknown: neither an equivalent rig nor a curve fits
such records exactly."""

# --- search: how many effects, and how many models are compared ------------------------------------------------------

MOST_EFFECTS = 3
"""Effects that are added one after the other at most."""
EXTENDED_MODELS = 2
"""Best models of a stage to which a further effect is added."""
MOST_COMPETITORS = 3
"""Models that are fitted as thoroughly as the best one, and between which the next experiment is to decide."""
COMPETITOR_SQUARE = 1.5
"""Mean square over the best model's up to which a model of an equivalent rig is fitted again from other starting
points."""
COMPETITOR_BIC = 5 * VERY_STRONG_EVIDENCE
"""BIC difference up to which a competitor on a known rig is fitted again from other starting points."""
AT_NOISE = 1.05
"""Rms residual over the noise floor: a fit that is as near needs no other starting point."""
COMPETITOR_AT_NOISE = 1.5
"""Mean square over that of a model at the noise: a larger residual needs no other starting point either."""
OTHER_FORM_SQUARE = 1.5
"""Mean square after the first steps, over that of the effect's best form, up to which another form is fitted to its
end."""
GAINS_FAST = 0.5
"""Mean square after further steps over the one before, up to which an effect is followed although its residual exceeds
what the linearised gain of its start predicts."""
RESTS_EARLY = 0.5
"""Rms residual that a baseline's own derivatives predict for its optimum, over the one that it has, below which effects
are also started from the declared parameters. Of 30 baselines that an effect of the catalogue had moved, 28 had 0.6 to
1."""
BESIDE = 1.0
"""Largest distance, in coordinates, of a start from a fitted model whose derivatives serve its first step."""
STARTS_PER_EFFECT = 3
"""Forms of one effect that are fitted, each from its best starting point."""
LESSER_FORM = 0.8
"""Part of the linearised gain of an effect's best form: forms that gain less are not fitted."""
LEAST_GAIN = 0.02
"""Part of the residual's sum of squares: a starting point with a smaller linearised gain is not fitted."""


@dataclass(frozen=True)
class SearchPolicy:
    """How effects are searched for beside one kind of baseline model.

    Parameters
    ----------
    name
        Kind of baseline, as in trace.json.
    significant
        Rms residual of the baseline over the noise floor from which there is something to explain.
    screened
        Whether a run of the model takes milliseconds, so that candidates are screened: by the linearised gain first,
        and by a few least-squares steps then. Without screening every starting point is fitted to convergence.
    first_candidates, later_candidates
        Effects that pass the linearised gain, for the first effect and for further ones; None lets all pass.
    first_steps
        Least-squares steps of a candidate before it is compared with the others.
    finished, later_finished
        Effects at most that are then fitted to convergence, for the first effect and for further ones.
    leading
        Best effects of those, which are also fitted in forms with more parameters and from other starting points.
    follows_gain
        Whether an effect whose residual after the first steps exceeds what the linearised gain of its start says gets
        further ones before it is left behind.
    near, near_at_noise
        Mean square over the least one, after the first steps or at convergence, up to which an effect is fitted to
        convergence; the second where the least one is noise.
    absorbs_effects
        Whether the baseline is so free that it absorbs a good part of an effect. The search then goes on to the noise,
        each selected effect is exchanged for others, and competitors are fitted from other starting points. Beside a
        model without or with one effect whose residual is noise, another must gain :data:`FAR_BEYOND_CHANCE`.
    starts_from_declared
        Whether effects are also started beside the declared parameters: the fitted baseline may have absorbed the
        effect.
    restarted
        Whether the best model is fitted again from other starting points.
    along_valley
        Whether these include points along the flattest direction of the fit.
    refined
        Whether named effects are refined in the search; an equivalent rig has its named effects refined in the final
        fit.
    distinct_share
        Part of the whole BIC gain below which effects are not distinguished.
    own_preload
        Whether a record may be held out whose preload no other record has. A model in which the preload does not act,
        but is fitted to, cannot predict such a record.
    refit_steps
        Least-squares steps in which a candidate that is not named is fitted to the training samples.
    refit_from_jacobian
        Whether these start with the derivatives of the fit to all samples.
    """

    name: BaselineName
    significant: float
    screened: bool
    first_candidates: int | None
    later_candidates: int | None
    first_steps: int
    finished: int
    later_finished: int
    leading: int
    follows_gain: bool
    near: float
    near_at_noise: float
    absorbs_effects: bool
    starts_from_declared: bool
    restarted: bool
    along_valley: bool
    refined: bool
    distinct_share: float
    own_preload: bool
    refit_steps: int
    refit_from_jacobian: bool


# --- records and baseline models -------------------------------------------------------------------------------------

SAME_CYCLES = 0.03
"""Relative difference up to which cycles have the same amplitude, so that what changes from one to the next is an
effect of the cycle."""
FROM_REST = 0.05
"""Part of the drive's range: a record that begins as near to zero begins from rest."""
APPROACH_SAMPLES = 24
"""Samples over the drive's range on the way from rest to the first sample of a record that begins elsewhere."""
EXACT_REPEAT = 1e-9
"""Part of the drive's range up to which cycles repeat each other exactly and need not be run again."""
KNOWN_RIG_SAMPLES, LEAST_RECORD_SAMPLES = 4000, 200
"""Samples that a known rig is fitted to, of all records together, and of one record at least."""
EQUIVALENT_RIG_SAMPLES, REFINED_SAMPLES = 300, 1200
"""Samples of a record that an equivalent rig is fitted to at most, about: in the search, and in the final fit."""
EQUIVALENT_JOINTS, REFINED_PARTS = 6, 2
"""Joints of an equivalent rig in the search, and parts of each in the final fit. If the tendons are slack, six joints
differ from 14 by a fifth of the noise where they are fitted, and by more than half of it elsewhere."""
CURVE_SAMPLES = 600
"""Samples of a record that the curve is fitted to at most, about; turning points are never left out."""
PRIOR_WEIGHT = 5e-4
"""Weight of the prior of an equivalent rig, and of a known rig behind a motor: the error, over half the largest range
of the angle, that a parameter counts as which is one scale away from its prior mean."""
LARGEST_TOE = 2.2
"""Toe region of the tendons of an equivalent rig at most, over the largest preload: as soft as the paper's tendon at
20 N. A softer one is an effect (stiffening)."""
LEAST_TOE, TOE_PARAMETER = 0.025, "toe_N"
"""Toe region, over the largest preload, of tendons that are all but linear, and its name in a baseline."""
LARGEST_GUIDE_FRICTION = 0.02
"""Friction of all guides of an equivalent rig at most, over the largest preload: more is an effect."""
LARGEST_CUBIC = 0.45
"""Even and odd part of the cubic between drive and angle at most, which keep it monotone."""
LARGEST_LOOP_CHANGE = 0.3
"""Change of the curve's loop with the angle at most: friction and tendons of any rig make as much."""
LEAST_LOOP = -0.85
"""Least Bouc-Wen parameter A of the curve: at -1 the angle stands still after a reversal, as with backlash."""
SAME_PRELOAD = 0.1
"""Relative difference up to which records belong to one preload group of the curve."""
NO_LOOP_GROWTH = 1e-3
"""Growth of the curve's loop between preloads below which the tendons have no toe region."""
LARGEST_TOE_OF_CURVE = 100.0
"""Toe region over the largest preload that is used where the loop grows as much as any toe region allows."""
CURVE_START_STEPS, CURVE_STARTS = 12, 3
"""Least-squares steps of the curve towards a start of an effect, and starts of a form that are then fitted."""
LEAST_PLAY_SAMPLES = 150
"""Samples of all records together from which play operators are fitted: five for a parameter, about."""
LEAST_NEW_SAMPLES = 30
"""Samples of all new records together, behind their first strokes, that are compared with a reference."""
PLAY_SHAPES = tuple((powers, curve) for curve in (6, 8, 12) for powers in (0, 1))
"""Baselines of play operators that are compared: the largest power of the position that the widths of plays depend on,
and the columns of the spline f."""
PLAY_SAMPLES = 900
"""Samples of a record that play operators are fitted to at most, about; turning points are never left out."""
PLAY_CURVE_SCALE = 30.0
"""Scale of the columns of the spline f over half the largest range of the angle: so large that the prior does not pull
f to nothing."""
STILL_LEAST, STILL_MOST, STILL_WIDTHS = 0.005, 0.25, 40
"""Widths of a still zone over the range of the drive that are tried, in equal ratios: the error has a kink wherever a
width meets the radius of a play."""
STILL_RISE, STILL_NARROWER = 1.02, 2 / 3
"""Rms error over its least value up to which a still zone is tolerated, and part of its width down to which folds fit
it."""
STILL_MOTION = 0.125
"""Motion within a still zone over the mean slope of the loop up to which it is one."""
STILL_AS_GOOD, STILL_TWICE, STILL_TOLERANCE = 1.01, 2.0, 1e-3
"""Rms error on held-out data over that before up to which a still zone, the stricter model, predicts as well; factor on
its width that the records must refute; relative tolerance of a width that is fixed."""
PLAY_START_PART = 0.5
"""Part of the first stroke that a play may have been moved by: on a virgin branch its loop is half as wide."""
PLAY_COEFFICIENT, PLAY_PRIOR = 20.0, 3e-3
"""Bound of a coefficient, and weight of its prior, both over half the largest range of the angle. A coefficient of that
half range counts as an error of 0.3 % of it."""
GAIN_FACTOR, GAIN_SCALE = 3.0, 0.01
"""Bounds of a motor's gain as a factor either way, and its scale, relative to the gain that is started from."""
GAIN_BRANCH_SAMPLES, GAIN_CORRECTIONS = 20, 4
"""Samples of a branch of the path with which that gain is found, and corrections of it for the tendons' stretch."""

# --- least squares ---------------------------------------------------------------------------------------------------

STEPS, MOST_STEPS, FEW_STEPS = 30, 40, 4
"""Least-squares steps of a fit at most: by default, of a fit that has to converge, and of one that is only to show
which candidates are worth the rest."""
EARLY_STEPS, LEAST_ABSORBED = 4, 1.1
"""Steps of an equivalent rig's baseline that do not yet let it absorb an effect; and its mean square then, over that in
the end, from which it has absorbed so much that effects are also started beside the early one."""
DIFFERENCE_STEP = 1e-3
"""Step of finite differences, in coordinates. A moved rig is solved for to first order, so that a smaller step would
change nothing but the part of rounding and of the residual."""
CONVERGED = 1e-4
"""Relative change of the sum of squares, and of the coordinates, at which a fit ends."""
INFEASIBLE_DEG = 1e3
"""Error assigned to parameters that no rig can have, so that the solver shortens its step."""
INSIDE_BOUNDS = 1e-6
"""Distance from a bound, in coordinates, to which a start at the bound is moved."""

# --- starting points -------------------------------------------------------------------------------------------------

NO_CHANGE_DEG = 1e-9
"""Largest change of the angle below which an effect counts as absent."""
LARGEST_FACTOR = 100.0
"""Largest factor by which the linearised gain enlarges a start."""
KEPT_GAIN = 0.5
"""Part of the predicted linearised gain that an enlarged start must have."""
LARGEST_STEP = 2.0
"""How far the other parameters are moved with a start, as a factor on the start's own size."""
LOOP_PARAMETER = "loop_angle_deg"
"""Parameter of a rig from other values of which it is fitted again: a material loop of few slipping elements has an
optimum for each of them at the ends of the smaller records."""
LOOP_FACTORS, LOOP_FACTORS_FINAL = (0.5, 2.0), (0.5, 1.6)
"""Factors on it, in the search and at its end."""
MOST_RESTARTS = 2
"""Times that a fit on a known rig is started again from other loops, after a better one was found from there: a true
loop may be two factors away."""
PROMISING = 1.2
"""Rms training error over that of the fit so far: a fit from another starting point that is as near after a few steps
is continued."""
NO_SLOPE = 1e-6
"""Norm of a parameter's derivatives over the largest one below which the parameter does nothing."""
CONTAINED_TOLERANCE = 5e-3
"""Relative excess of the mean square over that of a contained model up to which a model counts as no worse: fits end at
such changes."""
NOTHING = 2e-3
"""Change of all errors over the errors, as norms, up to which an effect counts as changing nothing: fibres of
a plateau that no stress reaches differ from an elastic section by as much."""

# --- noise floor and independent samples -----------------------------------------------------------------------------

NOISE_BRANCH_SAMPLES, NOISE_DIFFERENCES = 4, 5
"""Fewest samples of a branch that has a third difference, and fewest of these from which the local noise is estimated:
the residual of a model is flat, so that even branches of four samples separate noise from drift."""
STEP_BRANCH_SAMPLES = 8
"""Fewest samples of a branch that shows the steps of an encoder: fewer may be commanded in whole steps."""
MAD_TO_SIGMA = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""
LEAST_NOISE = 1e-5
"""Noise over the range of the angle: less comes from a simulation, no sensor of a bending angle resolves it."""
SAMPLES_OF_BRANCH = 8.0
"""Independent samples that a branch of the path counts for at least: about the parameters of a smooth curve."""
MOST_CORRELATION = 0.99
"""Largest autocorrelation of neighbouring errors that is used."""

# --- sensors ---------------------------------------------------------------------------------------------------------

STEPS_TOLD = 0.5
"""Error by the steps of the drive over the noise floor from which the words report it."""
MOST_WANDER = 3.0
"""Rms residual over the noise of neighbouring samples up to which what does not repeat counts as the sensor's: practice
wanders and ripples are up to 3 times the noise, lost counts and jumps of the rig are more."""
CORRELATED, MOST_CORRELATED = 1.2, 1.9
"""Third difference of every second sample over that of all samples: 1 of white noise, 1.3 to 1.41 of an autoregressive
one with correlations of 0.5 to 1, 8 of a smooth function. Between these numbers noise counts as correlated."""
MOST_OF_RESIDUAL = 1.3
"""Correlated noise over the rms residual at most: an estimate beyond is of structure that looks like it."""
DECIMATIONS = (1, 2, 4, 8)
"""Distances of the samples whose third differences show the correlation of noise."""
MISFIT_ALIKE = 1.15
"""Rms residual over that of the best model, where that is above the noise, up to which a model may be as good."""
AS_DECLARED = 1.1
"""Rms residual over the noise up to which measured joints are taken to be as declared: a stiffness that varies along
the bend would give a larger residual."""
NEAR_NOISE = 2.0**0.5
"""Rms residual of a known rig over the noise up to which it is not unexplained, and up to which no effect is named
beside measured joints: what these are off by makes as much. Beside an unknown rig one is named up to there
if its residual is noise."""

# --- smooth functions of the residual, and tests of dependence -------------------------------------------------------

SMOOTH_FUNCTION_BIC = 6.0
"""BIC that a further smooth function must gain (strong evidence; Kass, Raftery 1995)."""
DEPENDENCE_COLUMNS = 6
"""Columns of the smooth function with which dependence is tested."""
PORTMANTEAU_LAGS = 10
"""Lags of the test for whiteness."""

# --- held-out data ---------------------------------------------------------------------------------------------------

KNOWN_BEGINNING = 0.05
"""Part of a held-out record that is fitted, at its beginning: the state that a record starts in cannot be predicted."""
SAME_PROTOCOL = 0.1
"""Relative difference up to which preloads, amplitudes and rates are the same."""

LEAST_FOLD_RECORDS, MOST_FOLDS, FOLD_BLOCKS, LEAST_FOLD_CYCLES = 2, 4, 4, 3
"""Records above which a record is a fold, folds of a cross-validation at most (more are held out several at a time),
blocks of a path without whole cycles, and cycles of a single record from which they are folds: two to learn from."""
MOST_EXTRAPOLATION = 0.1
"""Part of its range by which a fold may extrapolate and choose. Set on halves of two catheter records."""
BOOTSTRAP_DRAWS, BOOTSTRAP_SAMPLES, CONFIDENCE = 2000, 40, 0.95
"""Draws of a bootstrap interval, neighbouring samples that are drawn together, and its level."""
REFERENCE_MOST = 2.0
"""Floor of a comparison with a reference at most, over the rms error of the shared model on the reference, which was
fitted to it."""
FOLD_CANDIDATES, FOLD_EFFECTS = 5, 2
"""Effects of a stage that go on to the folds, and effects at most that folds may name one after the other."""
FURTHER_ALIKE = 1
"""Effects at most that a further effect may be confused with. Several effects may explain small structure
of real records that none of them made; drag and delay are hard to distinguish by nature."""
FOLD_ALIKE = 1.05
"""Rms error on held-out data over the best candidate's up to which candidates are not distinguished. Bootstrap
intervals of a few records are too narrow for less."""
NOT_TOLD = 0.01
"""Part of the squares that an effect explains which another one may fail to explain and still count as not
distinguished, and least part of the baseline's that a further effect explains: real records have structure of that size
that no model has."""
FAR_ABOVE = 2.0
"""Rms error over the noise up to which a known rig without a missing effect may be off: the residual of rigs of another
simulator is 1.0 to 1.9 times the noise where their flexures may vary, and with an effect it must be noise. Of an
unknown rig, held-out error over the noise and over the error of the fitted samples beyond which nothing is claimed."""
MOST_OF_ERROR = 0.6
"""Part of the mean square above the noise that one effect must explain of fitted samples that inner folds hold out, to
be named where the residual of a known rig with effects exceeds the noise."""
MOST_ALIKE = 2
"""Effects at most that the one named there may be confused with: if more explain the error equally well, none is shown
to be the cause."""
PARTIAL_SHARE = 1.0 / 3.0
"""Part of the mean square above the noise that effects must explain of the held-out error to be named; of a change
since a reference of the whole mean square, too."""

COMPETITOR_MARGIN, COMPETITOR_NOISE, COMPETITOR_FAR = 1.1, 3.0, 5.0
"""No effects are searched for beside an equivalent rig whose residual exceeds the held-out error of play operators
times the first number, where that error is more than the third number times the noise. An equivalent rig with one
effect is given up where its residual exceeds the held-out error of play operators over the first number (its own error
is of samples that it was fitted to) and more than the second number times the noise. So is an equivalent rig or a curve
with effects whose residual is about the held-out error of play operators with theirs, or larger, and more than the
third number times the noise: one effect more does not bring it to the noise. Play operators are given effects before
the rig where their held-out error is more than the second number times the noise."""

NINE_OF_TEN, DETECTION_RUNS, SAME_ACTION = 1.28, 6, 0.1
"""Standard deviations above which nine of ten of a normal distribution lie, runs of the model in which the size of a
detection limit is found, and how near its action comes to what is needed: the rules are no sharper than a tenth."""

COMPETITOR_FITTED = 1.3
"""Held-out error of play operators over the error of a curve on samples that it was fitted to, up to which the curve is
not expected to predict better."""

# --- next experiment and second opinion ------------------------------------------------------------------------------

PRELOAD_FACTORS, AMPLITUDE_FACTORS, RATE_FACTORS = (1.0, 0.5, 2.0), (1.0, 0.5, 1.25), (1.0, 0.1, 10.0)
"""Factors on the protocol of the record with the widest drive, the gentlest first."""
TENSION_FACTOR = max(AMPLITUDE_FACTORS)
"""Largest tension of a proposed program over that of the records."""
MANY_CYCLES, DWELL_PERIODS, DWELL_SAMPLES = 10, 10.0, 40
"""Cycles of a long record; periods that a dwell at full drive lasts, and its samples."""
FEW_CYCLES, CYCLE_SAMPLES = 2, 88
"""Cycles of the other programs, and samples of a cycle."""
NEARLY_MOST = 0.9
"""Part of the largest difference between competitors: the gentlest program that reaches it is proposed."""
ONE_SIDED = 0.25
"""Part of half the drive's range: a drive whose middle is further away is not about zero."""
MULTIBODY_CYCLES, MULTIBODY_CYCLE_SAMPLES = 12.0, 100
"""Cycles of drive that the multibody model runs in all, about: it takes a third of a second for each. Samples that
count as a cycle, where a record has more of them."""


KNOWN_RIG = SearchPolicy(
    name="rig",
    significant=SIGNIFICANT,
    screened=True,
    first_candidates=None,  # with guides that stick the linearised gain says little
    later_candidates=10,
    first_steps=2 * FEW_STEPS,
    finished=8,
    later_finished=8,
    leading=6,
    follows_gain=True,
    near=6.0,
    near_at_noise=4.0,
    absorbs_effects=False,
    starts_from_declared=True,
    restarted=True,
    along_valley=True,  # few samples distinguish backlash from friction at the base
    refined=True,
    distinct_share=0.0,
    own_preload=True,
    refit_steps=MOST_STEPS,
    refit_from_jacobian=False,
)
"""A rig that the records declare: the compiled chain with five free parameters."""

EQUIVALENT_RIG = SearchPolicy(
    name="equivalent rig",
    significant=SIGNIFICANT,
    screened=True,
    first_candidates=None,  # where all of the baseline is free, the linearised gain says little
    later_candidates=5,
    first_steps=2 * FEW_STEPS,
    finished=8,
    later_finished=3,
    leading=1,
    follows_gain=False,
    near=12.0,  # the first steps predict the end less well than on a known rig
    near_at_noise=12.0,
    absorbs_effects=True,
    starts_from_declared=False,
    restarted=True,
    along_valley=False,  # the flattest direction is that of all forces in proportion, which no record shows
    refined=False,
    distinct_share=SIMILAR_SHARE,
    own_preload=True,
    refit_steps=3,
    refit_from_jacobian=True,
)
"""The simplest rig that could have made records of unknown geometry."""

CURVE = SearchPolicy(
    name="curve",
    significant=SIGNIFICANT_LOOSE,
    screened=False,  # a run takes microseconds
    first_candidates=None,
    later_candidates=None,
    first_steps=MOST_STEPS,
    finished=0,
    later_finished=0,
    leading=0,
    follows_gain=False,
    near=0.0,
    near_at_noise=0.0,
    absorbs_effects=False,
    starts_from_declared=False,
    restarted=False,
    along_valley=False,
    refined=False,
    distinct_share=SIMILAR_SHARE,
    own_preload=False,
    refit_steps=MOST_STEPS,
    refit_from_jacobian=False,
)
"""A monotone cubic with a Bouc-Wen loop on it."""

POLICIES = {policy.name: policy for policy in (KNOWN_RIG, EQUIVALENT_RIG, CURVE)}

"""Derivatives of a run by its constants: moved rigs along the steps that a rig has taken, compiled.

A rig of which one constant is a little different, or its drive, has nearly the same path. Along the steps of the rig
(:class:`fem_models.chain.follow.Tape`) the moved rig is solved for to first order: which guides slide, which elements
slip, which notches and tendons touch or are taut is as in the rig, and one back-substitution with the rig's tangent
gives how far its equilibrium is from the rig's. The history of the dry elements moves along. This is the direct
differentiation of a response that depends on its path (Conte, Vijalapura and Meghella 2003, J. Engineering Mechanics
129, "Consistent finite-element response sensitivity analysis"), with differences in place of derivatives by the
constant.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fem_models.chain.compiled import chain_njit
from fem_models.chain.each import joint_at, loop_part, rest_path
from fem_models.chain.equations import (
    BAND,
    BAND_OF_JOINTS,
    Work,
    assemble,
    copy,
    copy_both,
    copy_rows,
    external_moments,
    free_span,
    work_space,
)
from fem_models.chain.fibres import transform
from fem_models.chain.follow import Path, Run, Tape, creep_on, load_at
from fem_models.chain.history import accept, motion_at_rest
from fem_models.chain.laws import (
    ONLY_A,
    ONLY_B,
    Span,
    closed,
    crossing,
    crossing_at,
    flag_along,
    flag_branch,
    flag_element,
    segment,
    spring,
    wrap,
)
from fem_models.chain.parameters import Memory, Parameters
from fem_models.chain.section import BENT, LONGER, Bend, bend_on, with_section
from fem_models.load.stepping import Load, at_rest, between
from hysteresis.arrays import Floats, Ints, Mask


class Line(NamedTuple):
    """A rig at each of its steps, and the linear equations there; shapes (s, ...)."""

    tape: Tape
    factors: Floats  # (s, 3 N + 3, 2 BAND + 1) of the tangent, by columns
    outside: Mask  # (s,), whether the tangent is by the headings of the rings
    stop: Floats  # (s,), stiffness of a touched tip stop, else 0
    lever: Floats  # (s, 3 N + 3), of the tip stop; (0, ...) without a stop
    behind: Floats  # the same, the tangent's solution for the lever
    half_sine: Floats  # (s, N), of half the angle of each joint
    half_cosine: Floats
    capstan: Floats  # (s,), friction coefficient
    rest_wrap: float
    ratio: Floats  # (s, N), of a guide's friction to the tensions
    taut: Ints  # (s, N + 1), which tendons are taut
    closed: Mask  # (s, N), notches
    slips: Floats  # (s, j, N), sign of the moment of a Jenkins element that slips, else 0
    branch: Ints  # (s, k, N), of a flag element


class Moved(NamedTuple):
    """A moved rig at the last step, and what it takes to find the next one."""

    x: Floats  # (3 N + 3,)
    residual: Floats  # (3 N + 3 + 2 BAND,), zeros at both ends
    change: Floats  # (3 N + 3,), of x from the rig's
    tension: Floats  # (2, N + 1)
    spans: Floats  # (N + 1, 7), tensions at the rig's x, and their slopes
    crept: Floats  # (2,)
    longer: Floats  # (N,), elongation of superelastic sections


@chain_njit(error_model="python")
def factorise(a: Floats, factors: Floats, reach: int) -> None:
    """Factorise a band of half width ``reach`` without pivoting; a is lost.

    The factors, both shape (n, 2 BAND + 1), are stored by columns, as :func:`substitute` takes them: entry (i, j) at
    [j, i - j + BAND], the multipliers below the diagonal, and on it the pivots' inverses.
    """
    n = a.shape[0]
    for i in range(n):
        pivot = 1.0 / a[i, BAND]
        factors[i, BAND] = pivot
        last = min(reach, n - 1 - i)
        for k in range(1, last + 1):
            factors[i + k, BAND - k] = a[i, BAND + k]
        for r in range(1, last + 1):
            factor = a[i + r, BAND - r] * pivot
            factors[i, BAND + r] = factor
            if factor != 0.0:
                for k in range(1, last + 1):
                    a[i + r, BAND + k - r] -= factor * a[i, BAND + k]


@chain_njit(forceinline=True)
def substitute(factors: Floats, b: Floats) -> None:
    """Solve for b in place, shape (n + 2 BAND,) with zeros at both ends, by columns: they wait for each other less."""
    n = factors.shape[0]
    for i in range(n):
        own = b[i + BAND]
        for k in range(1, BAND + 1):
            b[i + BAND + k] -= factors[i, BAND + k] * own
    for i in range(n - 1, -1, -1):
        own = b[i + BAND] * factors[i, BAND]
        b[i + BAND] = own
        for k in range(1, BAND + 1):
            b[i + BAND - k] -= factors[i, BAND - k] * own


@chain_njit(allocates=True)
def line_of(tape: Tape, stop: bool, elements: int, flags: int, rest_wrap: float) -> Line:
    """Arrays for the steps of a tape."""
    steps, size = tape.x.shape
    joints, levers = tape.state.shape[2], steps if stop else 0
    return Line(
        tape=tape,
        factors=np.zeros((steps, size, 2 * BAND + 1)),
        outside=np.zeros(steps, dtype=np.bool_),
        stop=np.zeros(steps),
        lever=np.zeros((levers, size)),
        behind=np.zeros((levers, size)),
        half_sine=np.empty((steps, joints)),
        half_cosine=np.empty((steps, joints)),
        capstan=np.zeros(steps),
        rest_wrap=rest_wrap,
        ratio=np.empty((steps, joints)),
        taut=np.zeros((steps, joints + 1), dtype=np.int64),
        closed=np.zeros((steps, joints), dtype=np.bool_),
        slips=np.zeros((steps, elements, joints)),
        branch=np.zeros((steps, flags, joints), dtype=np.int64),
    )


@chain_njit(error_model="python")
def note_step(s: int, line: Line, rig: Parameters, memory: Memory, work: Work, load: Load) -> None:
    """Note what a step's equations are like at its end, before the dry elements take it up."""
    x, joints = line.tape.x[s], line.ratio.shape[1]
    line.capstan[s] = load.friction_scale * rig.capstan
    for i in range(joints + 1):
        line.taut[s, i] = (ONLY_A if work.tension[0, i] > 0.0 else 0) + (ONLY_B if work.tension[1, i] > 0.0 else 0)
    for i in range(joints):
        theta = x[3 * i + 3]
        line.half_sine[s, i], line.half_cosine[s, i] = math.sin(0.5 * theta), math.cos(0.5 * theta)
        line.ratio[s, i] = math.tanh(0.5 * line.capstan[s] * wrap(i, x[3 * i], theta, rig))
        line.closed[s, i] = closed(theta, joint_at(rig, i))
        for j in range(memory.slip_moment.size):
            part = loop_part(rig, i) * memory.jenkins_stiffness[j] * (theta - memory.jenkins[j, i])
            if abs(part) > loop_part(rig, i) * (load.loop_scale * memory.slip_moment[j]):
                line.slips[s, j, i] = math.copysign(1.0, part)
        for j in range(memory.flag_stiffness.size):
            line.branch[s, j, i] = flag_branch(theta - load.rest_angle, memory.flags[j, i], flag_element(j, memory))


@chain_njit(nogil=True, error_model="python", allocates=True)
def linearise(tape: Tape, path: Path, rig: Parameters, memory: Memory) -> Line:
    """Take the steps of a tape once more, and factorise the tangent at each."""
    line = line_of(tape, rig.stop_stiffness > 0.0, memory.slip_moment.size, memory.flag_stiffness.size, rig.rest_wrap)
    joints = tape.state.shape[2]
    motion, work = motion_at_rest(rig, joints), work_space(rig, joints)
    behind = np.zeros(tape.x.shape[1] + 2 * BAND)
    here = at = load = at_rest(rig.rest)
    goal = here
    for s in range(tape.part.size):
        k, part, rate = tape.sample[s], tape.part[s], 0.0
        if s > 0:
            if k != tape.sample[s - 1]:
                here, goal = goal, load_at(k, path, motion.crept)
            load = between(here, goal, part) if part < 1.0 else goal
            rate = 1.0 / (load.time - at.time) if load.time > at.time else 0.0
        copy(motion.x if s > 0 else tape.x[0], work.x_before)
        copy_both(tape.state[s], work.state)
        balance = assemble(tape.x[s], rig, memory, load, work, rate, False)
        line.outside[s], line.stop[s] = balance.outside, balance.stop_stiffness
        reach = BAND if balance.outside else BAND_OF_JOINTS
        factorise(work.tangent, line.factors[s], reach)
        if balance.stop_stiffness > 0.0:
            copy(work.lever, line.lever[s])
            copy(work.lever, behind[BAND:-BAND])
            substitute(line.factors[s], behind)
            copy(behind[BAND:-BAND], line.behind[s])
        note_step(s, line, rig, memory, work, load)
        copy(tape.x[s], motion.x)
        work.guess[0], work.guess[1] = work.tension[0, 0], work.tension[1, 0]
        accept(rig, memory, work, motion, load, rate)
        at = load
        if s > 0 and part == 1.0 and k + 1 < path.creep.size:
            creep_on(path.creep[k + 1], rig, work.tension, motion.crept)
    return line


@chain_njit(forceinline=True)
def note_span(i: int, span: Span, spans: Floats) -> None:
    """Keep tensions and slopes of a segment, one row of (N + 1, 7)."""
    spans[i, 0], spans[i, 1] = span.tension
    spans[i, 2], spans[i, 3] = span.own
    spans[i, 4], spans[i, 5] = span.by_angle
    spans[i, 6] = span.cross


@chain_njit(forceinline=True)
def held_moments(s: int, line: Line, rig: Parameters, memory: Memory, load: Load, b: Floats) -> None:
    """Fill the moments that bend the joints of a moved rig to the rig's angles, each part on the rig's branch."""
    x, slips, shut = line.tape.x[s], line.slips[s], line.closed[s]
    jenkins, jenkins_stiffness, slip_moment = memory.jenkins, memory.jenkins_stiffness, memory.slip_moment
    for i in range(shut.size):
        theta, own = x[3 * i + 3], joint_at(rig, i)
        moment = spring(theta - load.rest_angle, own)[0]
        if shut[i]:
            moment += math.copysign(own.contact_stiffness * (abs(theta) - own.contact_angle), theta)
        b[BAND + 3 * i + 3] = moment
    for j in range(slip_moment.size):
        first, most = jenkins_stiffness[j], load.loop_scale * slip_moment[j]
        for i in range(shut.size):
            slip, stiffness, limit = slips[j, i], loop_part(rig, i) * first, loop_part(rig, i) * most
            sticks = stiffness * (x[3 * i + 3] - jenkins[j, i])
            b[BAND + 3 * i + 3] += sticks if slip == 0.0 else slip * limit
    for j in range(memory.flag_stiffness.size):
        flag, rest, on = flag_element(j, memory), memory.flags[j], line.branch[s, j]
        for i in range(shut.size):
            b[BAND + 3 * i + 3] += flag_along(on[i], x[3 * i + 3] - load.rest_angle, rest[i], flag)[0]


@chain_njit(forceinline=True)
def without_friction(rig: Parameters, i: int) -> bool:
    """Whether a guide neither sticks nor slides."""
    return rig.capstan == 0.0 and rig.guide == 0.0 and (i > 0 or rig.sheath == 0.0)


@chain_njit(forceinline=True)
def imbalance(
    s: int, line: Line, rig: Parameters, memory: Memory, load: Load, rate: float, work: Work, moved: Moved
) -> None:
    """Fill the residual of a moved rig at the rig's equilibrium; see :func:`fem_models.chain.equations.assemble`."""
    x, before, b, spans = line.tape.x[s], moved.x, moved.residual, moved.spans
    sine, cosine, ratios, taut = line.half_sine[s], line.half_cosine[s], line.ratio[s], line.taut[s]
    state, guides, external = line.tape.state[s], memory.guides, work.external
    n, capstan = ratios.size, load.friction_scale * rig.capstan
    b[:] = 0.0
    external_moments(x, rig, load, work, 1 if line.stop[s] > 0.0 else 0)
    held_moments(s, line, rig, memory, load, b)
    near, alike = free_span(x, load, rig, (work.guess[0], work.guess[1]), taut[0]), crossing(rig.rest, rig).length
    note_span(0, near, spans)
    same = capstan == line.capstan[s] and rig.rest_wrap == line.rest_wrap
    for i in range(n):
        u = 3 * i + 1
        v, row = u + 3, u + 2
        own, rest = joint_at(rig, i), rest_path(rig, i, alike)
        path = crossing_at(sine[i], cosine[i], own)
        stretch_a = x[u] - x[v] - path.length[0] + rest[0]
        stretch_b = x[u + 1] - x[v + 1] - path.length[1] + rest[1]
        if memory.fibre_area.size > 0:
            bend = Bend(x[row] - load.rest_angle, (stretch_a, stretch_b), path.lever, taut[i + 1], rate)
            far, bent, _ = with_section(i, bend, own, memory, work.sections[i])
            b[BAND + row] += bent
        else:
            far = segment(stretch_a, stretch_b, path.lever, own, taut[i + 1])
        note_span(i + 1, far, spans)
        pull = far.tension[0] * path.lever[0] + far.tension[1] * path.lever[1]
        b[BAND + row] += rate * rig.drag_joint * (x[row] - before[row]) - pull - external[i]
        constant, drag = rig.guide, 0.0
        if i == 0:
            constant, drag = constant + rig.sheath, rate * rig.drag_sheath
        ratio = ratios[i] if same else math.tanh(0.5 * capstan * wrap(i, x[3 * i], x[row], rig))
        smooth, constant = without_friction(rig, i), load.friction_scale * constant
        ta, tb = near.tension
        fa, fb = far.tension
        slid_a, slid_b = x[u] - guides[0, i], x[u + 1] - guides[1, i]
        force_a = 0.0 if smooth else rig.bristle[0] * slid_a
        force_b = 0.0 if smooth else rig.bristle[1] * slid_b
        if state[0, i] != 0.0:
            force_a = state[0, i] * (constant + (ta + fa) * ratio)
        if state[1, i] != 0.0:
            force_b = state[1, i] * (constant + (tb + fb) * ratio)
        b[BAND + u] = ta - fa - force_a - drag * (x[u] - before[u])
        b[BAND + u + 1] = tb - fb - force_b - drag * (x[u + 1] - before[u + 1])
        near = far


@chain_njit(forceinline=True)
def solve_step(s: int, line: Line, moved: Moved) -> float:
    """Find how far a moved rig is from the rig; return the largest difference of a joint's angle, rad."""
    b, change, outside = moved.residual, moved.change, line.outside[s]
    size = change.size
    if outside:
        for row in range(3, size - 3, 3):  # see by_headings
            b[BAND + row] -= b[BAND + row + 3]
    substitute(line.factors[s], b)
    for i in range(size):
        change[i] = -b[BAND + i]
    if line.stop[s] > 0.0:  # see newton
        lever, behind, by_change, by_z = line.lever[s], line.behind[s], 0.0, 0.0
        for i in range(size):
            by_change += lever[i] * change[i]
            by_z += lever[i] * behind[i]
        scale = line.stop[s] * by_change / (1.0 + line.stop[s] * by_z)
        for i in range(size):
            change[i] -= scale * behind[i]
    if outside:
        for i in range(size - 3, 3, -3):
            change[i] -= change[i - 3]
    most = 0.0
    for i in range(3, size, 3):
        most = max(most, abs(change[i]))
    return most


@chain_njit(forceinline=True)
def pull_along(s: int, line: Line, moved: Moved) -> None:
    """Change the tensions of a moved rig by its difference from the rig."""
    change, spans, tension, taut = moved.change, moved.spans, moved.tension, line.taut[s]
    tension[0, 0], tension[1, 0] = spans[0, 0], spans[0, 1]
    if taut[0] & ONLY_A:
        tension[0, 0] -= spans[0, 2] * change[1]
    if taut[0] & ONLY_B:
        tension[1, 0] -= spans[0, 3] * change[2]
    for i in range(1, taut.size):
        u = 3 * i - 2
        a, b, bent = change[u] - change[u + 3], change[u + 1] - change[u + 4], change[u + 2]
        tension[0, i], tension[1, i] = spans[i, 0], spans[i, 1]
        if taut[i] & ONLY_A:
            tension[0, i] += spans[i, 2] * a + spans[i, 6] * b + spans[i, 4] * bent
        if taut[i] & ONLY_B:
            tension[1, i] += spans[i, 3] * b + spans[i, 6] * a + spans[i, 5] * bent


@chain_njit(forceinline=True)
def take_up(s: int, line: Line, rig: Parameters, memory: Memory, load: Load, rate: float, moved: Moved) -> None:
    """Move the rest points of what slips in the rig, as :func:`fem_models.chain.follow.accept` does.

    The force of a guide that slides is what its tensions differ by.
    """
    x, change, before, state = line.tape.x[s], moved.change, moved.x, line.tape.state[s]
    tension, guides, slips = moved.tension, memory.guides, line.slips[s]
    for i in range(guides.shape[1]):
        smooth = without_friction(rig, i)
        for side in range(2):
            at = 3 * i + 1 + side
            now = x[at] + change[at]
            if smooth:
                guides[side, i] = now
            elif state[side, i] != 0.0:
                drag = rate * rig.drag_sheath * (now - before[at]) if i == 0 else 0.0
                force = tension[side, i] - tension[side, i + 1] - drag
                guides[side, i] = now - force / rig.bristle[side]
    jenkins = memory.jenkins
    for j in range(memory.slip_moment.size):
        slid = load.loop_scale * memory.slip_moment[j] / memory.jenkins_stiffness[j]
        for i in range(jenkins.shape[1]):
            if slips[j, i] != 0.0:
                jenkins[j, i] = x[3 * i + 3] + change[3 * i + 3] - slips[j, i] * slid
    for j in range(memory.flag_stiffness.size):
        flag, rest, on = flag_element(j, memory), memory.flags[j], line.branch[s, j]
        for i in range(rest.size):
            bent = x[3 * i + 3] + change[3 * i + 3] - load.rest_angle
            rest[i] = bent - flag_along(on[i], bent, rest[i], flag)[0] / flag.stiffness


@chain_njit()
def bend_along(s: int, line: Line, rig: Parameters, memory: Memory, rate: float, work: Work, moved: Moved) -> None:
    """Move the sections of a moved rig by its difference from the rig, and let fibres transform."""
    change = moved.change
    for i in range(memory.fibres.shape[0]):
        u = 3 * i + 1
        v, bent, row = u + 3, change[u + 2], work.sections[i]
        own = joint_at(rig, i)
        lever = crossing_at(line.half_sine[s, i], line.half_cosine[s, i], own).lever
        before = row[BENT], row[LONGER]
        bend_on(row, bent, (change[u] - change[v] - lever[0] * bent, change[u + 1] - change[v + 1] - lever[1] * bent))
        moved.longer[i] = row[LONGER]
        transform(i, row[BENT], row[LONGER], own, memory, rate)
        row[BENT], row[LONGER] = before  # of the rig's own place, where the next step starts


@chain_njit(allocates=True)
def moved_at_rest(joints: int) -> Moved:
    """Arrays for a moved rig."""
    size = 3 * joints + 3
    return Moved(
        x=np.zeros(size),
        residual=np.zeros(size + 2 * BAND),
        change=np.zeros(size),
        tension=np.zeros((2, joints + 1)),
        spans=np.zeros((joints + 1, 7)),
        crept=np.zeros(2),
        longer=np.zeros(joints),
    )


@chain_njit(nogil=True, error_model="python", allocates=True)
def follow_moved(line: Line, path: Path, rig: Parameters, memory: Memory, run: Run) -> float:
    """Take a moved rig along the steps of a rig, and fill angles and tensions.

    Returns the largest difference of a joint's angle from the rig's, rad.
    """
    tape, joints = line.tape, memory.guides.shape[1]
    moved, work = moved_at_rest(joints), work_space(rig, joints)
    here = at = load = at_rest(rig.rest)
    goal, most = here, 0.0
    copy(tape.x[0], moved.x)
    for s in range(tape.part.size):
        k, part, rate = tape.sample[s], tape.part[s], 0.0
        if s > 0:
            if k != tape.sample[s - 1]:
                here, goal = goal, load_at(k, path, moved.crept)
            load = between(here, goal, part) if part < 1.0 else goal
            rate = 1.0 / (load.time - at.time) if load.time > at.time else 0.0
        imbalance(s, line, rig, memory, load, rate, work, moved)
        difference = solve_step(s, line, moved)
        if not difference < math.inf:
            return math.inf
        most = max(most, difference)
        pull_along(s, line, moved)
        take_up(s, line, rig, memory, load, rate, moved)
        if memory.fibre_area.size > 0:
            bend_along(s, line, rig, memory, rate, work, moved)
        for i in range(moved.x.size):
            moved.x[i] = tape.x[s, i] + moved.change[i]
        work.guess[0], work.guess[1] = moved.tension[0, 0], moved.tension[1, 0]
        at = load
        if s > 0 and part == 1.0:
            if k + 1 < path.creep.size:
                creep_on(path.creep[k + 1], rig, moved.tension, moved.crept)
            for i in range(joints):
                run.angles[k, i] = moved.x[3 * i + 3]
            copy_rows(moved.tension, run.tensions[k])
            copy(moved.longer[: run.longer.shape[1]], run.longer[k])
            for i in range(run.warming.shape[1]):
                run.warming[k, i] = memory.fibres[i, -1]
    return most

"""Where no equilibrium is near, the wrist relaxes in pseudo-time to the next one, as the chain in space does.

See :mod:`fem_models.chain.jump` for the method. Here viscous forces are in the flexures and in the guides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fem_models.multibody.spatial.equilibrium import Attempt, Drive

if TYPE_CHECKING:
    from fem_models.multibody.spatial.stepper import Stepper

FIRST, LARGEST, LEAST = 1e-2, 1e10, 1e-10
"""Lengths of pseudo steps, over that in which a joint relaxes: of the first one, and where they end."""
LONGER, SHORTER = 2.0, 0.25
"""Most and least factors on the length of a pseudo step from one to the next."""
BOLD, AIM = 5.0, 0.8
"""Most that a pseudo step moves the wrist, over what a step of no length may, and the part of it that is aimed at."""
MOST_STEPS = 2000


def relax(stepper: Stepper, load: Drive) -> bool:
    """Move the wrist to the next equilibrium under a load, step by step; return whether there is one."""
    solver, length = stepper.solver, FIRST
    viscosity = stepper.settings.viscosity * min(joint.stiffness.weak for joint in stepper.rig.joints)
    rotation, slip = stepper.strains(stepper.now.q).rotation, stepper.slips(stepper.now.q)
    lag, attempt = (0.0 * rotation, 0.0 * slip), Attempt(stepper.settings.newton_iterations)
    try:
        for _ in range(MOST_STEPS):
            slow = viscosity / length
            solver.resist(slow, rotation, slip)
            found = solver.find(stepper.now.q, load, stepper.now.state, attempt)
            stepper.counts.iterations += solver.iterations
            if found is not None:
                turned, slid = stepper.strains(found.q).rotation - rotation, stepper.slips(found.q) - slip
                far = max(
                    float(np.linalg.norm(turned, axis=1).max()) / (BOLD * stepper.control.least_rotation),
                    float(np.abs(slid).max()) / (BOLD * stepper.control.least_slide),
                )
            if found is None or far > 1.0:
                length *= SHORTER if found is None else max(SHORTER, AIM / far)
                if length < LEAST:
                    return False
                continue
            now = slow * turned, solver.drag * slid
            for last, force, moved in zip(lag, now, (turned, slid), strict=True):
                stepper.energies.jump += float((0.5 * (last + force) * moved).sum())
            lag, rotation, slip = now, rotation + turned, slip + slid
            stepper.accept(found, load)
            largest = max(float(np.abs(now[0]).max()) / solver.arm, float(np.abs(now[1]).max()))
            if largest <= solver.tolerance or length >= LARGEST:
                return True
            length *= min(LONGER, AIM / max(far, AIM / LONGER))
        return False
    finally:
        solver.resist(0.0, rotation, slip)

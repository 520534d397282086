"""A branch of the Bouc-Wen law by the hypergeometric function: an independent check of its kernel."""

import math
from dataclasses import replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import hyp2f1

from hysteresis.laws.bouc_wen import BoucWen, hysteresis


def branch_closed_form(h0_deg: float, f0_deg: float, f1_deg: float, model: BoucWen) -> float:
    """Compute the exact h at the end of a monotonic branch by the hypergeometric function; slow, an independent check.

    The path between two states of one sign is the integral of dt / (1 - g t^n) = t 2F1(1, 1/n; 1 + 1/n; g t^n),
    which is solved for its upper limit.

    Parameters
    ----------
    h0_deg
        State at the start, within the saturation; ``model.h0_deg`` is not used.
    f0_deg, f1_deg
        Ends of the branch.
    model
        Admissible parameters.

    Returns
    -------
    float
        h in deg at ``f1_deg``.
    """
    hysteresis([f0_deg], replace(model, h0_deg=h0_deg))  # raises if not admissible
    if f1_deg == f0_deg or model.A == 0:
        return h0_deg
    n, scale = model.n, math.copysign(model.saturation_deg, model.A)
    kappa = (model.beta - model.gamma) / (model.beta + model.gamma)
    direction = math.copysign(1.0, f1_deg - f0_deg)

    def path_from_zero(y: float) -> float:
        g = 1.0 if y >= 0 else -kappa
        return y * float(hyp2f1(1.0, 1 / n, 1 + 1 / n, g * abs(y) ** n))

    start = direction * h0_deg / scale
    highest = 1 - 1e-15
    if start >= highest:
        return direction * scale
    end = path_from_zero(start) + abs(f1_deg - f0_deg) * abs(model.A / scale)
    if end >= path_from_zero(highest):
        return direction * scale
    y = brentq(lambda y: path_from_zero(y) - end, start, highest, xtol=1e-15, rtol=4 * np.finfo(float).eps)
    return direction * scale * float(y)

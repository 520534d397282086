"""What the page says beside the numbers: limits that are passed, and what to do where there is no answer."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from fem_models.chain.solve import ChainSolution
from fem_models.joint.strain import limits_passed, strain_limits
from fem_models.rig import Rig
from hysteresis.arrays import Floats

NO_EQUILIBRIUM = re.compile(r"no equilibrium between drives (\S+|\([^()]*\)) and")
CLOSES = re.compile(r"joint (\d+) at (\S+) deg, but its notch closes at (\S+) deg")
SLACK_N = 1e-6
LESS = {"amplitude_mm": "a smaller amplitude", "notch.depth_mm": "a less deep notch", "preload_N": "a lower preload"}
MORE = {"notch.width_mm": "a wider notch"}
"""What helps, by the slider: to be moved down, or up."""


def warnings_of(rig: Rig, solution: ChainSolution) -> list[str]:
    """Say of a run of the chain what :func:`warnings_of_run` says."""
    # the only tendon of a rig may rest: its flexures spring back
    tensions = solution.segment_tensions_N if rig.tendon_b is not None else None
    return warnings_of_run(rig, solution.record.drive, solution.peak_strain, tensions)


def warnings_of_run(rig: Rig, drive: Floats, strain: Floats, tensions_N: Floats | None) -> list[str]:
    """Say which strain limits of Nitinol are passed, and which tendons go slack, with the drive where that starts.

    Shapes (m,), (m, N), and (m, tendons, pieces); None where no tendon is meant to be taut.
    """
    out = list[str]()
    if np.isfinite(strain).all():
        for passed in limits_passed(drive, strain, strain_limits(rig)):
            if passed.drive is None:
                continue
            limit, kind = (
                passed.limit,
                "half the range of the strain" if passed.limit.kind == "alternating" else "strain",
            )
            out.append(
                f"{limit.name[0].upper()}{limit.name[1:]}: {kind} above {100 * limit.strain:.2g} % from "
                f"{abs(passed.drive):.2f} mm on, at joint {passed.joint}; at most {100 * passed.largest:.2f} %"
            )
    least = np.empty((0, 0)) if tensions_N is None else tensions_N.min(axis=2)
    for side, tension in zip("abcd", least.T, strict=False):
        if (at := _first(tension <= SLACK_N)) is not None:
            out.append(
                f"Tendon {side} goes slack, first at a drive of {drive[at]:.2f} mm: a higher preload keeps it taut"
            )
    return out


def _first(where: NDArray[np.bool_]) -> int | None:
    found = np.flatnonzero(where)
    return int(found[0]) if found.size else None


def in_words(error: Exception, values: Mapping[str, float], start: Mapping[str, float]) -> str:
    """Say why there is no answer and what to move, above all what was moved the wrong way.

    ``values`` are those of the sliders by dotted name, ``start`` those of the rig.
    """
    words = " ".join(str(error).split())
    if found := NO_EQUILIBRIUM.search(words):
        reached = max(abs(float(one)) for one in found[1].strip("()").split(", "))
        where = f"The tube finds no resting shape beyond a drive of {reached:.2g} mm: it snaps, or buckles."
    elif found := CLOSES.search(words):
        where = f"The notch of joint {found[1]} is closed at {found[3]} deg, before the full drive."
    else:
        return f"These values are not possible: {words}."
    moved = [words for name, words in LESS.items() if name in values and values[name] > start[name]]
    moved += [words for name, words in MORE.items() if name in values and values[name] < start[name]]
    return f"{where} Try {' or '.join(moved or LESS.values())}. The picture is that of the last values with an answer."

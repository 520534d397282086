"""The files of a compensator: source, header and test vector in C, and the tables of its branches."""

from __future__ import annotations

import math
import re
from importlib.resources import files
from pathlib import Path
from string import Template

import numpy as np

from hysteresis.arrays import Floats
from hysteresis.files import RecordError
from hysteresis.fitting.recursive import CLIPPED, WIDER, RecursionSettings, settings_for
from studies.firmware.about import about, package_version
from studies.firmware.branches import branches
from studies.firmware.laws import LawInC, law_in_c, listed, number
from studies.firmware.read import Compensator
from studies.firmware.vector import made_vector

THOUSANDTHS = {"mm": "um", "deg": "mdeg", "step": "mstep", "N": "mN"}
"""Names of the thousandth parts of the units of a drive, for tables of whole numbers."""


def compensator_files(compensator: Compensator, out: Path, *, seed: int = 0) -> dict[Path, str]:
    """Give source, header and test vector by their paths in a folder.

    Raises
    ------
    RecordError
        A constant that is not finite.
    """
    start = float(compensator.layer.f(np.array([compensator.layer.first_drive]))[0])
    try:
        law = law_in_c(compensator.layer.elements, start)
        values = _values(compensator, law)
    except ValueError as error:
        raise RecordError(f"{compensator.layer.source}: {error}") from None
    names = ("head.c", *law.templates, "curve.c", "inverse.c", "calls.c", "reidentify.c", "replay.c")
    texts = {
        f"{compensator.name}.c": "".join(filled(name, values) for name in names),
        f"{compensator.name}.h": filled("compensator.h", values),
        f"{compensator.name}_test.csv": _vector(compensator, seed),
    }
    return {out / name: text for name, text in texts.items()}


def table_files(compensator: Compensator, out: Path) -> dict[Path, str]:
    """Give the table of the branches by its path in a folder."""
    found, unit = branches(compensator.layer), compensator.unit
    small = THOUSANDTHS[unit]
    columns = {
        "angle_deg": found.angle_deg,
        f"rising_{unit}": found.rising,
        f"falling_{unit}": found.falling,
        "angle_mdeg": np.rint(1000 * found.angle_deg).astype(int),
        f"rising_{small}": np.rint(1000 * found.rising).astype(int),
        f"falling_{small}": np.rint(1000 * found.falling).astype(int),
    }
    return {out / f"{compensator.name}_table.csv": _csv(columns)}


def _csv(columns: dict[str, Floats]) -> str:
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n"


def _vector(compensator: Compensator, seed: int) -> str:
    reference, drive = made_vector(compensator.layer, seed=seed)
    return _csv({"reference_deg": reference, f"drive_{compensator.unit}": drive})


def filled(template: str, values: dict[str, str]) -> str:
    """Fill a template of the folder ``c``, and put the name in place of ``notchbend_``."""
    text = (files("studies.firmware") / "c" / template).read_text(encoding="utf-8")
    name = values["name"]
    own = re.sub("notchbend_|NOTCHBEND_", lambda found: f"{name if found[0].islower() else name.upper()}_", text)
    return Template(own).substitute(values)


def _values(compensator: Compensator, law: LawInC) -> dict[str, str]:
    reals = 7 + law.memory.size
    values = {
        "name": compensator.name,
        "version": package_version(),
        "about": about(compensator),
        "unit": compensator.unit,
        "delay": f"{compensator.layer.delay_s:.6g}",
        "libm": _libm((*law.functions, "sqrt")),
        "reals": str(reals),
        "state_double": str(8 * reals + 8),
        "state_float": str(4 * reals + 4),
        "stack": str(law.stack_bytes),
        "memory": str(law.memory.size),
        "memory_words": law.remembers,
        "places_of_f": str(compensator.drive.size),
        "drive": listed(compensator.drive),
        "angle": listed(compensator.angle_deg),
        "slope": listed(compensator.slope),
        "saturation": number(compensator.saturation_deg)[2:-1],
        "smooth": number(law.smooth_deg)[2:-1],
        "start": listed(law.memory),
        **_recursion_values(recursion_settings(compensator)),
        "first_drive": number(compensator.layer.first_drive)[2:-1],
    } | law.values
    if "places" in law.values and law.functions:
        values["width_function"] = filled("width.c", values)
    values.setdefault("width_function", "")
    values["constants"] = str(sum(text.count("R(") for name, text in values.items() if name != "places"))
    return values


def recursion_settings(compensator: Compensator) -> RecursionSettings:
    """Choose the constants of re-identification: noise of the held-out error, scales and bounds of the fit's size."""
    fit, layer = compensator.fit, compensator.layer
    return settings_for(float(np.ptp(compensator.angle_deg)), max(fit.noise_floor_deg, layer.heldout_rmse_deg))


def _recursion_values(settings: RecursionSettings) -> dict[str, str]:
    def row(values: tuple[float, ...]) -> str:
        return ", ".join(map(number, values))

    outside = settings.outside * settings.noise_deg
    return {
        "wider": repr(WIDER),
        "clipped": repr(CLIPPED),
        "noise": repr(settings.noise_deg),
        "spacing": repr(settings.spacing_deg),
        "spacing_words": f"{settings.spacing_deg:.3g}",
        "outside_words": f"{outside:.3g}",
        "outside_square": repr(outside**2),
        "forgetting": repr(settings.forgetting),
        "alike": repr(settings.alike),
        "of_one": repr(settings.noise_deg * math.sqrt(settings.alike)),
        "scale": row(settings.scale),
        "lowest": row(settings.lowest),
        "highest": row(settings.highest),
    }


def _libm(functions: tuple[str, ...]) -> str:
    """Say which functions of the library are called."""
    singles = ", ".join(f"{name}f" for name in functions)
    return f"of the library only {', '.join(functions)} ({singles} for float) of math.h"

"""The preset du2018 of 0.1.0 (docs/validation/calibration.md): its paper's widths as full widths, a sheath of 1.4 N.

For tests of what weak friction leaves to see, and for cases of sets that were drawn about it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from fem_models.rig import Rig, preset
from fem_models.rig.presets import PRESETS
from hysteresis.records.sidecar import toml


def full_widths(preload_N: float = 20.0) -> Rig:
    """Loops of 3.51 and 2.20 deg at 10 and 20 N; the preset has 7.04 and 4.42 deg."""
    rig = preset("du2018", preload_N=preload_N)
    tendon = replace(rig.tendon_a, moment_arm_mm=2.64, toe_N=40.0)
    return replace(
        rig,
        tendon_a=tendon,
        tendon_b=tendon,
        friction=replace(rig.friction, sheath_N=1.39),
        material=replace(rig.material, loop_angle_deg=2.2),
    )


def full_widths_table(folder: Path, preload_N: float = 20.0) -> dict[str, str | float]:
    """Write the rig into a folder, and give the ``[rig]`` table of a record of it."""
    path = folder / "full-widths.toml"
    path.write_text(toml(full_widths().to_dict()))
    return {"file": str(path), "preload_N": preload_N}


@contextmanager
def preset_of_full_widths() -> Iterator[None]:
    """Give the rig the name of the preset, so that practice cases of sets before it are drawn and read as they were."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(PRESETS, "du2018", replace(PRESETS["du2018"], rig=full_widths()))
        yield

"""The rig: tube and notches or measured joints, tendons, wheel, friction, effects; presets and rig files."""

from fem_models.rig.checks import RigError
from fem_models.rig.ensemble import ensemble
from fem_models.rig.presets import preset
from fem_models.rig.rig import Rig
from fem_models.rig.rig_file import read_rig

__all__ = ["Rig", "RigError", "ensemble", "preset", "read_rig"]

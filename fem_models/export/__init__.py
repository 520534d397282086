"""A rig for other simulators: MuJoCo's MJCF, and a table of tensions by which others can test their friction."""

from fem_models.export.guides import guide_table
from fem_models.export.mujoco import mujoco_model

__all__ = ["guide_table", "mujoco_model"]

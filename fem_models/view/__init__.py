"""Pictures and meshes of the bent manipulator and of one notch as a solid."""

from fem_models.view.manipulator import SceneError, render

__all__ = ["SceneError", "render"]

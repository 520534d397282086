"""The manipulator as an Exudyn flexible multibody system, quasi-static and in time; importing it loads Exudyn."""

from fem_models.multibody.dynamic import solve_dynamic
from fem_models.multibody.quasi_static import simulate_multibody, solve_multibody
from fem_models.multibody.stepper import MultibodySettings

__all__ = ["MultibodySettings", "simulate_multibody", "solve_dynamic", "solve_multibody"]

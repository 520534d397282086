"""The analytic model: kinematics and static equilibrium in closed form, without friction and without hysteresis."""

from fem_models.analytic.kinematics import simulate_analytic, theory_curve

__all__ = ["simulate_analytic", "theory_curve"]

"""Agreement of the engines: the analytic curve and the compiled chain against the multibody model."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace

import numpy as np

from fem_models.analytic import theory_curve
from fem_models.analytic.kinematics import tip_pose
from fem_models.chain import simulate_chain
from fem_models.joint import joint_row
from fem_models.joint.flexure import beam, flexure
from fem_models.joint.paper_elements import element_rotations
from fem_models.load import triangle
from fem_models.multibody import simulate_multibody
from fem_models.rig import Rig
from fem_models.rig.joints import NotchedTube
from fem_models.rig.rig import Friction, with_joint
from hysteresis.records.metrics import errors


@dataclass(frozen=True)
class EngineAgreement:
    """Differences between the engines for one rig.

    Parameters
    ----------
    bending_stiffness_Nmm_per_rad, element_error_percent
        Of one joint; where notches differ, of the one that tendon a turns most. The error is that of the rotation by
        the paper's two elements an arc, against the closed form.
    frictionless_max_deg, frictionless_rmse_deg, frictionless_tension_max_N, tip_pose_max_mm
        Analytic curve against the multibody model without friction and material loop.
    chain_max_deg
        Compiled chain against the multibody model, with friction and material loop.
    friction_shift_rmse_deg
        Analytic curve against the full multibody model: the hysteresis that the analytic model lacks.
    """

    rig: str
    preload_N: float
    amplitude_mm: float
    bending_stiffness_Nmm_per_rad: float
    element_error_percent: float
    full_scale_analytic_deg: float
    full_scale_frictionless_deg: float
    full_scale_deg: float
    frictionless_max_deg: float
    frictionless_rmse_deg: float
    frictionless_tension_max_N: float
    tip_pose_max_mm: float
    chain_max_deg: float
    friction_shift_rmse_deg: float

    def to_dict(self) -> dict[str, str | float]:
        """Values by name, as in ``validate.json``."""
        return asdict(self)


def compare_engines(rig: Rig, *, amplitude_mm: float = 2.2, step_mm: float = 0.1) -> EngineAgreement:
    """Compare the engines over one cycle of the paper's static program.

    Raises
    ------
    SolverError, RigError
        From the engines.
    """
    program = triangle(amplitude_mm, step_mm=step_mm)
    lossless = replace(rig, friction=Friction(), material=replace(rig.material, loop_share=0.0))
    ideal, full = simulate_multibody(lossless, program), simulate_multibody(rig, program)
    theory, tension_a, tension_b = theory_curve(lossless, program.drive_mm)
    assert ideal.notches_deg is not None
    assert ideal.tip_mm is not None
    assert ideal.tension_a_N is not None
    assert ideal.tension_b_N is not None
    x, y, _ = tip_pose(rig, np.radians(ideal.notches_deg))
    row = joint_row(rig)
    one = with_joint(rig, row.each.index(row.softest))
    joint = flexure(one)
    moment_Nmm = 1.0
    notched = isinstance(rig.joint, NotchedTube)
    exact = moment_Nmm / (beam(one) if notched else joint).bending_Nmm_per_rad
    element = element_rotations(one, moment_Nmm).theta_kd_rad if notched else exact
    against = errors(theory, ideal.angle_deg)
    return EngineAgreement(
        rig=rig.name,
        preload_N=rig.preload_N,
        amplitude_mm=amplitude_mm,
        bending_stiffness_Nmm_per_rad=joint.bending_Nmm_per_rad,
        element_error_percent=100 * (element / exact - 1),
        full_scale_analytic_deg=float(np.abs(theory).max()),
        full_scale_frictionless_deg=float(np.abs(ideal.angle_deg).max()),
        full_scale_deg=float(np.abs(full.angle_deg).max()),
        frictionless_max_deg=against.max_abs_deg,
        frictionless_rmse_deg=against.rmse_deg,
        frictionless_tension_max_N=float(
            max(np.abs(ideal.tension_a_N - tension_a).max(), np.abs(ideal.tension_b_N - tension_b).max())
        ),
        chain_max_deg=float(np.abs(simulate_chain(rig, program).angle_deg - full.angle_deg).max()),
        tip_pose_max_mm=float(np.hypot(x - ideal.tip_mm[:, 0], y - ideal.tip_mm[:, 1]).max()),
        friction_shift_rmse_deg=errors(theory_curve(rig, program.drive_mm).angle_deg, full.angle_deg).rmse_deg,
    )

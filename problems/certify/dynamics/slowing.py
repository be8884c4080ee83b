"""How slowly a finished motion has to be run so that its torques keep their limits for all t."""

from __future__ import annotations

import numpy as np

from problems.certify.dynamics.moving_arm import MovingArm
from problems.certify.dynamics.time_cells import Moments
from problems.certify.dynamics.torque import prove_torques
from problems.certify.verdict import TOLERANCE, CertificateStatus
from problems.limits.torque import TorqueLimit
from problems.motions.trajectory import Trajectory

LEAST_ROOM = 1e-6  # of a limit: what gravity and friction have to leave of it at least
FIRST_TIMES = 201
MAX_ROUNDS = 12
FIRST_STEP = 1e-7  # relative: what is added where no time is seen to be broken and nothing is proven


def torque_time_scale(limit: TorqueLimit, trajectory: Trajectory) -> float:
    """The least factor by which time has to be multiplied so that the limit is proven for all t, to 1e-7 or so.

    What each of many times needs is known in closed form. The proof of the motion that is slowed by the largest factor
    finds times at which it is still broken; what these need joins in, until nothing is broken.

    Returns:
        The factor; 0 where any will do, and where none does: the motors cannot hold the arm at some time.
    """
    arm = MovingArm(limit, trajectory)
    scale, step = _scale_at(arm, arm.first_moments(FIRST_TIMES)) if trajectory.is_finite else 0.0, FIRST_STEP
    if scale in (0.0, np.inf):
        return 0.0
    for _ in range(MAX_ROUNDS):
        proof = prove_torques(limit, trajectory.time_scaled(scale), TOLERANCE / 2.0)
        if proof.status is CertificateStatus.CERTIFIED:
            break
        needed = _scale_at(arm, Moments(trajectory, proof.broken.pieces, proof.broken.offsets / scale))
        if np.isinf(needed):
            return 0.0
        if needed <= scale * (1.0 + step):
            needed, step = max(needed, scale) * (1.0 + step), 10.0 * step
        scale = needed
    return scale


def _scale_at(arm: MovingArm, moments: Moments) -> float:
    """The largest factor that a time needs; infinite where the motors can hardly hold the arm."""
    held = arm.holds(moments, LEAST_ROOM).all()
    return float(arm.time_scales(moments).max(initial=0.0)) if held else np.inf

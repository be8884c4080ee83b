"""Limits as TOPP-RA wants them."""

from __future__ import annotations

import casadi as ca
import numpy as np
from toppra.constraint import (
    DiscretizationType,
    JointAccelerationConstraint,
    JointTorqueConstraint,
    JointVelocityConstraint,
)

from problems import Robot
from problems.base import FloatArray, as_array
from problems.robots import JointLimits


def speed_and_acceleration(limits: JointLimits) -> list[JointVelocityConstraint | JointAccelerationConstraint]:
    """Of joints."""
    return [
        kind(np.multiply.outer(bound, [-1.0, 1.0]))
        for kind, bound in (
            (JointVelocityConstraint, limits.speed),
            (JointAccelerationConstraint, limits.acceleration),
        )
    ]


def torque(robot: Robot) -> JointTorqueConstraint:
    """Of a robot whose masses are known; Coulomb friction included, of viscous friction TOPP-RA knows nothing."""
    chain, state = robot.dynamics, [ca.SX.sym(name, 1, robot.dof) for name in ("q", "v", "a")]
    dynamics = ca.Function("torques", state, [chain.inertial(*state) + chain.gravitational(state[0])])

    def inverse_dynamics(theta: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        return np.asarray(dynamics(theta, speed, acceleration).full()[0])

    bounds = np.multiply.outer(np.array(robot.limits.torque), [-1.0, 1.0])
    friction, scheme = as_array(chain.coulomb(ca.DM.ones(1, robot.dof)))[0], DiscretizationType.Interpolation
    return JointTorqueConstraint(inverse_dynamics, bounds, friction, discretization_scheme=scheme)

"""What it takes to hold a robot where it is."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, as_array
from problems.robots.spatial.spatial_arm import SpatialArm

POSTURES = 10_000
ROUNDING = 1e-9  # N m
SEED = 17  # of the postures: a robot has the same figures every time


def most_held(arm: SpatialArm) -> FloatArray | None:
    """The largest torque that holds each joint at random postures within the limits, (dof,), N m or N.

    None where masses are not known. The largest of all postures is a little more.
    """
    chain, ranges = arm.rigid_chain, arm.position_limits
    if chain is None or ranges is None:
        return None
    low, high = np.array(ranges).T
    postures = np.random.default_rng(SEED).uniform(low, high, (POSTURES, arm.dof))
    held = np.abs(as_array(chain.gravitational(ca.DM(postures)))).max(axis=0)
    return np.where(held < ROUNDING, 0.0, held)

"""How far what a chain carries can be from the axes of its joints."""

from __future__ import annotations

import numpy as np

from problems.base.matrix import FloatArray
from problems.robots.spatial.chain import Chain
from problems.robots.spatial.collision.sphere import Sphere


def levers_of(chain: Chain, sphere: Sphere) -> FloatArray:
    """How far a sphere's centre can be from each joint's axis, (dof,), m; 1 for a joint that slides."""
    levers, joints, offsets = np.zeros(len(chain.joints)), chain.joints, chain.offsets
    beyond = float(np.linalg.norm(sphere.center))
    nearest = np.array(sphere.center, dtype=float)
    travel = 0.0
    for number in range(sphere.link - 1, -1, -1):
        joint, axis = joints[number], np.array(joints[number].axis)
        across = float(np.linalg.norm(nearest - axis * (axis @ nearest))) + travel
        farther = beyond - float(np.linalg.norm(nearest)) - travel
        levers[number] = across + farther if joint.turns else 1.0
        nearest, travel = np.array(joint.translation, dtype=float), joint.travel
        beyond += float(offsets[number])
    return levers

"""Masses of a chain, regrouped: other bodies that take the same torques in every motion, and fewer operations.

What a joint does not move against the body before it may as well belong to that body: where it turns, masses on its
axis; where it slides, second moments, which do not depend on where a body is. Afterwards a body that turns has no
mass, nothing along its axis, and no second moment of the axis alone. No such body need exist: torques are linear in
the masses.

[1] W. Khalil, J.-F. Kleinfinger: Minimum operations and minimum parameters of the dynamic models of tree structure
    robots. IEEE Journal of Robotics and Automation 3 (1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from problems.base.matrix import FloatArray
from problems.robots.rigid.inertia import Moments
from problems.robots.rigid.rigid_chain import RigidJoint
from problems.robots.rigid.transform import Transform

_Numbers = tuple[float, FloatArray, FloatArray]  # mass, first (3,) and second moments (3, 3)


def regrouped(joints: Sequence[RigidJoint]) -> list[RigidJoint]:
    """Joints that take the same torques, the first on a base that stands still.

    Args:
        joints: from the base on, their moments plain numbers.
    """
    result: list[RigidJoint] = []
    passed: _Numbers = (0.0, np.zeros(3), np.zeros((3, 3)))
    for joint in reversed(joints):
        moments = joint.moments
        own = (float(moments.mass), np.array(moments.first, dtype=float), np.array(moments.second, dtype=float))
        whole = _sum(own, passed)
        still = _unmoved(joint, whole)
        result.insert(0, replace(joint, moments=_moments(_sum(whole, still, -1.0))))
        passed = _seen_from(joint.pose, still)
    return result


def _unmoved(joint: RigidJoint, whole: _Numbers) -> _Numbers:
    """The part of a body's moments that the joint's motion does not change as seen from the body before."""
    mass, first, second = whole
    axis = np.array(joint.axis)
    if not joint.turns:
        return 0.0, np.zeros(3), second
    return mass, axis * (axis @ first), np.outer(axis, axis) * (axis @ second @ axis)


def _seen_from(pose: Transform, moments: _Numbers) -> _Numbers:
    """The same masses about the origin of the frame in which theirs has a pose."""
    mass, first, second = moments
    turn, place = np.array(pose.rotation, dtype=float), np.array(pose.translation, dtype=float)
    turned = turn @ first
    lever = np.outer(turned, place)
    return mass, turned + mass * place, turn @ second @ turn.T + lever + lever.T + mass * np.outer(place, place)


def _sum(one: _Numbers, two: _Numbers, factor: float = 1.0) -> _Numbers:
    return one[0] + factor * two[0], one[1] + factor * two[1], one[2] + factor * two[2]


def _moments(numbers: _Numbers) -> Moments:
    mass, first, second = numbers
    x, y, z = first.tolist()
    one, two, three = (tuple(row) for row in second.tolist())
    return Moments(mass, (x, y, z), (one, two, three))

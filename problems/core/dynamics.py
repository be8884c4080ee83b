"""Torques of an arm in the compiled core, for many states at once, and their derivatives."""

from __future__ import annotations

import ctypes
import weakref
from functools import lru_cache

import numpy as np

from problems.base import CACHE_SIZE, FloatArray
from problems.core.library import loaded_core
from problems.robots import RigidChain, RigidJoint, Robot, SpatialArm

STATE = 3  # angles, velocities, accelerations


class Dynamics:
    """The equations of motion of a chain whose numbers are known.

    Args:
        library: the compiled core.
        chain: of joints and bodies.
    """

    def __init__(self, library: ctypes.CDLL, chain: RigidChain) -> None:
        self._library, self.dof = library, len(chain.joints)
        counts = np.array([self.dof, *(int(joint.turns) for joint in chain.joints)], dtype=np.int64)
        numbers = np.array([*chain.gravity, *(part for joint in chain.joints for part in _numbers(joint))], dtype=float)
        self._chain = ctypes.c_void_p(library.core_chain(counts.ctypes.data, numbers.ctypes.data))
        self.damping = np.array([joint.damping for joint in chain.joints], dtype=float)
        self.friction = np.array([joint.friction for joint in chain.joints], dtype=float)
        weakref.finalize(self, library.core_forget_chain, self._chain)

    @classmethod
    def of(cls, robot: Robot) -> Dynamics | None:
        """The dynamics of a robot, where the core is there and knows it, and masses are known."""
        return _known(robot) if type(robot) is SpatialArm else None

    def torques(self, states: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Torques of inertia, and of gravity, without friction: (n, k) each, N m or N.

        Args:
            states: angles, velocities and accelerations, (n, 3 k).
        """
        states = np.ascontiguousarray(states, dtype=np.float64)
        inertial, held = np.empty((len(states), self.dof)), np.empty((len(states), self.dof))
        self._library.core_torques(self._chain, len(states), states.ctypes.data, inertial.ctypes.data, held.ctypes.data)
        return inertial, held

    def slopes(self, states: FloatArray) -> FloatArray:
        """Derivatives of both together, and of viscous friction, by the states (n, 3 k): (n, k, 3, k)."""
        states = np.ascontiguousarray(states, dtype=np.float64)
        found = np.empty((len(states), self.dof, STATE, self.dof))
        self._library.core_torque_slopes(self._chain, len(states), states.ctypes.data, found.ctypes.data)
        joints = np.arange(self.dof)
        found[:, joints, 1, joints] += self.damping
        return found


def _numbers(joint: RigidJoint) -> list[float]:
    rotation = [part for row in joint.pose.rotation for part in row]
    moments = joint.moments
    second = [part for row in moments.second for part in row]
    parts = (*rotation, *joint.pose.translation, *joint.axis, moments.mass, *moments.first, *second)
    return [float(part) for part in parts]


@lru_cache(maxsize=CACHE_SIZE)
def _known(robot: SpatialArm) -> Dynamics | None:
    library, chain = loaded_core().library, robot.rigid_chain
    return None if library is None or chain is None else Dynamics(library, chain)

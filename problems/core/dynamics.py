"""Torques of an arm in the compiled core: for many states at once, with derivatives, and bounded for all t."""

from __future__ import annotations

import ctypes
import weakref
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from problems.base import CACHE_SIZE, FloatArray
from problems.core.motion_numbers import STATUS, MotionNumbers
from problems.library import loaded_core, needed_core
from problems.robots import RigidChain, RigidJoint, Robot, SpatialArm

STATE = 3  # angles, velocities, accelerations
MOST_BROKEN = 4_096  # moments that a proof names


class TorqueAim(NamedTuple):
    """The aim of a proof of torques.

    Attributes:
        allowed: share of the limits.
        gap: share of the largest share seen by which the proven one may be larger.
        least: share of the limits; smaller ones need not be bounded any closer.
        first_cells: of time, at least.
        most_cells: beyond those.
        step: s, before and behind the largest share that was seen within which it is followed to its peak.
    """

    allowed: float
    gap: float
    least: float
    first_cells: int
    most_cells: int
    step: float


class TorqueAnswer(NamedTuple):
    """The answer to whether torques keep their limits at every time.

    Attributes:
        kept: whether they do; None where that is not known.
        piece: of the largest share of a limit that was seen.
        offset: of that from where the piece begins, s.
        broken_pieces: of moments at which a limit is broken, (n,).
        broken_offsets: likewise, (n,), s.
        cell: start and end, s, of a cell of time in which it is not known; None where there is none.
    """

    kept: bool | None
    piece: int
    offset: float
    broken_pieces: NDArray[np.intp]
    broken_offsets: FloatArray
    cell: tuple[float, float] | None


class Dynamics:
    """The equations of motion of a chain whose numbers are known.

    Args:
        library: the compiled core.
        chain: of joints and bodies.
    """

    def __init__(self, library: ctypes.CDLL, chain: RigidChain) -> None:
        self._library, self.dof = library, len(chain.joints)
        each = zip(chain.joints, chain.parents, strict=True)
        counts = np.array([self.dof, *(int(part) for joint, on in each for part in (joint.turns, on))], dtype=np.int64)
        numbers = np.array([*chain.gravity, *(part for joint in chain.joints for part in _numbers(joint))], dtype=float)
        self._chain = ctypes.c_void_p(library.core_chain(counts.ctypes.data, numbers.ctypes.data))
        self.damping = np.array([joint.damping for joint in chain.joints], dtype=float)
        self.friction = np.array([joint.friction for joint in chain.joints], dtype=float)
        weakref.finalize(self, library.core_forget_chain, self._chain)

    @classmethod
    def of(cls, robot: Robot) -> Dynamics | None:
        """The dynamics of a robot, where the core is there and knows it, and masses are known."""
        return _known(robot) if type(robot) is SpatialArm else None

    @classmethod
    def of_chain(cls, chain: RigidChain) -> Dynamics | None:
        """The dynamics of a chain in numbers, where the core is there."""
        library = loaded_core().library
        return None if library is None else cls(library, chain)

    @classmethod
    def needed(cls, robot: Robot) -> Dynamics:
        """The dynamics of a robot whose masses are known.

        Raises:
            NoCore: there is no core.
        """
        return _needed(robot)

    def settle(self, motion: MotionNumbers, limits: FloatArray, still: FloatArray, aim: TorqueAim) -> TorqueAnswer:
        """Whether torques keep their limits at every time of a motion.

        Args:
            motion: with moments that are looked at first.
            limits: (k,), N m or N.
            still: speeds up to which a joint may stand still, (k,).
            aim: of the proof.
        """
        joints = [np.ascontiguousarray(part, dtype=float) for part in (self.damping, self.friction, limits, still)]
        found, pieces, offsets = np.empty(6), np.empty(MOST_BROKEN, dtype=np.int32), np.empty(MOST_BROKEN)
        status = self._library.core_prove_torques(
            self._chain, *(part.ctypes.data for part in joints), *motion.of_motion, *aim, *motion.of_moments,
            found.ctypes.data, MOST_BROKEN, pieces.ctypes.data, offsets.ctypes.data,
        )  # fmt: skip
        _, piece, offset, start, end, count = found.tolist()
        broken = pieces[: int(count)].astype(np.intp), offsets[: int(count)]
        return TorqueAnswer(STATUS[status], int(piece), offset, *broken, (start, end) if status < 0 else None)

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
def _needed(robot: Robot) -> Dynamics:
    return Dynamics(needed_core("proofs of torques need"), robot.dynamics)


@lru_cache(maxsize=CACHE_SIZE)
def _known(robot: SpatialArm) -> Dynamics | None:
    return None if robot.rigid_chain is None else Dynamics.of_chain(robot.rigid_chain)

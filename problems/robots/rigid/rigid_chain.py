"""A chain of rigid bodies on joints, and the torques that a motion of it takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca

from problems.base.matrix import Matrix, Operand, columns
from problems.robots.rigid.inertia import Moments
from problems.robots.rigid.newton_euler import MovedBody, newton_euler
from problems.robots.rigid.transform import ORIGIN, Transform, Vector, as_rows, moved, times


@dataclass(frozen=True, eq=False, kw_only=True)
class RigidJoint:
    """A joint and the body that it moves; numbers, or symbols in their place.

    Attributes:
        pose: of its frame in that of the joint before (the base's, for the first), at zero.
        axis: unit vector in its own frame.
        turns: whether it is revolute; else it slides.
        moments: of the body, about the origin of the joint's frame; or of another that takes the same torques.
        damping: viscous friction, N m s or N s/m.
        friction: Coulomb friction, N m or N.
    """

    pose: Transform
    axis: tuple[float, float, float]
    turns: bool = True
    moments: Moments
    damping: Operand = 0.0
    friction: Operand = 0.0

    def moved(self, value: Operand) -> Transform:
        """From its own frame to that of the joint before, at a value (n, 1) in rad or m."""
        return moved(self.pose, self.axis, self.turns, value)


@dataclass(frozen=True, eq=False, kw_only=True)
class RigidChain:
    """Joints one after the other on a base that stands still.

    Attributes:
        joints: from the base on.
        gravity: in the axes of the base, m/s^2.
    """

    joints: tuple[RigidJoint, ...]
    gravity: Vector

    def inertial(self, theta: Matrix, speed: Matrix, acceleration: Matrix) -> Matrix:
        """Torques of inertia alone, M(q) a + C(q, v) v: (n, k), N m or N; run s times slower they are 1/s^2 of that."""
        return self._torques(theta, columns(speed), columns(acceleration), ORIGIN)

    def gravitational(self, theta: Matrix) -> Matrix:
        """Torques that hold the chain where it is, g(q): (n, k)."""
        still = [0.0] * len(self.joints)
        return self._torques(theta, still, still, self.gravity)

    def viscous(self, speed: Matrix) -> Matrix:
        """Torques of viscous friction, (n, k)."""
        return self._by_joint(speed, [joint.damping for joint in self.joints])

    def coulomb(self, speed: Matrix) -> Matrix:
        """Torques of Coulomb friction, (n, k); none where a joint stands still."""
        return self._by_joint(ca.sign(speed), [joint.friction for joint in self.joints])

    def torques(self, theta: Matrix, speed: Matrix, acceleration: Matrix) -> Matrix:
        """What the motors have to give, M(q) a + C(q, v) v + g(q) + friction: (n, k), N m or N.

        Args:
            theta: joint angles, (n, k), rad or m.
            speed: (n, k), rad/s or m/s.
            acceleration: (n, k), rad/s^2 or m/s^2.
        """
        moving = self._torques(theta, columns(speed), columns(acceleration), self.gravity)
        return moving + self.viscous(speed) + self.coulomb(speed)

    @property
    def has_friction(self) -> bool:
        """Whether any joint has Coulomb friction, so that torques jump where it turns back."""
        return any(not _is_none(joint.friction) for joint in self.joints)

    @property
    def has_damping(self) -> bool:
        """Whether any joint has viscous friction."""
        return any(not _is_none(joint.damping) for joint in self.joints)

    def _torques(
        self, theta: Matrix, speeds: Sequence[Operand], accelerations: Sequence[Operand], gravity: Vector
    ) -> Matrix:
        each = zip(self.joints, columns(theta), speeds, accelerations, strict=True)
        bodies = [MovedBody(joint, joint.moved(q), v, a) for joint, q, v, a in each]
        return as_rows(newton_euler(bodies, gravity), theta.shape[0])

    def _by_joint(self, values: Matrix, factors: list[Operand]) -> Matrix:
        parts = [times(factor, value) for factor, value in zip(factors, columns(values), strict=True)]
        return as_rows(parts, values.shape[0])


def _is_none(value: Operand) -> bool:
    return isinstance(value, (int, float)) and value == 0.0

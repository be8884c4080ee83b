"""Newton and Euler: torques of a tree of rigid bodies, and how they scale when it runs slower.

What a robot's geometry makes trivial costs no operation: products with 0 and 1 are left out.

[1] J. Luh, M. Walker, R. Paul: On-line computational scheme for mechanical manipulators. Journal of Dynamic Systems,
    Measurement, and Control 102 (1980).
[2] R. Featherstone: Rigid Body Dynamics Algorithms (2008), section 5.3.

With the room that ``held`` leaves of a limit, s is the larger root of a quadratic equation.

What a joint does not move against the body before it may as well belong to that body: where it turns, masses on its
axis; where it slides, second moments, which do not depend on where a body is. Afterwards a body that turns has no
mass, nothing along its axis, and no second moment of the axis alone. No such body need exist: torques are linear in
the masses.

[1] W. Khalil, J.-F. Kleinfinger: Minimum operations and minimum parameters of the dynamic models of tree structure
    robots. IEEE Journal of Robotics and Automation 3 (1987).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import casadi as ca
import numpy as np

from problems.base import FloatArray, Matrix, Operand, columns
from problems.robots.inertia import Moments
from problems.robots.transform import (
    ORIGIN,
    Rotation,
    Transform,
    Vector,
    added,
    as_rows,
    cross,
    dot,
    moved,
    plus,
    rotated,
    scaled,
    times,
    transposed,
)


class Jointed(Protocol):
    """A joint as the recursion needs it."""

    @property
    def axis(self) -> tuple[float, float, float]:
        """The unit vector of the axis in its own frame."""

    @property
    def parent(self) -> int | None:
        """The number of the body that the joint is on; None for that of the joint before."""

    @property
    def turns(self) -> bool:
        """Whether the joint is revolute."""

    @property
    def moments(self) -> Moments:
        """The moments of the body that it moves, about the origin of its frame."""


@dataclass(frozen=True, eq=False)
class MovedBody:
    """A joint in motion; values are numbers or (n, 1).

    Attributes:
        joint: and the body that it moves.
        pose: of its frame in that of the body that it is on.
        speed: rad/s or m/s.
        acceleration: rad/s^2 or m/s^2.
    """

    joint: Jointed
    pose: Transform
    speed: Operand
    acceleration: Operand


@dataclass(frozen=True, eq=False)
class _Twist:
    """The motion of a frame in its own axes: angular velocity and acceleration, and its origin's acceleration."""

    rate: Vector = ORIGIN
    spin: Vector = ORIGIN
    acceleration: Vector = ORIGIN

    @cached_property
    def field(self) -> Rotation:
        """The matrix B of accelerations a + B r at places r, 1/s^2: [spin]x + [rate]x^2."""
        (x, y, z), (a, b, c) = self.rate, self.spin
        xx, yy, zz = times(x, x), times(y, y), times(z, z)
        xy, xz, yz = times(x, y), times(x, z), times(y, z)
        return (
            (-plus(yy, zz), plus(xy, -c), plus(xz, b)),
            (plus(xy, c), -plus(xx, zz), plus(yz, -a)),
            (plus(xz, -b), plus(yz, a), -plus(xx, yy)),
        )


def newton_euler(bodies: Sequence[MovedBody], gravity: Vector) -> list[Operand]:
    """The torques (or forces) of the joints, from the base on: numbers or (n, 1).

    Args:
        bodies: from the base on.
        gravity: in the axes of the base, m/s^2.
    """
    twists = [_Twist(acceleration=scaled(gravity, -1.0))]
    wrenches = []
    for place, body in enumerate(bodies):
        twists.append(_carried(twists[_parent(body.joint, place)], body))
        wrenches.append(_wrench(twists[-1], body.joint.moments))
    torques: list[Operand] = []
    felt = [(ORIGIN, ORIGIN)] * len(twists)  # what others pass on to each body
    for place in range(len(bodies) - 1, -1, -1):
        force, moment = (added(own, passed) for own, passed in zip(wrenches[place], felt[place + 1], strict=True))
        joint, pose = bodies[place].joint, bodies[place].pose
        torques.append(dot(joint.axis, moment if joint.turns else force))
        force, moment = rotated(pose.rotation, force), rotated(pose.rotation, moment)
        moment = added(moment, cross(pose.translation, force))
        parent = _parent(joint, place)
        felt[parent] = added(felt[parent][0], force), added(felt[parent][1], moment)
    return torques[::-1]


def _parent(joint: Jointed, place: int) -> int:
    return place if joint.parent is None else joint.parent


def _carried(before: _Twist, body: MovedBody) -> _Twist:
    """The motion of a joint's frame, from that of the body that it is on."""
    back, arm = transposed(body.pose.rotation), body.pose.translation
    rate, spin = rotated(back, before.rate), rotated(back, before.spin)
    origin = added(before.acceleration, rotated(before.field, arm))
    acceleration = rotated(back, origin)
    along, faster = scaled(body.joint.axis, body.speed), scaled(body.joint.axis, body.acceleration)
    if body.joint.turns:
        return _Twist(added(rate, along), added(spin, faster, cross(rate, along)), acceleration)
    return _Twist(rate, spin, added(acceleration, faster, scaled(cross(rate, along), 2.0)))


def _wrench(twist: _Twist, moments: Moments) -> tuple[Vector, Vector]:
    """Force and moment about the origin of its frame that move a body in this way.

    Over the body's masses at places r they are the integrals of a + B r and of r x (a + B r).
    """
    force = added(scaled(twist.acceleration, moments.mass), rotated(twist.field, moments.first))
    return force, added(_moment(twist.field, moments.second), cross(moments.first, twist.acceleration))


def _moment(b: Rotation, second: Rotation) -> Vector:
    """The integral of r x B r."""

    def about(i: int) -> Operand:
        j, k = (i + 1) % 3, (i + 2) % 3
        across = plus(times(second[j][i], b[k][i]), -times(second[k][i], b[j][i]))
        along = plus(times(second[j][j], b[k][j]), -times(second[k][k], b[j][k]))
        return plus(plus(across, along), times(second[j][k], plus(b[k][k], -b[j][j])))

    return about(0), about(1), about(2)


@dataclass(frozen=True, eq=False, kw_only=True)
class RigidJoint:
    """A joint and the body that it moves; numbers, or symbols in their place.

    Attributes:
        pose: of its frame in that of the body that it is on, at zero.
        axis: unit vector in its own frame.
        parent: number of the body that it is on, 0 for the base; None for that of the joint before.
        turns: whether it is revolute; else it slides.
        moments: of the body, about the origin of the joint's frame; or of another that takes the same torques.
        damping: viscous friction, N m s or N s/m.
        friction: Coulomb friction, N m or N.
    """

    pose: Transform
    axis: tuple[float, float, float]
    parent: int | None = None
    turns: bool = True
    moments: Moments
    damping: Operand = 0.0
    friction: Operand = 0.0

    def moved(self, value: Operand) -> Transform:
        """The transform from its own frame to that of the joint before, at a value (n, 1) in rad or m."""
        return moved(self.pose, self.axis, self.turns, value)


@dataclass(frozen=True, eq=False, kw_only=True)
class RigidChain:
    """Joints with masses on a base that stands still.

    Attributes:
        joints: none comes before the one whose body it is on.
        gravity: in the axes of the base, m/s^2.
    """

    joints: tuple[RigidJoint, ...]
    gravity: Vector

    @property
    def parents(self) -> list[int]:
        """The number of the body that each joint is on."""
        return [_parent(joint, place) for place, joint in enumerate(self.joints)]

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
        """The torques of the motors, M(q) a + C(q, v) v + g(q) + friction: (n, k), N m or N.

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


def time_scales(inertial: Matrix, viscous: Matrix, room: Matrix) -> Matrix:
    """The least s with ``inertial / s'^2 + viscous / s' <= room`` for all s' >= s; 0 where there is none.

    Symbolic or numeric, with room that is positive.
    """
    square = viscous * viscous + 4.0 * inertial * room
    return ca.fmax(0.0, (viscous + ca.sqrt(ca.fmax(0.0, square))) / (2.0 * room)) * (square >= 0.0)


def time_scales_of_arrays(inertial: FloatArray, viscous: FloatArray, room: FloatArray) -> FloatArray:
    """The least s of :func:`time_scales` for arrays of one shape; infinite, or 0, where no room is left."""
    square = viscous * viscous + 4.0 * inertial * room
    with np.errstate(all="ignore"):
        root = (viscous + np.sqrt(np.maximum(square, 0.0))) / (2.0 * room)
    return np.where((square >= 0.0) & (root > 0.0), root, 0.0)


_Numbers = tuple[float, FloatArray, FloatArray]  # mass, first (3,) and second moments (3, 3)


def regrouped(joints: Sequence[RigidJoint]) -> list[RigidJoint]:
    """Joints that take the same torques on a base that stands still.

    Args:
        joints: from the base on, their moments plain numbers.
    """
    result: list[RigidJoint] = []
    nothing: _Numbers = (0.0, np.zeros(3), np.zeros((3, 3)))
    passed = [nothing] * (len(joints) + 1)  # to each body
    for place, joint in reversed(list(enumerate(joints))):
        moments = joint.moments
        own = (float(moments.mass), np.array(moments.first, dtype=float), np.array(moments.second, dtype=float))
        whole = _sum(own, passed[place + 1])
        still = _unmoved(joint, whole)
        result.insert(0, replace(joint, moments=_moments(_sum(whole, still, -1.0))))
        parent = _parent(joint, place)
        passed[parent] = _sum(passed[parent], _seen_from(joint.pose, still))
    return result


def _unmoved(joint: RigidJoint, whole: _Numbers) -> _Numbers:
    """The part of a body's moments that the joint's motion does not change as seen from the body before."""
    mass, first, second = whole
    axis = np.array(joint.axis)
    if not joint.turns:
        return 0.0, np.zeros(3), second
    return mass, axis * (axis @ first), np.outer(axis, axis) * (axis @ second @ axis)


def _seen_from(pose: Transform, moments: _Numbers) -> _Numbers:
    """Moments of masses about the origin of the frame in which theirs has a pose."""
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

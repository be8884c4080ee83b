"""The recursive Newton-Euler algorithm in the frames of the bodies: velocities outward, forces inward.

What a robot's geometry makes trivial costs no operation: products with 0 and 1 are left out.

[1] J. Luh, M. Walker, R. Paul: On-line computational scheme for mechanical manipulators. Journal of Dynamic Systems,
    Measurement, and Control 102 (1980).
[2] R. Featherstone: Rigid Body Dynamics Algorithms (2008), section 5.3.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from problems.base.matrix import Operand
from problems.robots.rigid.inertia import Moments
from problems.robots.rigid.transform import (
    ORIGIN,
    Rotation,
    Transform,
    Vector,
    added,
    cross,
    dot,
    plus,
    rotated,
    scaled,
    times,
    transposed,
)


class Jointed(Protocol):
    """What the recursion has to know of a joint."""

    @property
    def axis(self) -> tuple[float, float, float]:
        """Unit vector in its own frame."""

    @property
    def turns(self) -> bool:
        """Whether it is revolute."""

    @property
    def moments(self) -> Moments:
        """Of the body that it moves, about the origin of its frame."""


@dataclass(frozen=True, eq=False)
class MovedBody:
    """A joint in motion; values are numbers or (n, 1).

    Attributes:
        joint: and the body that it moves.
        pose: of its frame in that of the joint before.
        speed: rad/s or m/s.
        acceleration: rad/s^2 or m/s^2.
    """

    joint: Jointed
    pose: Transform
    speed: Operand
    acceleration: Operand


@dataclass(frozen=True, eq=False)
class _Twist:
    """How a frame moves, in its own axes: angular velocity and acceleration, and the acceleration of its origin."""

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
    twist = _Twist(acceleration=scaled(gravity, -1.0))
    wrenches = []
    for body in bodies:
        twist = _carried(twist, body)
        wrenches.append(_wrench(twist, body.joint.moments))
    torques: list[Operand] = []
    force, moment = ORIGIN, ORIGIN
    for place in range(len(bodies) - 1, -1, -1):
        own_force, own_moment = wrenches[place]
        force, moment = added(own_force, force), added(own_moment, moment)
        joint, pose = bodies[place].joint, bodies[place].pose
        torques.append(dot(joint.axis, moment if joint.turns else force))
        force, moment = rotated(pose.rotation, force), rotated(pose.rotation, moment)
        moment = added(moment, cross(pose.translation, force))
    return torques[::-1]


def _carried(before: _Twist, body: MovedBody) -> _Twist:
    """How the frame of a joint moves, from how the one before does."""
    back, arm = transposed(body.pose.rotation), body.pose.translation
    rate, spin = rotated(back, before.rate), rotated(back, before.spin)
    origin = added(before.acceleration, rotated(before.field, arm))
    acceleration = rotated(back, origin)
    along, faster = scaled(body.joint.axis, body.speed), scaled(body.joint.axis, body.acceleration)
    if body.joint.turns:
        return _Twist(added(rate, along), added(spin, faster, cross(rate, along)), acceleration)
    return _Twist(rate, spin, added(acceleration, faster, scaled(cross(rate, along), 2.0)))


def _wrench(twist: _Twist, moments: Moments) -> tuple[Vector, Vector]:
    """Force and moment about the origin of its frame that move a body so.

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

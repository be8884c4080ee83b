"""Links in the plane: frames and bodies, and the ranges that redundancy angles may have.

The links 1..j-1 below link j reach an annulus around the base. Link j may stand at any angle phi_j that leaves
the end of link j - 1 inside it: with rho and alpha the polar coordinates of what link j has to reach, the law of
cosines turns the outer radius R and the inner radius r into

    beta_in <= |phi_j - alpha| <= beta_out,
    cos(beta_out) = (rho^2 + l_j^2 - R^2) / (2 rho l_j),   cos(beta_in) = (rho^2 + l_j^2 - r^2) / (2 rho l_j),

one interval when beta_in = 0 and two otherwise. Choosing from link k down to link 3 never meets an empty range.

Angles in rad, lengths in m. Joint angles ``theta_i`` are relative; ``psi_i = theta_1 + ... + theta_i``, to which the
base's own angle is added, are the absolute orientations of the links.

A tool beside or beyond the end of the last link is a rigid part of it. For the tool's position, the last link then is
as long as the line from its joint to the tool, and turned by the angle between the two (``tool_angle``).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import pi
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import (
    ANGLES,
    COORDINATES,
    LENGTHS,
    RATES,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    check_within,
    columns,
    is_zero,
    largest,
    shown,
)
from problems.robots.bodies import Bodies, Body, BodyPairs
from problems.robots.joints import JointLimits
from problems.robots.robot import Robot


def wrap_to(angle: Matrix, reference: Matrix) -> Matrix:
    """``angle`` plus whole turns, within (reference - pi, reference + pi]; elementwise, rad."""
    return angle - 2.0 * pi * ca.ceil((angle - reference - pi) / (2.0 * pi))


SCALE_FLOOR = 1e-300  # least divisor: at a target on the base every angle will do, and none may become NaN


def annulus(lengths: Sequence[Operand]) -> tuple[Matrix, Operand]:
    """Inner and outer radius in m of what the end of a chain of links can reach."""
    outer = sum(lengths)
    return ca.fmax(0.0, 2.0 * largest(ca.vertcat(*lengths)) - outer), outer


def angular_range(lengths: Sequence[Operand], link: int, target: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """The angles at which ``link`` (3..k) can stand when its end is at ``target``.

    Args:
        lengths: of all links, m.
        link: the link's number j, counted from 1.
        target: where the end of link j is, (2, 1), m, within reach of links 1..j.

    Returns:
        alpha, beta_in, beta_out in rad: the allowed angles are alpha ± [beta_in, beta_out].
    """
    length = lengths[link - 1]
    inner, outer = annulus(lengths[: link - 1])
    square = ca.sumsqr(target) + length**2
    scale = ca.fmax(2.0 * length * ca.sqrt(ca.sumsqr(target)), SCALE_FLOOR)
    beta_in, beta_out = (_arccos((square - radius**2) / scale) for radius in (inner, outer))
    return ca.atan2(target[1], target[0]), beta_in, beta_out


def restore(lengths: Sequence[Operand], target: Matrix, normalised: Matrix) -> Matrix:
    """Redundancy angles of normalised values, (7) for each of the links k..3.

    Args:
        lengths: of all k links, m.
        target: the tip position, (2, 1), m, within reach.
        normalised: values in [0, 1] for the links 3..k, (k - 2, 1).

    Returns:
        phi of links 3..k, (k - 2, 1), rad. Every one can be reached; where the inner radius splits the range,
        [0, 1/2) runs through the interval on one side and [1/2, 1] through the other.
    """
    phi: list[Matrix] = []
    for link in range(len(lengths), 2, -1):
        alpha, beta_in, beta_out = angular_range(lengths, link, target)
        share = 2.0 * normalised[link - 3] - 1.0
        side = ca.if_else(share < 0.0, -1.0, 1.0)
        phi.insert(0, alpha + side * beta_in + share * (beta_out - beta_in))
        target = target - lengths[link - 1] * ca.vertcat(ca.cos(phi[0]), ca.sin(phi[0]))
    return ca.vertcat(*phi) if phi else ca.DM(0, 1)


def _arccos(cosine: Matrix) -> Matrix:
    return ca.acos(ca.fmin(1.0, ca.fmax(-1.0, cosine)))


@dataclass(frozen=True)
class LinkBodies(Bodies):
    """The links of a planar arm, and its tool.

    Args:
        arm: that has them.
    """

    arm: PlanarLinks

    @property
    def turns(self) -> FloatArray:
        return np.tri(self.arm.links)

    @property
    def levers(self) -> FloatArray:
        """Bounds of each body's motion: turning of links j <= i carries link i, each by its length."""
        lengths = self.arm.link_lengths
        levers = np.tri(self.arm.links) * np.array(lengths)
        if not self.arm.has_tool:
            return np.asarray(levers)
        farther = max(lengths[-1], float(self.arm.chain[-1]))  # end of the tool's line, from the last joint
        return np.vstack([levers, [*lengths[:-1], farther]])

    @property
    def pairs(self) -> BodyPairs:
        """All pairs that share neither a joint nor an end: the tool may be beside the last link."""
        return tuple((first, second) for first, second in combinations(self.each, 2) if second.start > first.end)


MAX_LINKS = 100  # more take minutes to build
MIN_LENGTH_RATIO = 1e-6  # of the shortest link to the longest: below, rounding decides what is within reach


@dataclass(frozen=True)
class PlanarLinks(Robot):
    """A chain of links that turn in one plane.

    Args:
        link_lengths: k >= 2 lengths in m, from the base to the end of the last link.
        max_speed: bound of each joint's |dtheta/dt| in rad/s, (11) and (21); k values.
        max_acceleration: bound of each joint's |d2theta/dt2| in rad/s^2, (12) and (22); k values.
        joint_limits: optional (lowest, highest) angle of each joint in rad; k pairs.
        max_jerk: optional bound of each joint's |d3theta/dt3| in rad/s^3; k values.
        link_radius: optional radius of each link in m; k values. A link is a capsule around the line between its
            joints; an offset tool one around the line from the last link's end to it, as thick as that link.
        base_point: where the base is, m.
        base_angle: the orientation of the first link where its joint angle is zero, rad.
        tool_offset: of the tool from the end of the last link, (along the link, to its left), m.

    Raises:
        InvalidProblem: a length or limit is not positive or out of range, there are more than ``MAX_LINKS`` links, a
            list is not k long, the tool lies on the last joint, or links with these radii and this margin could never
            be apart.
    """

    zero_is_structure: ClassVar[tuple[str, ...]] = (
        *Robot.zero_is_structure, "link_radius", "base_point", "base_angle", "tool_offset"
    )  # fmt: skip
    numbers: ClassVar[tuple[str, ...]] = (
        *zero_is_structure, "link_lengths", "max_speed", "max_acceleration", "joint_limits", "max_jerk"
    )  # fmt: skip
    angular: ClassVar[tuple[str, ...]] = ("max_speed", "max_acceleration", "joint_limits", "max_jerk", "base_angle")
    per_joint: ClassVar[tuple[str, ...]] = ("max_speed", "max_acceleration", "max_jerk", "link_radius")

    link_lengths: tuple[float, ...]
    max_speed: tuple[float, ...]
    max_acceleration: tuple[float, ...]
    joint_limits: tuple[tuple[float, float], ...] | None = None
    max_jerk: tuple[float, ...] | None = None
    link_radius: tuple[float, ...] | None = None
    base_point: tuple[float, float] = (0.0, 0.0)
    base_angle: float = 0.0
    tool_offset: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """The arm that a table of a file describes; one number stands for all joints."""
        lengths = settings.get("link_lengths")
        if not isinstance(lengths, (list, tuple)):
            raise InvalidProblem("link_lengths", "missing key" if lengths is None else "a list of numbers is needed")
        per_joint = {
            key: [settings[key]] * len(lengths) for key in cls.per_joint if isinstance(settings.get(key), (int, float))
        }
        return super().from_settings({**settings, **per_joint})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.links < 2:
            raise InvalidProblem("link_lengths", f"an arm has at least 2 links, not {self.links}")
        if self.links > MAX_LINKS:
            raise InvalidProblem("link_lengths", f"{self.links} links are more than {MAX_LINKS}")
        self._check_positive("link_lengths", self.link_lengths, LENGTHS, "m")
        self._check_positive("max_speed", self.max_speed, RATES, "rad/s")
        self._check_positive("max_acceleration", self.max_acceleration, RATES, "rad/s^2")
        if self.max_jerk is not None:
            self._check_positive("max_jerk", self.max_jerk, RATES, "rad/s^3")
        if min(self.link_lengths) < MIN_LENGTH_RATIO * max(self.link_lengths):
            reason = f"the shortest link has to be at least {MIN_LENGTH_RATIO:g} times as long as the longest"
            raise InvalidProblem("link_lengths", reason)
        if self.joint_limits is not None:
            self._check_length("joint_limits", self.joint_limits)
            for joint, (lowest, highest) in enumerate(self.joint_limits, start=1):
                check_within("joint_limits", (lowest, highest), ANGLES, "rad")
                if not lowest < highest:
                    reason = f"joint {joint}: {lowest} is not below {highest}"
                    raise InvalidProblem("joint_limits", reason)
        self._check_pose()
        self._check_widths()

    def _check_positive(self, field: str, values: tuple[float, ...], bounds: tuple[float, float], unit: str) -> None:
        self._check_length(field, values)
        for value in values:
            if not value > 0.0:
                raise InvalidProblem(field, f"{shown(value)} is not a positive number")
        check_within(field, values, bounds, unit)

    def _check_pose(self) -> None:
        check_within("base_point", self.base_point, COORDINATES, "m")
        check_within("base_angle", (self.base_angle,), ANGLES, "rad")
        check_within("tool_offset", self.tool_offset, COORDINATES, "m")
        if not float(self.chain[-1]) >= MIN_LENGTH_RATIO * max(self.link_lengths):
            raise InvalidProblem("tool_offset", "the tool lies on the last joint")

    def _check_widths(self) -> None:
        """Check that radii are lengths, and that links that must not touch can be apart."""
        if self.link_radius is not None:
            self._check_length("link_radius", self.link_radius)
            check_within("link_radius", self.link_radius, (0.0, LENGTHS[1]), "m")
        for first, second in self.bodies.pairs if self.self_collision else ():
            between, kept = self._most_between(first, second), float(first.radius + second.radius) + self.margin
            if between <= kept:
                names = f"{first.name} and {second.name}"
                reason = f"{names} cannot keep {kept:.6g} m: what joins them is {between:.6g} m long"
                raise InvalidProblem("self_collision", reason)

    def _most_between(self, first: Body, second: Body) -> float:
        """An upper bound of a pair's distance, m: the links between them, stretched out."""
        if second.start < self.links:
            return sum(self.link_lengths[first.end : second.start])
        start, way = np.array([self.link_lengths[-1], 0.0]), np.array(self.tool_offset)  # of the tool's line
        nearest = start + np.clip(-(start @ way) / (way @ way), 0.0, 1.0) * way  # to the last joint
        return sum(self.link_lengths[first.end : -1]) + float(np.linalg.norm(nearest))

    def _check_length(self, field: str, values: tuple[Any, ...]) -> None:
        if len(values) != self.links:
            raise InvalidProblem(field, f"{len(values)} values for {self.links} links")

    @property
    def links(self) -> int:
        """The number of links k."""
        return len(self.link_lengths)

    @property
    def dof(self) -> int:
        return self.links

    @property
    def limits(self) -> JointLimits:
        return JointLimits(
            speed=self.max_speed, acceleration=self.max_acceleration, position=self.joint_limits, jerk=self.max_jerk
        )

    @property
    def base(self) -> tuple[float, ...]:
        return self.base_point

    @property
    def has_tool(self) -> bool:
        """Whether the tool is anywhere but at the end of the last link."""
        return not is_zero(self.tool_offset)

    @property
    def chain(self) -> tuple[Operand, ...]:
        """The links' lengths as far as the tool's position goes, m: the last one reaches from its joint to the tool."""
        if not self.has_tool:
            return self.link_lengths
        along, left = self.link_lengths[-1] + self.tool_offset[0], self.tool_offset[1]
        return (*self.link_lengths[:-1], ca.sqrt(along**2 + left**2))

    @property
    def tool_angle(self) -> Operand:
        """The angle from the last link to the line from its joint to the tool, rad."""
        along, left = self.link_lengths[-1] + self.tool_offset[0], self.tool_offset[1]
        return ca.atan2(left, along) if self.has_tool else 0.0

    def reach(self, links: int | None = None) -> tuple[float, float]:
        """Inner and outer radius in m of the annulus that the end of so many links (default: the tool) can reach."""
        chain = self.chain if links is None or links > self.links else self.link_lengths[:links]
        lengths = [float(length) for length in chain]
        outer = sum(lengths)
        return max(0.0, 2.0 * max(lengths) - outer), outer

    def positions(self, theta: Matrix) -> tuple[Matrix, ...]:
        """Forward kinematics of n postures (n, k) in rad: base, joints, the last link's end, and the tool if elsewhere.

        k + 1 or k + 2 matrices (n, 2), m.
        """
        psi: Operand = self.base_angle
        positions: list[Matrix] = [ca.DM.zeros(theta.shape[0], 2)]
        if not is_zero(self.base):
            positions = [ca.repmat(ca.horzcat(*self.base), theta.shape[0], 1)]
        for length, angle in zip(self.link_lengths, columns(theta), strict=True):
            psi = psi + angle
            x, y = columns(positions[-1])
            positions.append(ca.horzcat(x + length * ca.cos(psi), y + length * ca.sin(psi)))
        if self.has_tool:
            positions.append(positions[-1] + turned(self.tool_offset, psi))
        return tuple(positions)

    @cached_property
    def bodies(self) -> LinkBodies:
        """The links, and the tool where it is not at the end of the last."""
        radii = self.link_radius or (0.0,) * self.links
        links = [Body(f"link {number}", number - 1, number, radius) for number, radius in enumerate(radii, start=1)]
        tool = [Body("tool", self.links, self.links + 1, radii[-1])] if self.has_tool else []
        return LinkBodies((*links, *tool), self)

    @property
    def radius(self) -> Operand:
        return sum(self.chain)


def turned(offset: tuple[Operand, Operand], angle: Operand) -> Matrix:
    """A vector (along, left) in a frame turned by angles (n, 1), as seen from outside, (n, 2)."""
    (along, left), cosine, sine = offset, ca.cos(angle), ca.sin(angle)
    return ca.horzcat(along * cosine - left * sine, along * sine + left * cosine)

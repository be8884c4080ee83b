"""The planar arm with k revolute joints: forward and inverse kinematics, (1)-(2) of the paper.

Angles in rad, lengths in m. Joint angles ``theta_i`` are relative; ``psi_i = theta_1 + ... + theta_i`` are the
absolute orientations of the links; the base is the origin. For k > 2 the orientations ``phi_j = psi_j`` of the
links j = 3..k are the redundancy angles: once they are chosen, links 1 and 2 form a triangle with what remains.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, Operand, columns
from problems.base.ranges import ANGLES, LENGTHS, RATES, check_within, shown
from problems.robots.redundancy import angular_range, annulus, restore
from problems.robots.robot import JointLimits, Robot
from problems.robots.turns import wrap_to

MAX_LINKS = 100  # more take minutes to build
MIN_LENGTH_RATIO = 1e-6  # of the shortest link to the longest: below, rounding decides what is within reach


@dataclass(frozen=True)
class PlanarArm(Robot):
    """A chain of links that turn in one plane; the base is the origin.

    Args:
        link_lengths: k >= 2 lengths in m, from the base to the tip.
        max_speed: bound of each joint's |dtheta/dt| in rad/s, (11) and (21); k values.
        max_acceleration: bound of each joint's |d2theta/dt2| in rad/s^2, (12) and (22); k values.
        joint_limits: optional (lowest, highest) angle of each joint in rad; k pairs.

    Raises:
        InvalidProblem: a length or limit is not positive or out of range, there are more than ``MAX_LINKS`` links, or a
            list is not k long.
    """

    numbers: ClassVar[tuple[str, ...]] = ("link_lengths", "max_speed", "max_acceleration", "joint_limits")

    link_lengths: tuple[float, ...]
    max_speed: tuple[float, ...]
    max_acceleration: tuple[float, ...]
    joint_limits: tuple[tuple[float, float], ...] | None = None

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """The arm that a table of a file describes; one speed or acceleration stands for all joints."""
        lengths = settings.get("link_lengths")
        if not isinstance(lengths, (list, tuple)):
            raise InvalidProblem("link_lengths", "missing key" if lengths is None else "a list of numbers is needed")
        per_joint = {
            key: [settings[key]] * len(lengths)
            for key in ("max_speed", "max_acceleration")
            if isinstance(settings.get(key), (int, float))
        }
        return super().from_settings({**settings, **per_joint})

    def __post_init__(self) -> None:
        if self.links < 2:
            raise InvalidProblem("link_lengths", f"an arm has at least 2 links, not {self.links}")
        if self.links > MAX_LINKS:
            raise InvalidProblem("link_lengths", f"{self.links} links are more than {MAX_LINKS}")
        for field in ("link_lengths", "max_speed", "max_acceleration"):
            self._check_length(field)
            for value in getattr(self, field):
                if not value > 0.0:
                    raise InvalidProblem(field, f"{shown(value)} is not a positive number")
        check_within("link_lengths", self.link_lengths, LENGTHS, "m")
        check_within("max_speed", self.max_speed, RATES, "rad/s")
        check_within("max_acceleration", self.max_acceleration, RATES, "rad/s^2")
        if min(self.link_lengths) < MIN_LENGTH_RATIO * max(self.link_lengths):
            reason = f"the shortest link has to be at least {MIN_LENGTH_RATIO:g} times as long as the longest"
            raise InvalidProblem("link_lengths", reason)
        if self.joint_limits is not None:
            self._check_length("joint_limits")
            for joint, (lowest, highest) in enumerate(self.joint_limits, start=1):
                check_within("joint_limits", (lowest, highest), ANGLES, "rad")
                if not lowest < highest:
                    reason = f"joint {joint}: {lowest} is not below {highest}"
                    raise InvalidProblem("joint_limits", reason)

    def _check_length(self, field: str) -> None:
        count = len(getattr(self, field))
        if count != self.links:
            raise InvalidProblem(field, f"{count} values for {self.links} links")

    @property
    def links(self) -> int:
        """The number of links k."""
        return len(self.link_lengths)

    @property
    def dof(self) -> int:
        """The number of joints, k."""
        return self.links

    @property
    def limits(self) -> JointLimits:
        """Limits of the joints."""
        return JointLimits(speed=self.max_speed, acceleration=self.max_acceleration, position=self.joint_limits)

    @property
    def redundancy(self) -> int:
        """How many links are redundant, k - 2."""
        return self.links - 2

    def reach(self, links: int | None = None) -> tuple[float, float]:
        """Inner and outer radius in m of the annulus that the first ``links`` links (default: all) can reach."""
        inner, outer = annulus(self.link_lengths[:links])
        return float(inner), float(outer)

    def positions(self, theta: Matrix) -> tuple[Matrix, ...]:
        """Forward kinematics of n postures (n, k) in rad: base, joints and tip, k + 1 matrices (n, 2), m."""
        psi: Operand = 0
        positions: list[Matrix] = [ca.DM.zeros(theta.shape[0], 2)]
        for length, angle in zip(self.link_lengths, columns(theta), strict=True):
            psi = psi + angle
            x, y = columns(positions[-1])
            positions.append(ca.horzcat(x + length * ca.cos(psi), y + length * ca.sin(psi)))
        return tuple(positions)

    @property
    def radius(self) -> Operand:
        """All links stretched out, m."""
        return sum(self.link_lengths)

    @property
    def turns(self) -> FloatArray:
        """Link orientations psi are sums of joint angles."""
        return np.tri(self.links)

    @property
    def levers(self) -> FloatArray:
        """A point of link i is carried along by the turning of the links j <= i, each as long as it is."""
        return np.asarray(np.tri(self.links) * np.array(self.link_lengths))

    def restore_redundancy(self, point: Matrix, normalised: Matrix) -> Matrix:
        """Orientations phi of links 3..k by (7), generalised; (k - 2, 1), rad."""
        return restore(self.link_lengths, point, normalised)

    def redundant_values(self, theta: FloatArray) -> FloatArray:
        """Orientations phi of links 3..k, (n, k - 2), rad."""
        return np.asarray(np.cumsum(theta, axis=1)[:, 2:])

    def redundancy_ranges(self, theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds (23) of the orientations phi of links 3..k, both (n, k - 2), rad.

        A link beyond the third has its bounds given where the links after it stand; of two intervals the one that phi
        is in, or nearest to, is returned.
        """
        phi = self.redundant_values(theta)
        lower, upper = np.empty_like(phi), np.empty_like(phi)
        for row, point in enumerate(points):
            target = ca.DM(point)
            for link in range(self.links, 2, -1):
                angle = float(phi[row, link - 3])
                ends = (float(value) for value in angular_range(self.link_lengths, link, target))
                lower[row, link - 3], upper[row, link - 3] = _interval_around(angle, *ends)
                target = target - self.link_lengths[link - 1] * ca.DM([np.cos(angle), np.sin(angle)])
        return lower, upper

    def inverse(self, point: Matrix, phi: Matrix, elbow: Operand) -> tuple[Matrix, Matrix]:
        """Inverse kinematics (1)-(2), with atan2 where the paper's arccos loses the sign.

        Args:
            point: tip position, (2, 1), m.
            phi: redundancy angles of links 3..k, (k - 2, 1), rad.
            elbow: +1 for up (theta_2 >= 0, the arccos of (1)), -1 for down.

        Returns:
            The joint angles (1, k) in rad, neither wrapped nor limited, and cos(theta_2) of (1): the paper's k_s or
            k_f. The point is reached exactly when its absolute value is at most 1; beyond, the angles are those
            of the stretched or folded arm, so that no NaN appears.
        """
        l1, l2 = self.link_lengths[:2]
        wrist = self.wrist(point, phi)
        cosine = (ca.sumsqr(wrist) - l1**2 - l2**2) / (2.0 * l1 * l2)
        clipped = ca.fmin(1.0, ca.fmax(-1.0, cosine))
        sine = elbow * ca.sqrt(1.0 - clipped**2)
        theta_1 = ca.atan2(wrist[1], wrist[0]) - ca.atan2(l2 * sine, l1 + l2 * clipped)
        theta_2 = ca.atan2(sine, clipped)
        psi = [theta_1 + theta_2, *(phi[i] for i in range(phi.shape[0]))]
        rest = [after - before for before, after in pairwise(psi)]
        return ca.horzcat(theta_1, theta_2, *rest), cosine

    def project_to_point(self, theta: Matrix, point: Matrix) -> Matrix:
        """The posture nearest ``theta`` (1, k) whose tip is at ``point`` (2, 1) exactly, m.

        Links 3..k keep their orientation, links 1 and 2 close what is left of the way with the same elbow.
        """
        psi = ca.cumsum(theta, 1)
        elbow = ca.if_else(ca.sin(theta[1]) < 0.0, -1.0, 1.0)
        angles, _ = self.inverse(point, psi[2:].T, elbow)
        return wrap_to(angles, theta)

    def wrist(self, point: Matrix, phi: Matrix) -> Matrix:
        """The end of link 2 in m, (2, 1), when links 3..k stand at ``phi`` and the tip at ``point``."""
        wrist = point
        for i, length in enumerate(self.link_lengths[2:]):
            wrist = wrist - length * ca.vertcat(ca.cos(phi[i]), ca.sin(phi[i]))
        return wrist

    def wrap(self, theta: Matrix) -> Matrix:
        """The same posture with each angle in its first turn.

        That is (-pi, pi], or, with joint limits, the turn around the middle of the joint's range. (1, k) -> (1, k).
        """
        return wrap_to(theta, self.middle)

    @property
    def middle(self) -> Matrix:
        """The middle of each joint's range, zero without limits; (1, k), rad."""
        if self.joint_limits is None:
            return ca.DM.zeros(1, self.links)
        return ca.horzcat(*((lowest + highest) / 2.0 for lowest, highest in self.joint_limits))

    def wrap_near(self, theta: Matrix, start: Matrix) -> Matrix:
        """The same posture with each angle in the turn nearest ``start``; joint limits, if any, decide first."""
        near = wrap_to(theta, start)
        if self.joint_limits is None:
            return near
        lowest, highest = (ca.horzcat(*bound) for bound in zip(*self.joint_limits, strict=True))
        near = ca.if_else(near > highest, near - 2.0 * pi, near)
        return ca.if_else(near < lowest, near + 2.0 * pi, near)


def _interval_around(angle: float, alpha: float, beta_in: float, beta_out: float) -> tuple[float, float]:
    """The interval of alpha ± [beta_in, beta_out], in the turn nearest ``angle``, on the angle's side of alpha."""
    alpha = float(wrap_to(ca.DM(alpha), ca.DM(angle)))
    if beta_in == 0.0:
        return alpha - beta_out, alpha + beta_out
    return (alpha + beta_in, alpha + beta_out) if angle >= alpha else (alpha - beta_out, alpha - beta_in)

"""The planar arm with k revolute joints: forward and inverse kinematics, (1)-(2) of the paper.

Angles in rad, lengths in m. Joint angles ``theta_i`` are relative; ``psi_i = theta_1 + ... + theta_i`` are the
absolute orientations of the links; the base is the origin. For k > 2 the orientations ``phi_j = psi_j`` of the
links j = 3..k are the redundancy angles: once they are chosen, links 1 and 2 form a triangle with what remains.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import pi

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import Matrix, columns


@dataclass(frozen=True)
class PlanarArm:
    """Geometry and limits of an arm.

    Args:
        link_lengths: k >= 2 lengths in m, from the base to the tip.
        max_speed: bound of each joint's |dtheta/dt| in rad/s, (11) and (21); k values.
        max_acceleration: bound of each joint's |d2theta/dt2| in rad/s^2, (12) and (22); k values.
        joint_limits: optional (lowest, highest) angle of each joint in rad; k pairs.

    Raises:
        InvalidProblem: a length or limit is not positive and finite, or a list is not k long.
    """

    link_lengths: tuple[float, ...]
    max_speed: tuple[float, ...]
    max_acceleration: tuple[float, ...]
    joint_limits: tuple[tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        if self.links < 2:
            raise InvalidProblem("link_lengths", f"an arm has at least 2 links, not {self.links}")
        for field in ("link_lengths", "max_speed", "max_acceleration"):
            self._check_length(field)
            for value in getattr(self, field):
                if not (np.isfinite(value) and value > 0.0):
                    raise InvalidProblem(field, f"{value} is not a positive number")
        if self.joint_limits is not None:
            self._check_length("joint_limits")
            for joint, (lowest, highest) in enumerate(self.joint_limits, start=1):
                if not (np.isfinite([lowest, highest]).all() and lowest < highest):
                    reason = f"joint {joint}: {lowest} is not below {highest}, or one is not finite"
                    raise InvalidProblem("joint_limits", reason)

    def _check_length(self, field: str) -> None:
        found = len(getattr(self, field))
        if found != self.links:
            raise InvalidProblem(field, f"{found} values for {self.links} links")

    @property
    def links(self) -> int:
        """The number of links k."""
        return len(self.link_lengths)

    def reach(self, links: int | None = None) -> tuple[float, float]:
        """Inner and outer radius in m of the annulus that the first ``links`` links (default: all) can reach."""
        lengths = self.link_lengths[:links]
        return max(0.0, 2.0 * max(lengths) - sum(lengths)), sum(lengths)

    def joint_positions(self, theta: Matrix) -> tuple[Matrix, Matrix]:
        """Forward kinematics of n postures.

        Args:
            theta: joint angles, (n, k), rad.

        Returns:
            x and y in m of the base, each joint and the tip, both (n, k + 1).
        """
        psi: Matrix = 0
        xs, ys = [ca.DM.zeros(theta.shape[0], 1)], [ca.DM.zeros(theta.shape[0], 1)]
        for length, angle in zip(self.link_lengths, columns(theta), strict=True):
            psi = psi + angle
            xs.append(xs[-1] + length * ca.cos(psi))
            ys.append(ys[-1] + length * ca.sin(psi))
        return ca.horzcat(*xs), ca.horzcat(*ys)

    def tip(self, theta: Matrix) -> Matrix:
        """Tip positions in m, (n, 2), of n postures (n, k)."""
        x, y = self.joint_positions(theta)
        return ca.horzcat(x[:, -1], y[:, -1])

    def inverse(self, point: Matrix, phi: Matrix, elbow: Matrix) -> tuple[Matrix, Matrix]:
        """Inverse kinematics (1)-(2), with atan2 where the paper's arccos loses the sign.

        Args:
            point: tip position, (2, 1), m.
            phi: redundancy angles of links 3..k, (k - 2, 1), rad.
            elbow: +1 for up (theta_2 >= 0, the arccos of (1)), -1 for down.

        Returns:
            The joint angles (1, k) in rad, neither wrapped nor limited, and cos(theta_2) of (1): the paper's k_s or
            k_f. The point is reached exactly when its absolute value is at most 1; beyond, the angles are those
            of the time_scaled or folded arm, so that no NaN appears.
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
        """The posture nearest ``theta`` (1, k) whose tip is at ``point`` (2, 1) exactly, m; numeric.

        Links 3..k keep their orientation, links 1 and 2 close what is left of the way with the same elbow.
        """
        psi = ca.cumsum(theta, 1)
        elbow = -1.0 if float(ca.sin(theta[1])) < 0.0 else 1.0
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
        middle = [0.0] * self.links
        if self.joint_limits is not None:
            middle = [(lowest + highest) / 2.0 for lowest, highest in self.joint_limits]
        return wrap_to(theta, ca.DM(middle).T)

    def wrap_near(self, theta: Matrix, start: Matrix) -> Matrix:
        """The same posture with each angle in the turn nearest ``start``; joint limits, if any, decide first."""
        near = wrap_to(theta, start)
        if self.joint_limits is None:
            return near
        lowest, highest = (ca.DM(list(bound)).T for bound in zip(*self.joint_limits, strict=True))
        near = ca.if_else(near > highest, near - 2.0 * pi, near)
        return ca.if_else(near < lowest, near + 2.0 * pi, near)


def wrap_to(angle: Matrix, reference: Matrix) -> Matrix:
    """``angle`` plus whole turns, within (reference - pi, reference + pi]; elementwise, rad."""
    return angle - 2.0 * pi * ca.ceil((angle - reference - pi) / (2.0 * pi))

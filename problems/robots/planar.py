"""The planar arm: its masses, and its inverse kinematics with redundancy angles.

For k > 2 the absolute orientations ``phi_j`` of the links j = 3..k are the redundancy angles: once they are chosen,
links 1 and 2 form a triangle with what remains.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from math import pi
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import (
    ACCELERATIONS,
    COORDINATES,
    FRICTIONS,
    INERTIAS,
    MASSES,
    TORQUES,
    FloatArray,
    InvalidProblem,
    Matrix,
    Operand,
    check_within,
    is_zero,
)
from problems.robots.closed_form import ClosedForm
from problems.robots.dynamics import RigidChain, RigidJoint
from problems.robots.inertia import Moments, Payload, planar_payload_of
from problems.robots.joints import JointLimits
from problems.robots.planar_links import PlanarLinks, angular_range, restore, turned, wrap_to
from problems.robots.robot import are_numbers
from problems.robots.transform import ORIGIN, Transform, about, plus, times

PLANAR_GRAVITY = (0.0, -9.81)  # m/s^2
UP = (0.0, 0.0, 1.0)  # the axis about which every link turns
FRICTION = ("viscous_friction", "coulomb_friction")
DYNAMICS = ("max_torque", "link_masses", "link_centers", "link_inertias", *FRICTION)


@dataclass(frozen=True, kw_only=True)
class MassiveLinks(PlanarLinks):
    """A chain of links that turn in one plane, with masses where they are known.

    Args:
        max_torque: optional bound of what each motor gives, N m; k values.
        link_masses: optional, kg; k values. Without them no torque is known, and nothing else here may be stated.
        link_centers: of mass, from each link's joint along it, m; k values. The middle where None.
        link_inertias: about the centres of mass, kg m^2; k values. Those of uniform rods where None.
        viscous_friction: of the joints, N m s; k values. None where None.
        coulomb_friction: of the joints, N m; k values. None where None.
        payload: what the tool carries, in a frame at the tool whose axes are those of the last link; None for nothing.
        gravity: as seen from outside, m/s^2.

    Raises:
        InvalidProblem: as of planar links; a mass, inertia or friction is out of range; or masses are missing.
    """

    zero_is_structure: ClassVar[tuple[str, ...]] = (*PlanarLinks.zero_is_structure, *FRICTION)
    numbers: ClassVar[tuple[str, ...]] = (*PlanarLinks.numbers, *DYNAMICS)
    per_joint: ClassVar[tuple[str, ...]] = (*PlanarLinks.per_joint, *DYNAMICS)

    max_torque: tuple[float, ...] | None = None
    link_masses: tuple[float, ...] | None = None
    link_centers: tuple[float, ...] | None = None
    link_inertias: tuple[float, ...] | None = None
    viscous_friction: tuple[float, ...] | None = None
    coulomb_friction: tuple[float, ...] | None = None
    payload: Payload | None = None
    gravity: tuple[float, float] = PLANAR_GRAVITY

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """The arm that a table of a file describes; ``payload`` is a table with mass, center (2) and inertia."""
        gravity = settings.get("gravity", PLANAR_GRAVITY)
        if not (isinstance(gravity, (list, tuple)) and len(gravity) == 2 and are_numbers(gravity)):
            raise InvalidProblem("gravity", f"two numbers are needed, not {gravity!r}")
        carried = {"payload": planar_payload_of(settings["payload"])} if "payload" in settings else {}
        return super().from_settings({**settings, **carried})

    def __post_init__(self) -> None:
        super().__post_init__()
        check_within("gravity", self.gravity, ACCELERATIONS, "m/s^2")
        for field, bounds, unit in (
            ("max_torque", TORQUES, "N m"),
            ("link_masses", MASSES, "kg"),
            ("link_centers", COORDINATES, "m"),
            ("link_inertias", INERTIAS, "kg m^2"),
            ("viscous_friction", FRICTIONS, "N m s"),
            ("coulomb_friction", FRICTIONS, "N m"),
        ):
            values = getattr(self, field)
            if values is not None:
                self._check_length(field, values)
                check_within(field, values, bounds, unit)
                self._check_known(field)
        if self.payload is not None:
            self._check_known("payload")

    def _check_known(self, field: str) -> None:
        if self.link_masses is None:
            raise InvalidProblem(field, "link_masses are needed with it: without them no torque is known")

    @property
    def limits(self) -> JointLimits:
        return replace(super().limits, torque=self.max_torque)

    @property
    def rigid_chain(self) -> RigidChain | None:
        if self.link_masses is None:
            return None
        joints = [self._joint(link, mass) for link, mass in enumerate(self.link_masses)]
        if not is_zero(self.base_angle):
            joints[0] = replace(joints[0], pose=Transform(about(UP, self.base_angle)))
        if self.payload is not None:
            along, left = self.tool_offset
            tool = Transform(translation=(plus(self.link_lengths[-1], along), left, 0.0))
            joints[-1] = replace(joints[-1], moments=joints[-1].moments + Moments.of(self.payload, tool))
        return RigidChain(joints=tuple(joints), gravity=(*self.gravity, 0.0))

    def _joint(self, link: int, mass: Operand) -> RigidJoint:
        """A joint with its link, which lies along x of the joint's frame; links from 0 on."""
        length = self.link_lengths[link]
        center = length / 2.0 if self.link_centers is None else self.link_centers[link]
        inertia = mass * length**2 / 12.0 if self.link_inertias is None else self.link_inertias[link]
        first = times(mass, center)
        about_joint = plus(inertia, times(first, center))
        return RigidJoint(
            pose=Transform(translation=(self.link_lengths[link - 1] if link else 0.0, 0.0, 0.0)),
            axis=UP,
            moments=Moments(mass, (first, 0.0, 0.0), ((about_joint, 0.0, 0.0), ORIGIN, ORIGIN)),
            damping=0.0 if self.viscous_friction is None else self.viscous_friction[link],
            friction=0.0 if self.coulomb_friction is None else self.coulomb_friction[link],
        )


@dataclass(frozen=True)
class PlanarArm(MassiveLinks):
    """A chain of links that turn in one plane, with inverse kinematics for its tool."""

    @property
    def closed_form(self) -> PlanarForm:
        return PlanarForm(self)


@dataclass(frozen=True)
class PlanarForm(ClosedForm):
    """Inverse kinematics of a planar arm: its redundant values are the orientations of links 3..k."""

    arm: PlanarArm

    @property
    def redundancy(self) -> int:
        """The number of redundant links, k - 2."""
        return self.arm.links - 2

    @property
    def stretched(self) -> float:
        """The second joint's angle, rad; not zero where link 2 is the last and carries the tool at its side."""
        return -float(self.arm.tool_angle) if self.arm.links == 2 else 0.0

    def restore_redundancy(self, point: Matrix, normalised: Matrix) -> Matrix:
        """Orientations phi of links 3..k by (7), generalised; (k - 2, 1), rad."""
        phi = restore(self.arm.chain, self._from_base(point), normalised)
        if self.arm.has_tool and self.redundancy:
            phi[-1] -= self.arm.tool_angle
        return phi

    def redundant_values(self, theta: FloatArray) -> FloatArray:
        """Orientations phi of links 3..k, (n, k - 2), rad."""
        return np.asarray(np.cumsum(theta, axis=1)[:, 2:] + self.arm.base_angle)

    def redundancy_ranges(self, theta: FloatArray, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Bounds (23) of the orientations phi of links 3..k, both (n, k - 2), rad.

        A link beyond the third has its bounds given where the links after it stand; of two intervals the one that phi
        is in, or nearest to, is returned.
        """
        to_tool = np.append(np.zeros(self.arm.links - 1), float(self.arm.tool_angle))[2:]
        phi = self.redundant_values(theta) + to_tool
        lower, upper = np.empty_like(phi), np.empty_like(phi)
        for row, point in enumerate(points):
            target = self._from_base(ca.DM(point))
            for link in range(self.arm.links, 2, -1):
                angle = float(phi[row, link - 3])
                ends = (float(value) for value in angular_range(self.arm.chain, link, target))
                lower[row, link - 3], upper[row, link - 3] = _interval_around(angle, *ends)
                target = target - self.arm.chain[link - 1] * ca.DM([np.cos(angle), np.sin(angle)])
        return lower - to_tool, upper - to_tool

    def inverse(self, point: Matrix, phi: Matrix, elbow: Operand) -> tuple[Matrix, Matrix]:
        """Inverse kinematics (1)-(2), with atan2 where the paper's arccos loses the sign.

        Args:
            point: tool position, (2, 1), m.
            phi: redundancy angles of links 3..k, (k - 2, 1), rad.
            elbow: +1 for up (theta_2 >= 0, the arccos of (1)), -1 for down.

        Returns:
            The joint angles (1, k) in rad, neither wrapped nor limited, and cos(theta_2) of (1): the paper's k_s or
            k_f. The point is reached exactly when its absolute value is at most 1; beyond, the angles are those
            of the stretched or folded arm, so that no NaN appears. Where the second link is the last and carries the
            tool at its side, both elbow and cosine are those of the line to the tool.
        """
        l1, l2 = self.arm.chain[:2]
        wrist = self._wrist(point, phi)
        cosine = (ca.sumsqr(wrist) - l1**2 - l2**2) / (2.0 * l1 * l2)
        clipped = ca.fmin(1.0, ca.fmax(-1.0, cosine))
        sine = elbow * ca.sqrt(1.0 - clipped**2)
        psi_1 = ca.atan2(wrist[1], wrist[0]) - ca.atan2(l2 * sine, l1 + l2 * clipped)
        theta_2 = ca.atan2(sine, clipped)
        if self.arm.has_tool and self.arm.links == 2:
            theta_2 = theta_2 - self.arm.tool_angle
        psi = [psi_1 + theta_2, *(phi[i] for i in range(phi.shape[0]))]
        rest = [after - before for before, after in pairwise(psi)]
        theta_1 = psi_1 if is_zero(self.arm.base_angle) else psi_1 - self.arm.base_angle
        return ca.horzcat(theta_1, theta_2, *rest), cosine

    def project_to_point(self, theta: Matrix, point: Matrix) -> Matrix:
        """The posture nearest ``theta`` (1, k) whose tool is at ``point`` (2, 1) exactly, m.

        Links 3..k keep their orientation, links 1 and 2 close what is left of the way with the same elbow.
        """
        psi = ca.cumsum(theta, 1) + self.arm.base_angle
        elbow = ca.if_else(ca.sin(theta[1] - self.stretched) < 0.0, -1.0, 1.0)
        angles, _ = self.inverse(point, psi[2:].T, elbow)
        return wrap_to(angles, theta)

    def _wrist(self, point: Matrix, phi: Matrix) -> Matrix:
        """The end of link 2 from the base, m, (2, 1), with links 3..k at ``phi`` and the tool at ``point``."""
        wrist = self._from_base(point)
        for i, length in enumerate(self.arm.link_lengths[2:]):
            wrist = wrist - length * ca.vertcat(ca.cos(phi[i]), ca.sin(phi[i]))
        if self.arm.has_tool and self.redundancy:
            wrist = wrist - turned(self.arm.tool_offset, phi[-1]).T
        return wrist

    def _from_base(self, point: Matrix) -> Matrix:
        """The vector from the base to a point, (2, 1), m."""
        return point if is_zero(self.arm.base) else point - ca.vertcat(*self.arm.base)

    def wrap(self, theta: Matrix) -> Matrix:
        """The posture with each angle in its first turn.

        That is (-pi, pi], or, with joint limits, the turn around the middle of the joint's range. (1, k) -> (1, k).
        """
        return wrap_to(theta, self.middle)

    @property
    def middle(self) -> Matrix:
        """The middle of each joint's range, zero without limits; (1, k), rad."""
        if self.arm.joint_limits is None:
            return ca.DM.zeros(1, self.arm.links)
        return ca.horzcat(*((lowest + highest) / 2.0 for lowest, highest in self.arm.joint_limits))

    def wrap_near(self, theta: Matrix, start: Matrix) -> Matrix:
        near = wrap_to(theta, start)
        if self.arm.joint_limits is None:
            return near
        lowest, highest = (ca.horzcat(*bound) for bound in zip(*self.arm.joint_limits, strict=True))
        near = ca.if_else(near > highest, near - 2.0 * pi, near)
        return ca.if_else(near < lowest, near + 2.0 * pi, near)


def _interval_around(angle: float, alpha: float, beta_in: float, beta_out: float) -> tuple[float, float]:
    """The interval of alpha ± [beta_in, beta_out], in the turn nearest ``angle``, on the angle's side of alpha."""
    alpha = float(wrap_to(ca.DM(alpha), ca.DM(angle)))
    if beta_in == 0.0:
        return alpha - beta_out, alpha + beta_out
    return (alpha + beta_in, alpha + beta_out) if angle >= alpha else (alpha - beta_out, alpha - beta_in)

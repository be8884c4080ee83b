"""The planar arm as a chain of rigid bodies: masses of its links, motors, friction, and what the tool carries."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from problems.base.arguments import is_zero
from problems.base.errors import InvalidProblem
from problems.base.matrix import Operand
from problems.base.ranges import ACCELERATIONS, COORDINATES, FRICTIONS, INERTIAS, MASSES, TORQUES, check_within
from problems.robots.planar_links import PlanarLinks
from problems.robots.rigid.inertia import Moments
from problems.robots.rigid.payload import Payload, planar_payload_of
from problems.robots.rigid.rigid_chain import RigidChain, RigidJoint
from problems.robots.rigid.transform import ORIGIN, Transform, about, plus, times
from problems.robots.robot import JointLimits, are_numbers

GRAVITY = (0.0, -9.81)  # m/s^2
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
    gravity: tuple[float, float] = GRAVITY

    @classmethod
    def from_settings(cls, settings: Mapping[str, Any]) -> Self:
        """The arm that a table of a file describes; ``payload`` is a table with mass, center (2) and inertia."""
        gravity = settings.get("gravity", GRAVITY)
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
        """Limits of the joints."""
        return replace(super().limits, torque=self.max_torque)

    @property
    def rigid_chain(self) -> RigidChain | None:
        """The links as bodies that turn about z; None without masses."""
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

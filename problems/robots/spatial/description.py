"""What is known of a robot before a task: chain, frames, spheres and limits, with what is missing named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import TypeAlias

from problems.base.errors import InvalidProblem
from problems.base.ranges import ANGLES
from problems.robots.rigid.inertia import Matrix3, Point3
from problems.robots.rigid.payload import Payload
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.chain import UNTURNED, Chain, ChainJoint, JointKind
from problems.robots.spatial.collision.self_pairs import LinkPairs, self_collision_pairs
from problems.robots.spatial.collision.sphere import Sphere
from problems.robots.spatial.pose import numbers_of
from problems.robots.spatial.spatial_arm import GRAVITY, SpatialArm

PerJoint: TypeAlias = float | Sequence[float]  # one value for all joints, or one for each
Ranges: TypeAlias = Sequence[tuple[float, float]]


@dataclass(frozen=True)
class LinkFrame:
    """A link's frame on the body that carries it.

    Attributes:
        name: of the link.
        body: number of the body: 0 for the base, then that of the joint that moves it.
        translation: of the frame in that of the body, m.
        rotation: the same.
    """

    name: str
    body: int
    translation: Point3 = (0.0, 0.0, 0.0)
    rotation: Matrix3 = UNTURNED

    @classmethod
    def of(cls, name: str, body: int, pose: Transform) -> LinkFrame:
        """The frame with a pose of plain numbers."""
        return cls(name, body, *numbers_of(pose))

    @property
    def pose(self) -> Transform:
        """From the link's frame to the body's."""
        return Transform(self.rotation, self.translation)


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A chain in space with what is known of it.

    Attributes:
        chain: joints, with position limits, speeds, efforts and masses where they are stated.
        links: frames of all links that the chain carries.
        spheres: that hold the collision shapes.
        disabled: names of links that may touch.
        title: what people call the robot; empty where it is not known.
        notes: what is missing or not planned with, a line each.
        max_acceleration: of each joint, rad/s^2 or m/s^2; None where it is not known (a URDF states none).
        max_jerk: rad/s^3 or m/s^3; None where nothing is known to limit it.
    """

    chain: Chain
    links: tuple[LinkFrame, ...]
    spheres: tuple[Sphere, ...] = ()
    disabled: tuple[tuple[str, str], ...] = ()
    title: str = ""
    notes: tuple[str, ...] = ()
    max_acceleration: tuple[float, ...] | None = None
    max_jerk: tuple[float, ...] | None = None

    def frame(self, link: str) -> LinkFrame:
        """The frame of a link.

        Raises:
            KeyError: the chain carries none of that name.
        """
        return {frame.name: frame for frame in self.links}[link]

    def arm(
        self,
        *,
        max_speed: PerJoint | None = None,
        max_acceleration: PerJoint | None = None,
        max_jerk: PerJoint | None = None,
        position_limits: Ranges | None = None,
        max_torque: PerJoint | None = None,
        viscous_friction: PerJoint | None = None,
        coulomb_friction: PerJoint | None = None,
        payload: Payload | None = None,
        gravity: Point3 = GRAVITY,
        spheres: Sequence[Sphere] | None = None,
        kept_pairs: Sequence[tuple[int, int]] = (),
        base: Transform | None = None,
        tool: Transform | None = None,
        margin: float = 0.0,
        self_collision: bool = False,
    ) -> SpatialArm:
        """The robot to plan with; what is given replaces what is known.

        Args:
            max_speed: rad/s or m/s, one value or one a joint.
            max_acceleration: rad/s^2 or m/s^2.
            max_jerk: rad/s^3 or m/s^3.
            position_limits: (lowest, highest) of each joint, rad or m.
            max_torque: N m or N; where None, what is known, if masses are too.
            viscous_friction: N m s or N s/m.
            coulomb_friction: N m or N.
            payload: what the tool carries.
            gravity: m/s^2.
            spheres: instead of its own.
            kept_pairs: numbers of spheres that must keep apart with ``self_collision``.
            base: where it stands.
            tool: from the tool's frame to the tip's.
            margin: what its bodies keep from everything, m.
            self_collision: whether its own bodies must not touch.

        Raises:
            InvalidProblem: a limit is impossible, or missing and not known.
        """
        ranges = self._ranges(position_limits)
        base_translation, base_rotation = numbers_of(base or Transform())
        tool_translation, tool_rotation = numbers_of(tool or Transform())
        return SpatialArm(
            chain=self._limited(ranges).with_friction(
                self._each_or_none("viscous_friction", viscous_friction),
                self._each_or_none("coulomb_friction", coulomb_friction),
            ),
            max_speed=self._each("max_speed", max_speed, [joint.speed for joint in self.chain.joints]),
            max_acceleration=self._each("max_acceleration", max_acceleration, self.max_acceleration),
            max_jerk=self._each_or_none("max_jerk", max_jerk, self.max_jerk),
            position_limits=ranges,
            max_torque=self._torques(max_torque),
            payload=payload,
            gravity=gravity,
            spheres=tuple(self.spheres if spheres is None else spheres),
            base_translation=base_translation,
            base_rotation=base_rotation,
            tool_translation=tool_translation,
            tool_rotation=tool_rotation,
            kept_pairs=tuple(kept_pairs),
            margin=margin,
            self_collision=self_collision,
        )

    def with_disabled(self, pairs: LinkPairs) -> RobotDescription:
        """The same with more links that may touch."""
        return replace(self, disabled=(*self.disabled, *pairs))

    def self_pairs(
        self, arm: SpatialArm, disabled: LinkPairs = (), kept: LinkPairs = ()
    ) -> tuple[tuple[int, int], ...]:
        """Numbers of an arm's spheres that have to keep apart: see :func:`self_collision_pairs`.

        Raises:
            InvalidProblem: as there.
        """
        links = {sphere.name for sphere in arm.spheres}
        known = [pair for pair in self.disabled if links.issuperset(pair)]
        return self_collision_pairs(arm, (*known, *disabled), kept)

    @property
    def drawn(self) -> SpatialArm:
        """The robot where its geometry alone matters; ranges that are not known are half a turn each way, or 1 m."""
        unknown = {True: (-pi, pi), False: (-1.0, 1.0)}
        ranges = [joint.position or unknown[joint.turns] for joint in self.chain.joints]
        return self.arm(max_speed=1.0, max_acceleration=1.0, max_jerk=1.0, position_limits=ranges)

    @property
    def reach(self) -> float:
        """No less than the distance that the tip can have from the base, m."""
        return self.drawn.reach()[1]

    def _each(self, field: str, given: PerJoint | None, known: Sequence[float | None] | None) -> tuple[float, ...]:
        joints = self.chain.joints
        if isinstance(given, (int, float)):
            return (float(given),) * len(joints)
        values = (known if known is not None else [None] * len(joints)) if given is None else given
        for joint, value in zip(joints, values, strict=False):
            if value is None:
                raise InvalidProblem(field, f"missing: none is known for joint {joint.name!r}")
        return tuple(float(value) for value in values if value is not None)

    def _each_or_none(
        self, field: str, given: PerJoint | None, known: Sequence[float | None] | None = None
    ) -> tuple[float, ...] | None:
        return None if given is None and known is None else self._each(field, given, known)

    def _torques(self, given: PerJoint | None) -> tuple[float, ...] | None:
        """Those given; else the efforts, where they and the masses of all joints are known."""
        efforts = [joint.effort for joint in self.chain.joints]
        known = None not in efforts and not self.chain.massless
        return self._each_or_none("max_torque", given, efforts if known else None)

    def _ranges(self, given: Ranges | None) -> tuple[tuple[float, float], ...]:
        joints = self.chain.joints
        if given is not None:
            if len(given) != len(joints):
                raise InvalidProblem("position_limits", f"{len(given)} ranges for {len(joints)} joints")
            return tuple((float(low), float(high)) for low, high in given)
        return tuple(_range(joint) for joint in joints)

    def _limited(self, ranges: tuple[tuple[float, float], ...]) -> Chain:
        """The chain with these ranges: how far a joint slides decides how far its frame can be."""
        pairs = zip(self.chain.joints, ranges, strict=True)
        return replace(
            self.chain,
            joints=tuple(joint if joint.turns else replace(joint, position=bounds) for joint, bounds in pairs),
        )


def _range(joint: ChainJoint) -> tuple[float, float]:
    if joint.kind is JointKind.CONTINUOUS:
        return ANGLES
    if joint.position is None:
        raise InvalidProblem("position_limits", f"missing: none are known for joint {joint.name!r}")
    return joint.position

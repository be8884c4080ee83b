"""A robot as its files describe it: links, joints, the spheres file, and the arm between two of its links."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, TypeAlias

from problems.base import ANGLES, InvalidProblem, shown, toml_tables
from problems.robots.chain import UNTURNED, Chain, ChainJoint, JointKind
from problems.robots.inertia import Payload
from problems.robots.own_pairs import LinkPairs, OwnPairs, own_pairs_of
from problems.robots.spatial_arm import GRAVITY, SpatialArm
from problems.robots.spheres import Ball, Sphere, covered_capsule
from problems.robots.transform import Matrix3, Point3, Transform, numbers_of

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
        unread: links that a joint moves with a file of their collision geometry that is not read.
        max_acceleration: of each joint, rad/s^2 or m/s^2; None where it is not known (a URDF states none).
        max_jerk: rad/s^3 or m/s^3; None where nothing is known to limit it.
    """

    chain: Chain
    links: tuple[LinkFrame, ...]
    spheres: tuple[Sphere, ...] = ()
    disabled: tuple[tuple[str, str], ...] = ()
    title: str = ""
    notes: tuple[str, ...] = ()
    unread: tuple[tuple[str, str], ...] = ()
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

    def own_pairs(self, arm: SpatialArm, disabled: LinkPairs = (), kept: LinkPairs = ()) -> OwnPairs:
        """Which of an arm's spheres have to keep apart: see :func:`own_pairs_of`.

        Raises:
            InvalidProblem: as there.
        """
        links = {sphere.name for sphere in arm.spheres}
        known = [pair for pair in self.disabled if links.issuperset(pair)]
        return own_pairs_of(arm, (*known, *disabled), kept)

    def complete(
        self,
        arm: SpatialArm,
        disabled: LinkPairs = (),
        kept: LinkPairs = (),
        ignored: Sequence[str] = (),
    ) -> SpatialArm:
        """An arm made of this, with the pairs of its spheres and what no verdict on it speaks of.

        Args:
            arm: as :meth:`arm` makes it.
            disabled: names of links that may touch.
            kept: names of links that must not, whatever random postures say.
            ignored: names of links whose geometry is left out.

        Raises:
            InvalidProblem: as :func:`own_pairs_of`; or the geometry of a link that a joint moves was not read, no
                spheres are stated for it, and nobody says that it is to be left out.
        """
        names = [frame.name for frame in self.links]
        unknown = next((link for link in ignored if link not in names), None)
        if unknown is not None:
            raise InvalidProblem("ignore_geometry", f"no link {unknown!r} in the chain; there are {', '.join(names)}")
        arm = replace(arm, spheres=tuple(sphere for sphere in arm.spheres if sphere.name not in ignored))
        covered = {sphere.name for sphere in arm.spheres}
        for link, file in self.unread:
            if link not in covered and link not in ignored:
                cure = f"state spheres for it, or leave it out of every verdict: ignore_geometry = [{link!r}]"
                raise InvalidProblem("urdf", f"link {link!r}: its mesh {file} is not read; {cure}")
        pairs = self.own_pairs(arm, disabled, kept)
        return replace(
            arm,
            kept_pairs=pairs.kept,
            proven_pairs=pairs.far,
            ignored_links=tuple(dict.fromkeys(ignored)),
            left_out=tuple(self._left_out(arm, pairs, disabled, ignored)),
        )

    def _left_out(self, arm: SpatialArm, pairs: OwnPairs, disabled: LinkPairs, ignored: Sequence[str]) -> Iterator[str]:
        covered = {sphere.name for sphere in arm.spheres}
        if ignored:
            yield f"the geometry of {', '.join(dict.fromkeys(ignored))}, which is to be ignored"
        carried = {joint.link for joint in self.chain.joints}
        bare = [f.name for f in self.links if f.name in carried and f.name not in covered and f.name not in ignored]
        if bare:
            yield f"bodies of {', '.join(bare)}: no collision geometry is stated"
        may_touch = [*dict.fromkeys(tuple(sorted(pair)) for pair in (*self.disabled, *disabled))]
        may_touch = [pair for pair in may_touch if covered.issuperset(pair)]
        if may_touch:
            yield f"own links that may touch: {', '.join(' and '.join(pair) for pair in may_touch)}"
        spheres = arm.spheres
        together = dict.fromkeys(tuple(sorted((spheres[a].name, spheres[b].name))) for a, b in pairs.together)
        if together:
            yield f"own spheres that touch at nearly every posture: {', '.join(' and '.join(p) for p in together)}"
        if arm.max_torque is None and self.chain.massless:
            yield f"torques: no masses are stated for {', '.join(self.chain.massless)}"

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


MOST_CHARACTERS = 1_000_000
MOST_SPHERES = 1_000
FARTHEST = 1e4  # m
KEYS = {"spheres": {"link", "center", "radius"}, "capsules": {"link", "start", "end", "radius"}}


def read_spheres(text: str, links: Sequence[LinkFrame]) -> tuple[Sphere, ...]:
    """The spheres that a file states, on the bodies that carry their links.

    Args:
        text: of the file. Centers and ends are in the frames of their links, m.
        links: that the robot has.

    Returns:
        Spheres in the order of the file; those that hold its capsules follow.

    Raises:
        InvalidProblem: ``spheres`` is impossible, with the reason in one line.
    """
    frames = {frame.name: frame for frame in links}
    spheres: list[Sphere] = []
    for kind, entry, owner in _entries(_tables(text)):
        frame = frames.get(entry["link"]) if isinstance(entry["link"], str) else None
        if frame is None:
            raise _wrong(f"{owner}: no link {entry['link']!r} in the chain; there are {', '.join(frames)}")
        radius = _length(entry["radius"], f"{owner}: radius")
        if kind == "spheres":
            balls: Sequence[Ball] = (Ball(_point(entry["center"], f"{owner}: center"), radius),)
        else:
            start, end = (_point(entry[key], f"{owner}: {key}") for key in ("start", "end"))
            balls = covered_capsule(start, end, radius)
        moved = (ball.seen_from(frame.pose) for ball in balls)
        spheres += [Sphere(frame.body, ball.center, ball.radius, frame.name) for ball in moved]
        if len(spheres) > MOST_SPHERES:
            raise _wrong(f"more than {MOST_SPHERES}")
    return tuple(spheres)


def _tables(text: str) -> dict[str, Any]:
    if len(text) > MOST_CHARACTERS:
        raise _wrong(f"{len(text)} characters, of at most {MOST_CHARACTERS}")
    try:
        tables = toml_tables(text)
    except ValueError as error:
        raise _wrong(str(error)) from error
    unknown = next((key for key in tables if key not in KEYS), None)
    if unknown is not None:
        raise _wrong(f"unknown key {unknown!r}; there are {', '.join(KEYS)}")
    if not any(tables.values()):
        raise _wrong("neither [[spheres]] nor [[capsules]]")
    return tables


def _entries(tables: dict[str, Any]) -> Sequence[tuple[str, dict[str, Any], str]]:
    """Kind, table and name of every entry, spheres first."""
    entries = []
    for kind, keys in KEYS.items():
        listed = tables.get(kind, [])
        if not isinstance(listed, list):
            raise _wrong(f"[[{kind}]] is a list of tables")
        for number, entry in enumerate(listed, start=1):
            owner = f"{kind[:-1]} {number}"
            if not isinstance(entry, dict) or set(entry) != keys:
                raise _wrong(f"{owner}: needs {', '.join(sorted(keys))} and nothing else")
            entries.append((kind, entry, owner))
    return entries


def _wrong(reason: str) -> InvalidProblem:
    return InvalidProblem("spheres", reason)


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _wrong(f"{what}: a number is needed, not {str(value)[:40]!r}")
    if not abs(value) <= FARTHEST:
        raise _wrong(f"{what}: {shown(value)} is not within {FARTHEST:g} m")
    return float(value)


def _length(value: Any, what: str) -> float:
    length = _number(value, what)
    if not length > 0.0:
        raise _wrong(f"{what}: {length:g} m is not above 0")
    return length


def _point(value: Any, what: str) -> Point3:
    if not isinstance(value, list) or len(value) != 3:
        raise _wrong(f"{what}: three coordinates are needed")
    x, y, z = (_number(part, what) for part in value)
    return x, y, z

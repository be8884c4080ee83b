"""A robot as its files describe it: links, joints, collision geometry, and the arm between two of its links."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, fields, replace
from math import pi
from typing import TypeAlias

from problems.base import ANGLES, InvalidProblem, tell_step
from problems.evaluation import processors
from problems.library import needed_core
from problems.robots.appearance import LinkAppearance, Parts, Visual, new_appearances, placed_appearances
from problems.robots.carried import Carried
from problems.robots.chain import Chain, ChainJoint, JointKind, LinkFrame, OffChainJoint
from problems.robots.inertia import Payload, moved_inertia
from problems.robots.link_covers import (
    SETTINGS,
    LinkCover,
    MeshNote,
    ReadFile,
    cover_link,
    searched_balls,
)
from problems.robots.shapes import MeshShape, Shape
from problems.robots.spatial_arm import GRAVITY, SpatialArm
from problems.robots.spheres import Ball, Sphere
from problems.robots.spheres_file import MOST_SPHERES
from problems.robots.tracking import TrackingError
from problems.robots.transform import UNMOVED, FixedFrame, Point3, Transform

PerJoint: TypeAlias = float | Sequence[float]  # one value for all joints, or one for each
Ranges: TypeAlias = Sequence[tuple[float, float]]


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """A chain in space and everything that is known of it.

    Attributes:
        chain: joints, with position limits, speeds, efforts and masses where they are stated.
        links: frames of all links that the chain carries.
        shapes: of the links' collision geometry, by their names.
        covers: of links, by their names: of meshes, or finer than the spheres.
        visuals: what is shown of links, by their names.
        unseen: links with something to be shown that cannot be read, and why.
        appearances: of links, on the bodies that carry them.
        carried: names of the links that the tool holds.
        spheres: that hold the collision geometry, as far as it is known, for searches.
        disabled: names of links that may touch.
        postures: of all joints, rad or m, by their names.
        title: what people call the robot; empty where it is not known.
        notes: what is missing or not planned with, a line each.
        unread: links with a file of their collision geometry that is not read.
        off_chain: joints that carry some of the links and are not planned with.
        locked: joints that are not planned with, and where each stands, rad or m.
        apart: links with collision geometry that no joint connects with the chain.
        max_acceleration: of each joint, rad/s^2 or m/s^2; None where it is not known (a URDF states none).
        max_jerk: rad/s^3 or m/s^3; None where nothing is known to limit it.
    """

    chain: Chain
    links: tuple[LinkFrame, ...]
    shapes: tuple[tuple[str, tuple[Shape, ...]], ...] = ()
    covers: tuple[LinkCover, ...] = ()
    visuals: tuple[tuple[str, tuple[Visual, ...]], ...] = ()
    unseen: tuple[tuple[str, str], ...] = ()
    appearances: tuple[LinkAppearance, ...] = ()
    carried: tuple[str, ...] = ()
    spheres: tuple[Sphere, ...] = ()
    disabled: tuple[tuple[str, str], ...] = ()
    postures: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    title: str = ""
    notes: tuple[str, ...] = ()
    unread: tuple[tuple[str, str], ...] = ()
    off_chain: tuple[OffChainJoint, ...] = ()
    locked: tuple[tuple[str, float], ...] = ()
    apart: tuple[str, ...] = ()
    max_acceleration: tuple[float | None, ...] | None = None
    max_jerk: tuple[float | None, ...] | None = None

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
        base: Transform = UNMOVED,
        tool: Transform = UNMOVED,
        self_margin: float = 0.0,
        tracking: Mapping[str, PerJoint] | None = None,
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
            base: where it stands.
            tool: from the tool's frame to the tip's.
            self_margin: what links with covers keep from each other, m.
            tracking: parts of a :class:`TrackingError` by their names, one value or one a joint, zero where left out.

        Raises:
            InvalidProblem: a limit is impossible, or missing and not known.
        """
        ranges = self._ranges(position_limits)
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
            base_frame=FixedFrame.of(base),
            tool_in_tip=FixedFrame.of(tool),
            self_margin=self_margin,
            appearances=self.appearances,
            carried=self.carried,
            locked=self.locked,
            tracking=None if tracking is None else self._tracking(tracking),
        )

    def _tracking(self, stated: Mapping[str, PerJoint]) -> TrackingError:
        parts = (part.name for part in fields(TrackingError))
        return TrackingError(**{name: self._each("tracking_error", stated.get(name, 0.0), None) for name in parts})

    def with_covers(self, covers: Mapping[str, LinkCover]) -> RobotDescription:
        """The description with covers of links by name, and the spheres that these and the shapes make.

        Raises:
            InvalidProblem: ``urdf`` needs more spheres than there may be.
        """
        frames = {frame.name: frame for frame in self.links}
        covered = replace(self, covers=tuple(covers[link] for link, _ in self.shapes if link in covers))
        spheres = tuple(ball.seen_from(frames[link].pose).on(frames[link].body, link) for link, ball in covered.balls)
        if len(spheres) > MOST_SPHERES:
            reason = f"{len(spheres)} spheres cover its collision shapes, of at most {MOST_SPHERES}: give spheres"
            raise InvalidProblem("urdf", reason)
        meshes = ((link, shape.mesh) for link, shapes in self.shapes if link not in covers for shape in shapes)
        unread = tuple((link, mesh.file) for link, mesh in meshes if mesh is not None)
        return replace(covered, spheres=spheres, unread=unread)

    @property
    def balls(self) -> Iterator[tuple[str, Ball]]:
        """The balls for searches, in the frames of the links that are named with them."""
        covers = {cover.link: cover for cover in self.covers}
        return ((link, ball) for link, shapes in self.shapes for ball in searched_balls(shapes, covers.get(link)))

    def carrying(self, carried: Sequence[Carried], tool: Transform) -> RobotDescription:
        """The description with bodies on its tools, as links of the bodies that carry these.

        Args:
            carried: the bodies, in the frames of their tools.
            tool: from the frame of the first tool to the tip's.

        Raises:
            InvalidProblem: ``carried`` has a name that another link has, cannot be covered, or is of no tip.
        """
        names = [frame.name for frame in self.links]
        double = next((part.name for part in carried if part.name in names), None)
        if double is not None:
            raise InvalidProblem("carried", f"the robot has a link {double!r}: state another name")
        frames = [self._frame_of(part, tool) for part in carried]
        chain = self.chain
        for part, frame in zip(carried, frames, strict=True):
            if frame.body != chain.carrier:  # the weight of all others is that of the payload
                chain = chain.loaded(frame.body, moved_inertia(part.inertia, frame.pose))
        balls = [
            ball.seen_from(frame.pose).on(frame.body, frame.name)
            for frame, part in zip(frames, carried, strict=True)
            for ball in searched_balls(part.shapes, None)
        ]
        seen = placed_appearances(frames, {part.name: part.appearances for part in carried}) if self.appearances else ()
        held = replace(
            self,
            chain=chain,
            links=(*self.links, *frames),
            spheres=(*self.spheres, *balls),
            appearances=(*self.appearances, *seen),
            carried=(*self.carried, *(part.name for part in carried)),
        )
        if not self.covers:
            return held
        covers = [cover_link(part.name, part.shapes, _no_file, SETTINGS.coarse_overhang)[0] for part in carried]
        shapes = [(part.name, part.shapes) for part in carried]
        return replace(held, shapes=(*self.shapes, *shapes), covers=(*self.covers, *covers))

    def _frame_of(self, part: Carried, tool: Transform) -> LinkFrame:
        """The frame of a carried body, which is that of the tool that holds it."""
        chain = self.chain
        try:
            tip = chain.tip_named(part.tip) if part.tip else None
        except InvalidProblem as error:
            raise InvalidProblem("carried", error.reason) from error
        if tip is None or tip.link == chain.tip_link:
            return LinkFrame(part.name, chain.carrier, FixedFrame.of(chain.tip @ tool))
        return LinkFrame(part.name, tip.body, tip.frame)

    def with_spheres(self, spheres: tuple[Sphere, ...]) -> RobotDescription:
        """The description with spheres in the place of all others, and of covers."""
        stated = {sphere.name for sphere in spheres}
        unread = tuple((link, file) for link, file in self.unread if link not in stated)
        return replace(self, spheres=spheres, covers=(), unread=unread)

    def new_covers(
        self,
        read: ReadFile,
        overhang: float | None = None,
        fine_overhang: float | None = None,
        ignored: Collection[str] = (),
    ) -> tuple[dict[str, LinkCover], list[MeshNote]]:
        """Covers of all links whose geometry is more than balls, by name; notes on their meshes.

        Args:
            read: the content of a mesh's file.
            overhang: of the balls for searches, m; 20 mm, or 3 % of the reach where that is less, if None.
            fine_overhang: of the balls for proofs, m; 2 mm if None.
            ignored: names of links that are left out.

        Raises:
            InvalidProblem: ``urdf`` names a mesh of a link that a joint moves and that cannot be read or covered, with
                the reason in one line.
        """
        used = min(SETTINGS.coarse_overhang, SETTINGS.coarse_share * self.reach) if overhang is None else overhang
        fine = SETTINGS.fine_overhang if fine_overhang is None else fine_overhang
        stands = {frame.name: frame.body == 0 for frame in self.links}
        links = [
            (link, shapes)
            for link, shapes in self.shapes
            if link not in ignored and any(shape.mesh is not None or len(shape.triangles) for shape in shapes)
        ]
        if links:
            needed_core()  # made once, not by each thread
        covers, notes = {}, []
        with ThreadPoolExecutor(processors()) as pool:
            each = [pool.submit(cover_link, *link, read, used, fine, stands[link[0]]) for link in links]
            for done, ((link, _), cover) in enumerate(zip(links, each, strict=True)):
                tell_step("covering links", done, len(links))
                try:
                    covers[link], own = cover.result()
                    notes += own
                except InvalidProblem:
                    if not stands[link]:
                        pool.shutdown(cancel_futures=True)
                        raise
        tell_step("covering links", len(links), len(links))
        return covers, notes

    def new_appearances(self, read: ReadFile) -> tuple[dict[str, Parts], list[MeshNote]]:
        """Appearances of links by name: of what is shown of them, or else their collision geometry.

        Args:
            read: the content of a mesh's file.

        Returns:
            Looks, and notes on what cannot be shown.
        """
        following = {link: joint.leader for joint in self.off_chain if joint.leader for link in joint.links}
        visuals = {link: parts for link, parts in self.visuals if link not in following}
        shapes = {link: parts for link, parts in self.shapes if link not in following}
        appearances, notes = new_appearances(visuals, shapes, read)
        unseen = [*self.unseen, *((link, f"it moves with joint {leader!r}") for link, leader in following.items())]
        return appearances, [*(MeshNote(link, "", reason) for link, reason in unseen), *notes]

    def with_appearances(self, appearances: Mapping[str, Parts]) -> RobotDescription:
        """The description with appearances of links, by their names."""
        return replace(self, appearances=placed_appearances(self.links, appearances))

    @property
    def gaps(self) -> list[str]:
        """Lines on what is not known of the joints."""
        joints = self.chain.joints
        ranged = [joint for joint in joints if joint.kind is not JointKind.CONTINUOUS]
        missing = {
            "position limits": [joint.name for joint in ranged if joint.position is None],
            "velocity": [joint.name for joint in joints if joint.speed is None],
            "effort": [joint.name for joint in joints if joint.effort is None],
        }
        return [f"no {what} stated for {', '.join(names)}" for what, names in missing.items() if names]

    @property
    def drawn(self) -> SpatialArm:
        """The robot where its geometry alone matters; unknown ranges are half a turn each way, or 1 m."""
        unknown = {True: (-pi, pi), False: (-1.0, 1.0)}
        ranges = [joint.position or unknown[joint.turns] for joint in self.chain.joints]
        return self.arm(max_speed=1.0, max_acceleration=1.0, max_jerk=1.0, position_limits=ranges)

    @property
    def reach(self) -> float:
        """A bound of the distance that the tip can have from the base, m."""
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
        """The given torques; else the efforts, where they and the masses of all joints are known and possible."""
        efforts = [joint.effort for joint in self.chain.joints]
        known = None not in efforts and not self.chain.torque_gap
        return self._each_or_none("max_torque", given, efforts if known else None)

    def _ranges(self, given: Ranges | None) -> tuple[tuple[float, float], ...]:
        joints = self.chain.joints
        if given is not None:
            if len(given) != len(joints):
                raise InvalidProblem("position_limits", f"{len(given)} ranges for {len(joints)} joints")
            return tuple((float(low), float(high)) for low, high in given)
        return tuple(_range(joint) for joint in joints)

    def _limited(self, ranges: tuple[tuple[float, float], ...]) -> Chain:
        """The chain with these ranges, as sliding ranges decide how far a frame can be."""
        pairs = zip(self.chain.joints, ranges, strict=True)
        return replace(
            self.chain,
            joints=tuple(joint if joint.turns else replace(joint, position=bounds) for joint, bounds in pairs),
        )


def _no_file(shape: MeshShape) -> bytes:
    raise NotImplementedError(f"{shape.file}: what is carried has its triangles")


def _range(joint: ChainJoint) -> tuple[float, float]:
    if joint.kind is JointKind.CONTINUOUS:
        return ANGLES
    if joint.position is None:
        raise InvalidProblem("position_limits", f"missing: none are known for joint {joint.name!r}")
    return joint.position

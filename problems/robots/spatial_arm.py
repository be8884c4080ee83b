"""The arm in space: a chain with limits and bodies, as a robot of a planning problem."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from dataclasses import field as stated
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import (
    ACCELERATIONS,
    ANGLES,
    COORDINATES,
    LENGTHS,
    RATES,
    TORQUES,
    FloatArray,
    InvalidProblem,
    Matrix,
    as_array,
    check_within,
)
from problems.robots.appearance import LinkAppearance
from problems.robots.arm_cover import ArmCover
from problems.robots.bodies import Bodies, Body, BodyPairs
from problems.robots.chain import Chain, Tip
from problems.robots.dynamics import RigidChain
from problems.robots.inertia import Moments, Payload, moved_inertia
from problems.robots.joints import JointLimits, Joints
from problems.robots.robot import Robot
from problems.robots.spheres import Sphere
from problems.robots.tool import ArmTool
from problems.robots.tracking import MOST_TOGETHER, TrackingError
from problems.robots.transform import UNMOVED, FixedFrame, Point3, Transform, as_rows

GRAVITY: Point3 = (0.0, 0.0, -9.81)  # m/s^2


@dataclass(frozen=True)
class LeftOut:
    """Links, contacts and other things of an arm of which no verdict speaks.

    Attributes:
        links: whose geometry is left out because the user says so.
        contacts: own links that need not keep apart, and why, a line each.
        others: what else is left out, a line each.
    """

    links: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


@dataclass(frozen=True, repr=False)
class SpatialArm(Robot):
    """An arm in space, or several on one base.

    Args:
        chain: its joints.
        max_speed: of each joint, rad/s or m/s; dof values.
        max_acceleration: rad/s^2 or m/s^2.
        max_jerk: rad/s^3 or m/s^3; None where nothing limits it.
        position_limits: (lowest, highest) of each joint, rad or m.
        spheres: that hold all bodies that must not touch anything.
        base_frame: where the base stands.
        tool_in_tip: where the tool is in the frame of the chain's tip.
        kept_pairs: of numbers of spheres that must keep apart with ``self_collision``.
        proven_pairs: of numbers of spheres that a verdict looks at besides: those that came together at no random
            posture, so that a search leaves them out.
        cover: of its links for proofs, where that is finer than the spheres; None where the spheres are all there is.
        self_margin: what links with a cover keep from each other with ``self_collision``, m: no more than they can, as
            neighbours of neighbours are near each other in every posture.
        left_out: what no verdict speaks of.
        max_torque: N m or N; None where nothing limits it.
        payload: what the tool carries; None for nothing.
        gravity: m/s^2, as seen from outside.
        carried: names of spheres, and of links of the cover, that the tool holds.
        locked: joints that are not planned with, and where each stands, rad or m, as recordings name them too.
        appearances: of its links; decoration, which no comparison counts.
        statement: the table of a scenario that the arm was built from, by which a plan is stored; None of another one.
        tracking: how far its joints may be from where they are planned; None where they follow exactly.

    Raises:
        InvalidProblem: a limit is not positive or out of range, a list is not dof long, or something is stated that
            only masses give an effect, which are not known.
    """

    numbers: ClassVar[tuple[str, ...]] = (
        *Robot.numbers, "max_speed", "max_acceleration", "max_jerk", "position_limits", "max_torque"
    )  # fmt: skip
    inert: ClassVar[tuple[str, ...]] = ("locked", "appearances", "statement")
    angular: ClassVar[tuple[str, ...]] = ("max_speed", "max_acceleration", "max_jerk", "position_limits")
    range_field: ClassVar[str] = "position_limits"

    chain: Chain
    max_speed: tuple[float, ...]
    max_acceleration: tuple[float, ...]
    max_jerk: tuple[float, ...] | None = None
    position_limits: tuple[tuple[float, float], ...] | None = None
    spheres: tuple[Sphere, ...] = ()
    base_frame: FixedFrame = UNMOVED
    tool_in_tip: FixedFrame = UNMOVED
    kept_pairs: tuple[tuple[int, int], ...] = ()
    proven_pairs: tuple[tuple[int, int], ...] = ()
    cover: ArmCover | None = None
    self_margin: float = 0.0
    left_out: LeftOut = LeftOut()
    max_torque: tuple[float, ...] | None = None
    payload: Payload | None = None
    gravity: Point3 = GRAVITY
    carried: tuple[str, ...] = ()
    locked: tuple[tuple[str, float], ...] = stated(default=(), compare=False)
    appearances: tuple[LinkAppearance, ...] = stated(default=(), compare=False)
    statement: Any = stated(default=None, compare=False, repr=False)
    tracking: TrackingError | None = None

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.chain.name}: {self.dof} joints>"

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_rates()
        self._check_ranges()
        self._check_tracking()
        self._check_dynamics()
        check_within("base", self.base_frame.translation, COORDINATES, "m")
        check_within("tool", self.tool_in_tip.translation, COORDINATES, "m")
        check_within("self_margin", (self.self_margin,), (0.0, COORDINATES[1]), "m")
        check_within("spheres", (sphere.radius for sphere in self.spheres), LENGTHS, "m")

    def _check_rates(self) -> None:
        for field, bounds, unit in (
            ("max_speed", RATES, "rad/s"),
            ("max_acceleration", RATES, "rad/s^2"),
            ("max_jerk", RATES, "rad/s^3"),
            ("max_torque", TORQUES, "N m"),
        ):
            values = getattr(self, field)
            if values is not None:
                self._check_length(field, values)
                check_within(field, values, bounds, unit)

    def _check_ranges(self) -> None:
        if self.position_limits is None:
            return
        self._check_length("position_limits", self.position_limits)
        for number, (low, high) in enumerate(self.position_limits, start=1):
            check_within("position_limits", (low, high), ANGLES, "rad")
            if not low < high:
                raise InvalidProblem("position_limits", f"joint {number}: {low:g} is not below {high:g}")

    def _check_tracking(self) -> None:
        if self.tracking is None:
            return
        for part in fields(self.tracking):
            self._check_length("tracking_error", getattr(self.tracking, part.name))
        errors = self.tracking.most(self.max_speed, self.max_acceleration)
        together = sum(error for error, joint in zip(errors, self.chain.joints, strict=True) if joint.turns)
        if not together <= MOST_TOGETHER:
            reason = f"{together:.3g} rad of all joints together at their fastest, more than {MOST_TOGETHER:g} rad"
            raise InvalidProblem("tracking_error", reason)
        for number, (low, high) in enumerate(self.limits.position or (), start=1):
            if not low < high:
                reason = f"joint {number}: {errors[number - 1]:.3g} on both sides leave nothing of its range"
                raise InvalidProblem("tracking_error", reason)

    @property
    def joint_errors(self) -> tuple[Any, ...] | None:
        return None if self.tracking is None else self.tracking.most(self.max_speed, self.max_acceleration)

    def within(self, errors: tuple[float, ...]) -> SpatialArm:
        if self.tracking is None:
            return replace(self, tracking=TrackingError(errors, *[(0.0,) * self.dof] * 2))
        both = tuple(a + b for a, b in zip(self.tracking.constant, errors, strict=True))
        return replace(self, tracking=replace(self.tracking, constant=both))

    @property
    def at_any_speed(self) -> SpatialArm:
        if self.joint_errors is None:
            return self
        return replace(self, tracking=TrackingError(self.joint_errors, *[(0.0,) * self.dof] * 2))

    @property
    def assumed(self) -> str:
        parts = [f"without the geometry of {', '.join(self.left_out.links)}"] if self.left_out.links else []
        if self.joint_errors is not None:
            most = dict.fromkeys(self.joints.units, 0.0)
            for unit, error in zip(self.joints.units, self.joint_errors, strict=True):
                most[unit] = max(most[unit], float(error))
            errors = " and ".join(f"{error:.3g} {unit}" for unit, error in most.items() if error > 0.0)
            parts.append(f"within a tracking error of {errors}")
        return " ".join(parts)

    def _check_dynamics(self) -> None:
        check_within("gravity", self.gravity, ACCELERATIONS, "m/s^2")
        for field in ("max_torque", "payload"):
            if getattr(self, field) is not None:
                self.chain.check_masses(field)

    def _check_length(self, field: str, values: tuple[object, ...]) -> None:
        if len(values) != self.dof:
            raise InvalidProblem(field, f"{len(values)} values for {self.dof} joints")

    @property
    def dim(self) -> int:
        return 3

    @property
    def dof(self) -> int:
        return len(self.chain.joints)

    @property
    def limits(self) -> JointLimits:
        return JointLimits(
            speed=self.max_speed,
            acceleration=self.max_acceleration,
            position=self._ranges,
            jerk=self.max_jerk,
            torque=self.max_torque,
        )

    @property
    def _ranges(self) -> tuple[tuple[float, float], ...] | None:
        """Planned ranges, (lowest, highest) of each joint, so that a joint that is off is within its limits."""
        errors = self.joint_errors
        if self.position_limits is None or errors is None:
            return self.position_limits
        own = zip(self.position_limits, errors, strict=True)
        return tuple((low + error, high - error) for (low, high), error in own)

    @property
    def rigid_chain(self) -> RigidChain | None:
        """Joints with regrouped masses, the payload on the body that carries the tool; None if a mass is not known."""
        if self.chain.massless:
            return None
        turned, carrier = Transform(self.base_frame.rotation), self.chain.carrier - 1
        joints = [joint if joint.parent else replace(joint, pose=turned @ joint.pose) for joint in self.chain.rigid]
        if self.payload is not None:
            carried = Moments.of(self.payload, self.tool.frame)
            joints[carrier] = replace(joints[carrier], moments=joints[carrier].moments + carried)
        return RigidChain(joints=tuple(joints), gravity=self.gravity)

    @property
    def joints(self) -> Joints:
        names = tuple(joint.name for joint in self.chain.joints)
        units = tuple("rad" if joint.turns else "m" for joint in self.chain.joints)
        return Joints(names=names, identifiers=names, units=units, base=self.chain.base_link)

    @property
    def by_tool(self) -> tuple[Robot, ...]:
        return tuple(self.at_tips.values()) or (self,)

    @property
    def arms(self) -> Mapping[str, tuple[int, ...]]:
        return self.chain.branches

    @property
    def base(self) -> tuple[float, ...]:
        return tuple(float(part) for part in self.base_frame.translation)

    @cached_property
    def tool(self) -> ArmTool:
        return ArmTool(self.chain, self.base_frame, self.chain.tip @ self.tool_in_tip)

    @cached_property
    def at_tips(self) -> dict[str, SpatialArm]:
        """The robot with each of its tips as its tool, by the tips' names; none of a chain."""
        own = self.chain.tip_link
        return {
            tip.name: self
            if tip.link == own
            else replace(self, chain=self.chain.ended_at(tip), tool_in_tip=UNMOVED, payload=None)
            for tip in self.chain.tips
        }

    def with_tool_at(self, tip: str) -> SpatialArm:
        """The robot with another of its tips as its tool; the payload stays where it is.

        Raises:
            InvalidProblem: there is no such tip.
        """
        other = self.at_tips[self.chain.tip_named(tip).name]
        if self.payload is None or other is self:
            return other
        load = moved_inertia(self.payload, self.tool.frame)
        return replace(other, chain=other.chain.loaded(self.chain.carrier, load))

    def seen_from(self, tip: str) -> SpatialArm:
        """The joints and the tool of this robot, without bodies, in the frame of one of its tips.

        Raises:
            InvalidProblem: there is no such tip, or other than one first joint moves it.
        """
        return SpatialArm(
            self.chain.seen_from(self.chain.tip_named(tip)),
            self.max_speed,
            self.max_acceleration,
            position_limits=self.position_limits,
            tool_in_tip=self.tool_in_tip,
        )

    @property
    def tool_tip(self) -> str:
        """The name of the tip that carries the tool; empty where there is one alone."""
        return next((tip.name for tip in self.chain.tips if tip.link == self.chain.tip_link), "")

    @cached_property
    def geometry(self) -> SpatialArm:
        """The plain numbers that decide where its tool is, the same in its symbolic copy."""
        ones = (1.0,) * self.dof
        return SpatialArm(self.chain, ones, ones, base_frame=self.base_frame, tool_in_tip=self.tool_in_tip)

    def positions(self, theta: Matrix) -> tuple[Matrix, ...]:
        """Base, joints, centres of the spheres, four points of each tip, tool: matrices (n, 3), m."""
        frames, rows = self.chain.frames(theta, self.base_frame), theta.shape[0]
        points = [frame.translation for frame in frames]
        points += [frames[sphere.link].apply(sphere.center) for sphere in self.spheres]
        points += [frames[tip.body].apply(point) for tip in self.chain.tips for point in tip.points]
        points.append(frames[self.chain.carrier].apply(self.tool.frame.translation))
        return tuple(as_rows(point, rows) for point in points)

    def body_frames(self, theta: FloatArray) -> FloatArray:
        """Origin, m, and axes in rows of the base's frame and of those of all joints: (n, dof + 1, 4, 3)."""
        frames, rows = self.chain.frames(ca.DM(theta), self.base_frame), len(theta)
        origins = [as_array(as_rows(frame.translation, rows))[:, None] for frame in frames]
        axes = [[entry for row in frame.rotation for entry in row] for frame in frames]
        turned = [as_array(as_rows(entries, rows)).reshape(-1, 3, 3).swapaxes(1, 2) for entries in axes]
        return np.stack([np.concatenate(pair, axis=1) for pair in zip(origins, turned, strict=True)], axis=1)

    def skeleton(self, theta: FloatArray | Matrix) -> FloatArray:
        """Positions of base, joints and tool along lines between them: (n, p, 3), m; p = dof + 2 of a chain.

        Of several tips a line to each, that to the one which carries the tool last.
        """
        angles, tips = ca.DM(theta), self._drawn_tips
        frames = self.chain.frames(angles, self.base_frame)
        points = [] if tips else [*(frames[body].translation for body in self.chain.walk), frames[0].translation]
        for tip in tips:
            points += [frames[0].apply(tip.base), *(frames[body].translation for body in self._branch_of(tip))]
            points += [frames[tip.body].apply(tip.frame.translation)]
        points[-1] = frames[self.chain.carrier].apply(self.tool.frame.translation)
        return np.stack([as_array(as_rows(point, angles.shape[0])) for point in points], axis=1)

    @property
    def strokes(self) -> tuple[slice, ...]:
        ends = [0, *accumulate(len(self._branch_of(tip)) + 2 for tip in self._drawn_tips)]
        return tuple(slice(*pair) for pair in pairwise(ends)) or (slice(None),)

    @property
    def _drawn_tips(self) -> list[Tip]:
        """The tips, the one that carries the tool last."""
        return sorted(self.chain.tips, key=lambda tip: tip.link == self.chain.tip_link)

    def _branch_of(self, tip: Tip) -> list[int]:
        return self.chain.above(tip.body)[::-1]

    @cached_property
    def bodies(self) -> ArmBodies:
        first = self.dof + 1
        each = (
            Body(sphere.name, first + number, first + number, sphere.radius)
            for number, sphere in enumerate(self.spheres)
        )
        return ArmBodies(tuple(each), self)

    def reach(self, links: int | None = None) -> tuple[float, float]:
        """The least distance, 0, and a bound of the distance in m of a frame of :meth:`positions` from the base."""
        return 0.0, float(self._farthest[-1 if links is None else links])

    @cached_property
    def _farthest(self) -> FloatArray:
        joints = self.chain.extents
        spheres = [joints[sphere.link] + float(np.linalg.norm(sphere.center)) for sphere in self.spheres]
        tips = [joints[tip.body] + float(np.linalg.norm(point)) for tip in self.chain.tips for point in tip.points]
        return np.array([*joints, *spheres, *tips, joints[self.chain.carrier] + self.tool.distance])

    def tip_places(self, tip: str) -> slice:
        """The numbers among :meth:`positions` of the four points of a tip: its origin, and 1 m along its axes.

        Raises:
            InvalidProblem: there is no such tip.
        """
        first = self.dof + 1 + len(self.spheres) + 4 * self.chain.tips.index(self.chain.tip_named(tip))
        return slice(first, first + 4)

    @property
    def touching(self) -> Self:
        return replace(self, margin=0.0, self_margin=0.0)

    @property
    def unjudged(self) -> tuple[str, ...]:
        """Lines on what is left out, own links that are not compared, and contacts that are allowed."""
        several = len(self.bodies.names) > 1
        unwatched = ("own links from each other: self_collision is off",) if several else ()
        own = self.left_out.contacts if self.self_collision else unwatched
        return (*self.left_out.others, *own, *super().unjudged)


@dataclass(frozen=True)
class ArmBodies(Bodies):
    """The spheres of an arm in space.

    Args:
        arm: that has them.
    """

    arm: SpatialArm

    @property
    def names(self) -> tuple[str, ...]:
        """The names of spheres and of links of the cover, each once."""
        covered = () if self.arm.cover is None else (link.name for link in self.arm.cover.links)
        return tuple(dict.fromkeys((*super().names, *covered)))

    def number_of(self, body: Body) -> int:
        return body.start - self.arm.dof - 1

    @property
    def turns(self) -> FloatArray:
        return np.eye(self.arm.dof)

    @cached_property
    def levers(self) -> FloatArray:
        """The largest distances of sphere centres from each joint's axis, (spheres, dof), m; 1 if it slides."""
        spheres, chain = self.arm.spheres, self.arm.chain
        links = np.array([sphere.link for sphere in spheres], dtype=np.intp)
        centers = np.array([sphere.center for sphere in spheres], dtype=float).reshape(-1, 3)
        found = np.empty((links.size, self.arm.dof))
        for link in np.unique(links).tolist():
            found[links == link] = chain.levers(link, centers[links == link])
        return found

    def motion(self, body: Body, seen_from: Body | None = None) -> tuple[FloatArray, FloatArray]:
        """How fast a body can move, as seen from outside or from another body."""
        if seen_from is None:
            return super().motion(body)
        both = [(each, self.moved_by(each)) for each in (body, seen_from)]
        common = self.arm.chain.common(*(moved for _, moved in both))
        moving = {
            above - 1: self.levers[self.number_of(each), above - 1]
            for each, moved in both
            for above in self.arm.chain.above(moved, common)
        }
        between = sorted(moving)
        return self.turns[between], np.array([moving[joint] for joint in between])

    def moved_by(self, body: Body) -> int:
        return self.arm.spheres[self.number_of(body)].link

    @cached_property
    def pairs(self) -> BodyPairs:
        """Pairs of ``kept_pairs``, that nearer the base first; where a cover decides, of what surely lies in them."""
        bodies = self.each if self.arm.cover is None else tuple(map(self.among_own, self.inner))
        return self._outward(self.arm.kept_pairs, bodies)

    @cached_property
    def proven_pairs(self) -> BodyPairs:
        """Pairs of ``kept_pairs`` and ``proven_pairs``."""
        return self._outward((*self.arm.kept_pairs, *self.arm.proven_pairs), self.each)

    def _outward(self, numbers: Iterable[tuple[int, int]], bodies: tuple[Body, ...]) -> BodyPairs:
        """Pairs of spheres by their numbers, the one nearer the base first."""
        pairs = (sorted(pair, key=lambda number: self.arm.spheres[number].link) for pair in numbers)
        return tuple((bodies[one], bodies[two]) for one, two in pairs)

    @cached_property
    def inner(self) -> tuple[Body, ...]:
        """Balls around the spheres' centres that surely lie in the links, of radius 0 where none is known."""
        balls = zip(self.each, self.arm.spheres, strict=True)
        return tuple(replace(body, radius=sphere.inner or 0.0) for body, sphere in balls)

    def among_own(self, body: Body) -> Body:
        """A ball as thick as links have to be that keep ``self_margin``, where all pairs keep the margin."""
        return replace(body, radius=body.radius + (self.arm.self_margin - self.arm.margin) / 2.0)


RANDOM_POSTURES = 10_000
TORQUE_ROUNDING = 1e-9  # N m
SEED = 17  # of the postures: a robot has the same figures every time


def largest_holding_torques(arm: SpatialArm) -> FloatArray | None:
    """The largest torque that holds each joint at random postures within the limits, (dof,), N m or N.

    None where masses are not known. The largest of all postures is a little more.
    """
    chain, ranges = arm.rigid_chain, arm.position_limits
    if chain is None or ranges is None:
        return None
    low, high = np.array(ranges).T
    postures = np.random.default_rng(SEED).uniform(low, high, (RANDOM_POSTURES, arm.dof))
    held = np.abs(as_array(chain.gravitational(ca.DM(postures)))).max(axis=0)
    return np.where(held < TORQUE_ROUNDING, 0.0, held)

"""Several robots in one cell, planned as one arm: a tree of joints in which each robot is a branch on the floor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property, lru_cache
from itertools import accumulate, combinations, pairwise, product
from itertools import chain as chained
from typing import Any

import casadi as ca
import numpy as np

from problems.base import CACHE_SIZE, InvalidProblem
from problems.robots.appearance import LinkAppearance
from problems.robots.arm_cover import ArmCover, CoveredLink
from problems.robots.chain import Chain, ChainJoint, Tip
from problems.robots.inertia import moved_inertia
from problems.robots.link_covers import placed
from problems.robots.own_pairs import LinkPairs
from problems.robots.spatial_arm import LeftOut, SpatialArm
from problems.robots.spheres import Sphere
from problems.robots.tracking import TrackingError
from problems.robots.transform import UNMOVED, FixedFrame, Point3, Transform, as_point

BETWEEN = "/"  # a robot's name and that of its joint or link
FLOOR = "floor"  # the link on which all robots stand
DIFFERENT = 1e-9  # m/s^2, of gravity


def cell_of(
    arms: Mapping[str, SpatialArm], stays_at: Mapping[str, Sequence[float]] | None = None, may_touch: LinkPairs = ()
) -> SpatialArm:
    """The robots of a cell as one arm, whose joints and links are named ``ROBOT/JOINT`` and ``ROBOT/LINK``.

    Args:
        arms: robots by their names, each where its base stands, with the pairs of own links that keep apart.
        stays_at: joints, rad or m, of robots that stand still by their names; the others move.
        may_touch: names of links that may touch, each of another robot; all others keep apart.

    Raises:
        InvalidProblem: gravity differs, one robot alone has a limit of jerk, none moves, one that stands still has
            another number of joints, or there is no link of a name.
    """
    still = {name: tuple(map(float, values)) for name, values in (stays_at or {}).items()}
    for name, values in still.items():
        if len(values) != arms[name].dof:
            raise InvalidProblem(f"{name}.stays_at", f"{len(values)} values for {arms[name].dof} joints")
    members: list[Member] = []
    for name, arm in arms.items():
        first = sum(member.arm.dof for member in members if member.stays_at is None)
        members.append(Member(name, arm, first, still.get(name)))
    if len(still) == len(arms):
        raise InvalidProblem(f"{next(iter(arms))}.stays_at", "no robot moves")
    return Members(tuple(members), tuple(may_touch)).arm


def own_name(name: str, robot: str) -> str:
    """The name of a joint or a link of a cell in the files of its robot; any other name stays as it is."""
    return name.removeprefix(f"{robot}{BETWEEN}")


@dataclass(frozen=True, eq=False)
class Member:
    """A robot of a cell.

    Attributes:
        name: of it.
        arm: the robot alone.
        first: number of its first joint among those of the cell, from 0.
        stays_at: values of its joints, rad or m, where it stands still; None where it moves.
    """

    name: str
    arm: SpatialArm
    first: int
    stays_at: tuple[float, ...] | None

    def named(self, part: str) -> str:
        """The name in the cell of a joint, a link, or a carried body, which keeps its own."""
        return part if part in self.arm.carried else f"{self.name}{BETWEEN}{part}"

    def body(self, number: int) -> int:
        """The number in the cell of a body: 0 for what stands still."""
        return 0 if number == 0 or self.stays_at is not None else self.first + number

    def pose(self, number: int) -> FixedFrame:
        """The pose of a body's frame in that of its body in the cell."""
        return self._poses[number] if self.body(number) == 0 else UNMOVED

    @cached_property
    def _poses(self) -> list[FixedFrame]:
        """Poses of the bodies that stand still: of the base, or of all."""
        if self.stays_at is None:
            return [self.arm.base_frame]
        frames = self.arm.chain.frames(ca.DM([self.stays_at]), self.arm.base_frame)
        return [FixedFrame.of(_in_numbers(frame)) for frame in frames]

    def joints(self) -> Iterator[ChainJoint]:
        """The joints as those of the cell, with the mass of what the tool carries."""
        arm, chain = self.arm, self.arm.chain
        if self.stays_at is not None:
            return
        if arm.payload is not None:
            chain = chain.loaded(chain.carrier, moved_inertia(arm.payload, arm.tool.frame))
        for joint, parent in zip(chain.joints, chain.parents, strict=True):
            yield replace(
                joint,
                name=self.named(joint.name),
                link=self.named(joint.link),
                parent=self.body(parent),
                pose=FixedFrame.of(self.pose(parent) @ joint.pose),
            )

    def tips(self) -> Iterator[Tip]:
        """The tool under the name of the robot, or several tips; none of a robot that stands still."""
        if self.stays_at is not None:
            return
        own, tool = self.arm.chain, self.arm.tool
        known = own.tips or (Tip(name="", link=own.tip_link, frame=own.tip, body=own.carrier),)
        for tip in known:
            frame = FixedFrame.of(tool.frame) if tip.link == own.tip_link else tip.frame
            name = self.named(tip.name) if tip.name else self.name
            base = as_point(self.pose(0).translation)
            yield Tip(name=name, link=self.named(tip.link), frame=frame, body=self.body(tip.body), base=base)

    def spheres(self) -> Iterator[Sphere]:
        """The balls for searches."""
        for each in self.arm.spheres:
            center = as_point(np.array(self.pose(each.link).apply(each.center), dtype=float))
            yield replace(each, link=self.body(each.link), center=center, name=self.named(each.name))

    def links(self) -> Iterator[CoveredLink]:
        """The covers for proofs."""
        for link in () if self.arm.cover is None else self.arm.cover.links:
            pose = self.pose(link.body)
            balls = placed(link.balls, np.array(pose.rotation), np.array(pose.translation))
            yield CoveredLink(self.named(link.name), self.body(link.body), balls, link.overhang)

    def appearances(self) -> Iterator[LinkAppearance]:
        """The appearances of links."""
        for each in self.arm.appearances:
            pose = self.pose(each.body)
            triangles = each.triangles.placed(np.array(pose.rotation), np.array(pose.translation))
            yield LinkAppearance(self.named(each.link), self.body(each.body), each.colour, triangles)

    def locked(self) -> Iterator[tuple[str, float]]:
        """Joints that are not planned with, and where each stands."""
        yield from ((self.named(name), value) for name, value in self.arm.locked)
        if self.stays_at is not None:
            yield from zip(map(self.named, self.arm.joints.names), self.stays_at, strict=True)


@dataclass(frozen=True, eq=False)
class Members:
    """The robots of a cell.

    Attributes:
        each: of them.
        may_touch: names of links of two robots that may touch.
    """

    each: tuple[Member, ...]
    may_touch: tuple[tuple[str, str], ...]

    @property
    def arm(self) -> SpatialArm:
        """All robots as one arm."""
        self._check()
        tips = tuple(self._all(Member.tips))
        first = tips[0]
        spheres = tuple(self._all(Member.spheres))
        return SpatialArm(
            chain=Chain(
                name=" and ".join(member.name for member in self.each),
                joints=tuple(self._all(Member.joints)),
                base_link=FLOOR,
                tip_link=first.link,
                tip=first.frame,
                tip_body=first.body,
                tips=tips,
            ),
            max_speed=self._joined("max_speed") or (),
            max_acceleration=self._joined("max_acceleration") or (),
            max_jerk=self._joined("max_jerk"),
            position_limits=self._joined("position_limits"),
            max_torque=self._joined("max_torque"),
            spheres=spheres,
            gravity=self._moving[0].arm.gravity,
            self_margin=max(member.arm.self_margin for member in self.each),
            left_out=self._left_out(),
            carried=tuple(member.named(part) for member in self.each for part in member.arm.carried),
            locked=tuple(self._all(Member.locked)),
            appearances=tuple(self._all(Member.appearances)),
            tracking=self._tracking(),
            kept_pairs=_shared((*self._own_pairs("kept_pairs"), *self._sphere_pairs(spheres))),
            proven_pairs=_shared(tuple(self._own_pairs("proven_pairs"))),
            cover=self._cover(),
        )

    @property
    def _moving(self) -> list[Member]:
        return [member for member in self.each if member.stays_at is None]

    def _check(self) -> None:
        moving = self._moving
        gravities = np.array([member.arm.gravity for member in moving])
        if np.ptp(gravities, axis=0).max() > DIFFERENT:
            raise InvalidProblem(f"{moving[-1].name}.gravity", "another one than that of the other robots")
        for key, limited in (
            ("max_jerk", [member.arm.max_jerk is not None for member in moving]),
            ("joint_limits", [member.arm.position_limits is not None for member in moving]),
        ):
            if any(limited) and not all(limited):
                raise InvalidProblem(f"{moving[limited.index(False)].name}.{key}", "missing: another robot has one")
        covered = [member.arm.cover is not None for member in self.each]
        if any(covered) and not all(covered):
            one, other = (self.each[covered.index(each)].name for each in (True, False))
            reason = f"balls stand for the links of this robot, covers for those of {one}: state spheres of both"
            raise InvalidProblem(f"{other}.spheres", f"{reason}, or the URDFs of both")
        if len({member.arm.self_margin for member in self.each}) > 1:
            raise InvalidProblem(f"{self.each[-1].name}.self_margin", "another one than that of the other robots")
        known = {member.named(link) for member in self.each for link in member.arm.bodies.names}
        unknown = next((name for pair in self.may_touch for name in pair if name not in known), None)
        if unknown is not None:
            raise InvalidProblem("may_touch", f"no link {unknown!r}; there are {', '.join(sorted(known))}")

    def _all(self, parts: Callable[[Member], Iterator[Any]]) -> Iterator[Any]:
        return chained.from_iterable(map(parts, self.each))

    def _joined(self, field: str) -> Any:
        """The values of a field for all joints; None where a robot that moves has none."""
        values = [getattr(member.arm, field) for member in self._moving]
        return None if any(value is None for value in values) else tuple(chained(*values))

    def _tracking(self) -> TrackingError | None:
        """The errors of all joints, zero where none are stated."""
        arms = [member.arm for member in self._moving]
        if all(arm.tracking is None for arm in arms):
            return None
        none = {part.name: 0.0 for part in fields(TrackingError)}
        parts = {
            name: tuple(chained(*(getattr(arm.tracking, name, (zero,) * arm.dof) for arm in arms)))
            for name, zero in none.items()
        }
        return TrackingError(**parts)

    def _left_out(self) -> LeftOut:
        """The parts that no verdict speaks of, of all robots; torques too, where those of one robot are not known."""
        parts = [(member, member.arm.left_out) for member in self.each]
        limited = [member.name for member in self._moving if member.arm.max_torque is not None]
        others = [f"{member.name}: {line}" for member, left in parts for line in left.others]
        if len(limited) < len(self._moving):
            others += [f"torques of {name}: those of another robot are not limited" for name in limited]
        return LeftOut(
            links=tuple(member.named(link) for member, left in parts for link in left.links),
            contacts=tuple(f"{member.name}: {line}" for member, left in parts for line in left.contacts),
            others=tuple(others),
        )

    # Pairs that keep apart

    def _own_pairs(self, field: str) -> Iterator[tuple[int, int]]:
        """The pairs of spheres of each robot that moves, by their numbers in the cell."""
        for member, numbers in zip(self.each, _numbers(self.each, Member.spheres), strict=True):
            for one, two in getattr(member.arm, field) if member.stays_at is None else ():
                yield numbers[one], numbers[two]

    def _sphere_pairs(self, spheres: Sequence[Sphere]) -> Iterator[tuple[int, int]]:
        """The pairs of spheres of two robots that keep apart."""
        excused = set(map(frozenset, self.may_touch))
        return (
            (one, two)
            for first, second in combinations(_numbers(self.each, Member.spheres), 2)
            for one, two in product(first, second)
            if (spheres[one].link or spheres[two].link)
            and frozenset((spheres[one].name, spheres[two].name)) not in excused
        )

    def _cover(self) -> ArmCover | None:
        """The covers of all robots, and the pairs of own links and of links of two robots that keep apart."""
        if self.each[0].arm.cover is None:
            return None
        links, excused = list(self._all(Member.links)), set(map(frozenset, self.may_touch))
        order = sorted(range(len(links)), key=lambda number: links[number].body)
        place, robots = {number: k for k, number in enumerate(order)}, _numbers(self.each, Member.links)
        own = [
            (numbers[one], numbers[two])
            for member, numbers in zip(self.each, robots, strict=True)
            if member.arm.cover is not None and member.stays_at is None
            for one, two in member.arm.cover.pairs
        ]
        between = [
            (one, two)
            for first, second in combinations(robots, 2)
            for one, two in product(first, second)
            if (links[one].body or links[two].body) and frozenset((links[one].name, links[two].name)) not in excused
        ]
        pairs = sorted((min(place[a], place[b]), max(place[a], place[b])) for a, b in (*own, *between))
        return ArmCover(tuple(links[number] for number in order), tuple(pairs))


@lru_cache(maxsize=CACHE_SIZE)
def _shared(pairs: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
    """Pairs as one object for all equal ones: there are thousands, and the same object is checked once."""
    return pairs


def _numbers(members: Sequence[Member], parts: Callable[[Member], Iterator[Any]]) -> list[range]:
    """The numbers in the cell of the parts of each robot."""
    counts = [sum(1 for _ in parts(member)) for member in members]
    return [range(*ends) for ends in pairwise(accumulate(counts, initial=0))]


def _in_numbers(frame: Transform) -> Transform:
    """A transform whose entries are numbers of CasADi, as one of plain numbers."""
    x, y, z = ([float(entry) for entry in row] for row in frame.rotation)
    place: Point3 = as_point([float(part) for part in frame.translation])
    return Transform((as_point(x), as_point(y), as_point(z)), place)

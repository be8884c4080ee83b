"""Arms completed from their descriptions: own links that keep apart, and what no verdict speaks of."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations

import numpy as np

from problems.base import InvalidProblem
from problems.robots.arm_cover import ArmCover, CoveredLink
from problems.robots.chain import OffChainJoint
from problems.robots.description import RobotDescription
from problems.robots.link_covers import advice, fine_balls, overhang_of, placed
from problems.robots.neighbours import are_never_parted, connected_links
from problems.robots.own_pairs import LinkPairs, Named, OwnPairs, own_pairs_of
from problems.robots.spatial_arm import LeftOut, SpatialArm


def complete_arm(
    description: RobotDescription,
    arm: SpatialArm,
    disabled: LinkPairs = (),
    kept: LinkPairs = (),
    ignored: Collection[str] = (),
) -> SpatialArm:
    """An arm made of a description, with pairs of links that keep apart and what no verdict covers.

    Args:
        description: of the robot.
        arm: as :meth:`RobotDescription.arm` makes it.
        disabled: names of links that may touch.
        kept: names of links that must not, whatever a joint connects and random postures say.
        ignored: names of links whose geometry is left out.

    Raises:
        InvalidProblem: as :func:`own_pairs_of`; or the geometry of a link that a joint moves was not read, no spheres
            are stated for it, and nobody says that it is to be left out; or a link follows a joint of the chain.
    """
    names = [*(frame.name for frame in description.links), *description.apart]
    unknown = next((link for link in ignored if link not in names), None)
    if unknown is not None:
        raise InvalidProblem("ignore_geometry", f"no link {unknown!r} in the chain; there are {', '.join(names)}")
    arm = replace(arm, spheres=tuple(sphere for sphere in arm.spheres if sphere.name not in ignored))
    return OwnContacts(description, arm, tuple(disabled), tuple(kept), tuple(dict.fromkeys(ignored))).completed


@dataclass(frozen=True)
class OwnContacts:
    """The arm's own links: which keep apart, and which do not and why.

    Attributes:
        description: of the robot.
        arm: made of it.
        disabled: names of links that may touch, besides those of the description.
        kept: names of links that must not touch, whatever a joint connects.
        ignored: names of links whose geometry is left out.
    """

    description: RobotDescription
    arm: SpatialArm
    disabled: tuple[tuple[str, str], ...] = ()
    kept: tuple[tuple[str, str], ...] = ()
    ignored: tuple[str, ...] = ()

    @property
    def completed(self) -> SpatialArm:
        """The arm with the pairs that keep apart, a cover where there is one, and all that is left out."""
        self._check_geometry()
        return replace(
            self._with_cover,
            kept_pairs=self.spheres.kept,
            proven_pairs=() if self.description.covers else self.spheres.far,
            left_out=LeftOut(self.ignored, tuple(self._contacts()), tuple(self._left_out())),
        )

    @cached_property
    def spheres(self) -> OwnPairs:
        """Pairs of spheres that keep apart, and those that touch at nearly every posture."""
        links = {sphere.name for sphere in self.arm.spheres}
        known = [pair for pair in self.description.disabled if links.issuperset(pair)]
        return own_pairs_of(self._with_cover, (*known, *self.disabled), self.kept, self.connected)

    @cached_property
    def _with_cover(self) -> SpatialArm:
        return replace(self.arm, cover=self.cover) if self.description.covers else self.arm

    @cached_property
    def cover(self) -> ArmCover:
        """A cover for proofs of all links with collision geometry, and which of them must keep apart."""
        excused = (self.connected | _named(self.never_parted)) - _named(self.kept) | _named(self._may_touch)
        return ArmCover(
            self._links,
            tuple((one, two) for one, two in self._moving_pairs if self._names(one, two) not in excused),
        )

    @cached_property
    def connected(self) -> Named:
        """Names of links that a joint connects."""
        return connected_links(self.description.links, self.arm.chain.parents, self._solid)

    @cached_property
    def never_parted(self) -> tuple[tuple[str, str], ...]:
        """Names of links whose balls touch wherever the one joint between them is, carried bodies excluded."""
        found, settled = [], self.connected | _named(self.kept) | _named(self._may_touch)
        for one, two in self._moving_pairs:
            first, second = self._links[one], self._links[two]
            number = second.body - 1  # of the joint that is between them, if one alone is
            beside = self.arm.chain.parents[number] == first.body and second.name not in self.arm.carried
            if beside and self._names(one, two) not in settled:
                joint = self.arm.chain.joints[number]
                bounds = (self.arm.position_limits or [(-np.pi, np.pi)] * self.arm.dof)[number]
                found += [(first.name, second.name)] if are_never_parted(first, second, joint, bounds) else []
        return tuple(found)

    @cached_property
    def _links(self) -> tuple[CoveredLink, ...]:
        """Links with a cover for proofs, those that fewer joints move first."""
        covers, links = {cover.link: cover for cover in self.description.covers}, []
        for link, shapes in self.description.shapes if covers else ():
            balls, frame = fine_balls(shapes, covers.get(link)), self.description.frame(link)
            if len(balls) and link not in self.ignored:
                turn, shift = np.array(frame.pose.rotation), np.array(frame.pose.translation)
                links.append(
                    CoveredLink(link, frame.body, placed(balls, turn, shift), overhang_of(shapes, covers.get(link)))
                )
        return tuple(sorted(links, key=lambda link: link.body))

    @property
    def _moving_pairs(self) -> Iterator[tuple[int, int]]:
        """Numbers of links that a joint moves against each other."""
        pairs = combinations(range(len(self._links)), 2)
        return ((one, two) for one, two in pairs if self._links[one].body < self._links[two].body)

    def _names(self, one: int, two: int) -> frozenset[str]:
        return frozenset((self._links[one].name, self._links[two].name))

    @property
    def _may_touch(self) -> tuple[tuple[str, str], ...]:
        return (*self.description.disabled, *self.disabled)

    @property
    def _unread(self) -> list[tuple[str, str]]:
        """Links with a mesh that is not read and for which no spheres are stated, and its file."""
        stated = {sphere.name for sphere in self.arm.spheres}.difference(link for link, _ in self.description.balls)
        return [(link, file) for link, file in self.description.unread if link not in {*stated, *self.ignored}]

    def _check_geometry(self) -> None:
        """Check that all geometry that the chain moves is known and moves as modelled, or is to be ignored."""
        for link, file in self._unread:
            if self.description.frame(link).body > 0:
                raise InvalidProblem("urdf", f"link {link!r}: its mesh {file} is not read; {advice(link)}")
        for joint in self.description.off_chain:
            followers = self._carried(joint) if joint.leader else []
            if followers:
                reason = f"joint {joint.name!r} moves it with {joint.leader!r}, which is not planned with"
                leave = f"leave it out of every verdict: ignore_geometry = {_listed(followers)}"
                raise InvalidProblem("urdf", f"link {followers[0]!r}: {reason}; {leave}")

    @cached_property
    def _solid(self) -> frozenset[str]:
        """Names of links with geometry, whether it is read, ignored or not."""
        shapes = (link for link, _ in self.description.shapes)
        return frozenset((*(sphere.name for sphere in self.arm.spheres), *shapes))

    @cached_property
    def _covered(self) -> frozenset[str]:
        """Names of links whose geometry is judged."""
        return frozenset((*self.arm.bodies.names, *(link.name for link in self._links)))

    def _carried(self, joint: OffChainJoint) -> list[str]:
        """Links with geometry that a joint off the chain carries, and that are not ignored."""
        return [link for link in joint.links if link in self._solid and link not in self.ignored]

    def _left_out(self) -> Iterator[str]:
        description, unread = self.description, self._unread
        if self.ignored:
            yield f"the geometry of {', '.join(self.ignored)}, which is to be ignored"
        for link, file in unread:
            yield f"{link}, which stands still: its mesh {file} is not read"
        named = {*self._covered, *self.ignored, *(link for link, _ in unread)}
        unstated = [link for link, _ in description.shapes if link not in named]
        if unstated:
            yield f"the collision geometry of {', '.join(unstated)}: the spheres leave it out"
        bare = list(self._bare())
        if bare:
            yield f"bodies of {', '.join(bare)}: no collision geometry is stated"
        apart = [link for link in description.apart if link not in self.ignored]
        if apart:
            yield f"{', '.join(apart)}: no joint connects them with the arm"
        yield from self._held()
        following = [joint.name for joint in description.off_chain if joint.leader]
        if description.chain.torque_gap and self.arm.max_torque is None:
            yield f"torques: {description.chain.torque_gap}"
        elif following:
            yield f"torques of what {', '.join(following)} move: its masses are counted as if it stood at zero"

    def _bare(self) -> Iterator[str]:
        """Links that have no collision geometry and are shown, or moved by the chain with nothing on them that has."""
        frames, carried = self.description.links, {joint.link for joint in self.description.chain.joints}
        solid = {frame.body for frame in frames if frame.name in self._covered}
        shown = {link for link, _ in (*self.description.visuals, *self.description.unseen)}
        known = {*self._solid, *self._covered, *self.ignored}
        for frame in frames:
            if frame.name not in known and (frame.name in shown or (frame.name in carried and frame.body not in solid)):
                yield frame.name

    def _held(self) -> Iterator[str]:
        """Lines on where joints off the chain with geometry are assumed to stand."""
        held = [joint for joint in self.description.off_chain if not joint.leader and self._carried(joint)]
        stated = [f"{joint.name} = {joint.value:g}" for joint in held if joint.value is not None]
        free = [joint.name for joint in held if joint.value is None]
        if stated:
            yield f"joints off the chain elsewhere than at {', '.join(stated)}: say where they are by locked"
        if free:
            yield f"what {', '.join(free)} carry, elsewhere than at the joint's origin"

    def _contacts(self) -> Iterator[str]:
        """Lines on own links that are not compared, and why."""
        spheres = self.arm.spheres
        touching = [] if self._links else [(spheres[a].name, spheres[b].name) for a, b in self.spheres.together]
        connected = [tuple(sorted(pair)) for pair in self.connected - _named(self.kept) if pair <= self._covered]
        for reason, pairs in (
            ("own links that may touch", [pair for pair in self._may_touch if set(pair) <= self._covered]),
            ("own links that a joint connects", sorted(connected)),
            ("own links that touch wherever the joint between them is", self.never_parted),
            ("own spheres that touch at nearly every posture", touching),
        ):
            each = dict.fromkeys(" and ".join(sorted(pair)) for pair in pairs)
            if each:
                yield f"{reason}: {', '.join(each)}"


def _named(pairs: Iterable[Collection[str]]) -> Named:
    return frozenset(map(frozenset, pairs))


def _listed(names: Sequence[str]) -> str:
    return "[" + ", ".join(map(json.dumps, names)) + "]"

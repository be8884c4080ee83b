"""The links and joints of a URDF as a tree: what hangs on what, and which chain of joints is the arm."""

from __future__ import annotations

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TypeAlias

from problems.base import InvalidProblem
from problems.robots.transform import Transform
from problems.robots.urdf_elements import (
    MOVING,
    Mimic,
    UrdfJoint,
    UrdfLink,
    read_colours,
    read_joint,
    read_link,
    refused,
)

Filter: TypeAlias = Callable[[UrdfJoint], bool]
MOST_LINKS = 1_000
FARTHEST = 1e4  # rad or m, that a joint stands from zero
MOST_NAMED = 6  # chains, in a message
FEWEST_JOINTS, LONGEST_FINGER = 3, 3  # after so many joints, several chains of no more are fingers
TOOLS = tuple(map(re.compile, (r"^tool0$", r"tcp", r"tool", r"(^|_)ee(f|_|$)|end_?effector", r"flange", r"attachment")))
ACCESSORIES = re.compile(
    "grip|finger|thumb|knuckle|jaw|claw|wheel|caster|suspension|head|neck|camera|optical|laser|lidar|imu|sensor|antenna"
    "|sonar|range|accelerometer|drive|coupler|follower"
)


def is_of_an_arm(joint: UrdfJoint) -> bool:
    """Whether a joint belongs to no hand, wheel or head by its name, and follows no other."""
    name = joint.name.lower()
    return joint.mimic is None and not ACCESSORIES.search(name) and "hand" not in name


def moves_by_itself(joint: UrdfJoint) -> bool:
    """Whether a joint follows no other."""
    return joint.mimic is None


@dataclass(frozen=True)
class Tree:
    """The links and joints of a URDF by name.

    Attributes:
        links: in the order of the file.
        joints: the same.
    """

    links: dict[str, UrdfLink]
    joints: dict[str, UrdfJoint]

    @classmethod
    def of(cls, robot: ET.Element) -> Tree:
        """The tree of a ``robot`` element.

        Raises:
            InvalidProblem: two of a name, a link that no one states, a loop.
        """
        colours = read_colours(robot)
        links = [read_link(element, colours) for element in robot.findall("link")]
        return cls.checked(links, [read_joint(element) for element in robot.findall("joint")])

    @classmethod
    def checked(cls, links: Sequence[UrdfLink], joints: Sequence[UrdfJoint]) -> Tree:
        """The tree of links and joints.

        Raises:
            InvalidProblem: two of a name, a link that no one states, a loop.
        """
        if len(links) > MOST_LINKS:
            raise refused(f"more than {MOST_LINKS} links")
        tree = cls({link.name: link for link in links}, {joint.name: joint for joint in joints})
        for kind, stated, names in (("links", links, tree.links), ("joints", joints, tree.joints)):
            if len(stated) > len(names):
                raise refused(f"two {kind} of one name")
        tree._check()
        return tree

    def _check(self) -> None:
        if not self.links:
            raise refused("no links")
        moved: set[str] = set()
        for joint in self.joints.values():
            for link in (joint.parent, joint.child):
                if link not in self.links:
                    raise refused(f"joint {joint.name!r}: no link {link!r} in the file")
            if joint.child in moved:
                raise refused(f"link {joint.child!r} hangs on two joints: a loop cannot be planned")
            moved.add(joint.child)
        reached = {link for root in self.roots for link in (root, *(joint.child for joint in self.below(root)))}
        if len(reached) < len(self.links):
            lost = next(link for link in self.links if link not in reached)
            raise refused(f"link {lost!r} is in a loop, which cannot be planned")

    @property
    def with_visual_geometry(self) -> Tree:
        """The tree in which what is shown of a link must not touch anything, where something is shown of it.

        Raises:
            InvalidProblem: ``urdf`` shows what cannot be read.
        """
        unread = next((link for link in self.links.values() if link.unseen), None)
        if unread is not None:
            raise refused(f"link {unread.name!r}: its visual geometry is not read: {unread.unseen}")
        shown = {name: tuple(visual.shape for visual in link.visuals) for name, link in self.links.items()}
        links = {name: replace(link, shapes=shown[name] or link.shapes) for name, link in self.links.items()}
        return Tree(links, self.joints)

    @cached_property
    def above(self) -> dict[str, UrdfJoint]:
        """The joint that carries a link, by the link's name."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def children(self) -> dict[str, list[UrdfJoint]]:
        """The joints on a link, by the link's name."""
        children: dict[str, list[UrdfJoint]] = {link: [] for link in self.links}
        for joint in self.joints.values():
            children[joint.parent].append(joint)
        return children

    @property
    def roots(self) -> list[str]:
        """Links that no joint carries."""
        return [link for link in self.links if link not in self.above]

    def below(self, link: str) -> Iterator[UrdfJoint]:
        """All joints that are carried by a link, parents first."""
        waiting = list(self.children[link])
        while waiting:
            joint = waiting.pop(0)
            yield joint
            waiting += self.children[joint.child]

    def way(self, link: str) -> Iterator[UrdfJoint]:
        """The joints that carry a link, from its own to that on the root."""
        while link in self.above:
            yield self.above[link]
            link = self.above[link].parent

    def fixed_root(self, link: str) -> str:
        """The link nearest to the root to which one is fixed; itself where it is fixed to none."""
        for joint in self.way(link):
            if joint.kind != "fixed":
                break
            link = joint.parent
        return link

    def chain(self, base_link: str | None, tip_link: str | None) -> tuple[str, list[UrdfJoint], list[str]]:
        """The base, the joints from it to the tip, fixed ones included, and notes on what was not stated.

        Raises:
            InvalidProblem: a link is not in the file, or the tip is not carried by the base.
        """
        base = self._base(base_link)
        notes: list[str] = []
        if tip_link is None:
            tip_link, notes = self._tip(base)
        elif tip_link not in self.links:
            raise InvalidProblem("tip_link", self._unknown(tip_link))
        joints: list[UrdfJoint] = []
        link = tip_link
        while link != base:
            if link not in self.above:
                raise InvalidProblem("tip_link", f"{tip_link!r} is not carried by {base!r}")
            joints.insert(0, self.above[link])
            link = joints[0].parent
        return base, joints, notes

    def branches(self, base_link: str | None, tips: Mapping[str, str]) -> tuple[str, list[UrdfJoint], list[str]]:
        """The base, and all joints from it to several tips, none before the one that carries it; no notes.

        Raises:
            InvalidProblem: a link is not in the file, a tip is not carried by the base, or is on the way to another.
        """
        found: dict[str, UrdfJoint] = {}
        for name, tip in tips.items():
            try:
                base, joints, _ = self.chain(base_link, tip)
            except InvalidProblem as error:
                raise InvalidProblem("tips" if error.field == "tip_link" else error.field, error.reason) from error
            moving = [joint.name for joint in joints if joint.kind != "fixed" and joint.name not in found]
            if not moving:
                raise InvalidProblem("tips", f"no joint moves {name!r} alone: {tip!r} is on the way to another tip")
            found.update((joint.name, joint) for joint in joints)
        return base, list(found.values()), []

    def _base(self, base_link: str | None) -> str:
        if base_link is None:
            if len(self.roots) > 1:
                raise InvalidProblem("base_link", f"must be stated: {_some(self.roots)} hang on nothing")
            return self.roots[0]
        if base_link not in self.links:
            raise InvalidProblem("base_link", self._unknown(base_link))
        return base_link

    def _unknown(self, link: str) -> str:
        return f"no link {link!r} in the URDF; there are {_some(list(self.links))}"

    def next_joints(self, body: str) -> list[UrdfJoint]:
        """The joints that move something on a link, or on what is fixed to it."""
        found = []
        for joint in self.children[body]:
            found += self.next_joints(joint.child) if joint.kind == "fixed" else [joint]
        return found

    def _tip(self, base: str) -> tuple[str, list[str]]:
        """The end of the only chain of joints that are no fingers, wheels or sensor mounts."""
        arms = list(self._arms(base, [], is_of_an_arm)) or list(self._arms(base, [], moves_by_itself))
        if len(arms) > 1:
            each = [f"{self._frame_at(joints[-1].child)!r} ({_counted(joints)})" for joints in arms[:MOST_NAMED]]
            more = ", ..." if len(arms) > MOST_NAMED else ""
            raise InvalidProblem("tip_link", f"must be stated, for several chains end at {', '.join(each)}{more}")
        tip = self._frame_at(arms[0][-1].child if arms else base)
        return tip, [f"tip_link is not stated: {tip!r} is taken"]

    def _arms(
        self, body: str, joints: list[UrdfJoint], is_part: Callable[[UrdfJoint], bool]
    ) -> Iterator[list[UrdfJoint]]:
        """Chains of joints that go on from some, each as far as it goes before fingers."""
        ahead = [joint for joint in self.next_joints(body) if is_part(joint)]
        chains = [chain for joint in ahead for chain in self._arms(joint.child, [*joints, joint], is_part)]
        longest = max((len(chain) for chain in chains), default=len(joints)) - len(joints)
        if len(joints) >= FEWEST_JOINTS and len(ahead) > 1 and longest <= LONGEST_FINGER:
            yield joints
        elif chains:
            yield from chains
        elif joints:
            yield joints

    def _frame_at(self, body: str) -> str:
        """The frame fixed to a body that is named like a tool, or that most others carry."""
        depths = {body: 0}
        for joint in self.below(body):
            if joint.kind == "fixed" and joint.parent in depths:
                depths[joint.child] = depths[joint.parent] + 1
        for pattern in TOOLS:
            tools = [link for link in depths if pattern.search(link.lower())]
            if tools:
                return max(tools, key=lambda link: depths[link])
        plain = [link for link in depths if link == body or not ACCESSORIES.search(link.lower())]
        return max(plain, key=lambda link: depths[link])

    def locked(self, values: Mapping[str, float]) -> Tree:
        """The tree with joints fixed at values, rad or m, and those that mimic them, directly or through others.

        Raises:
            InvalidProblem: ``locked`` names no joint that moves, or a value that it cannot have; ``urdf`` has joints
                that mimic each other in a circle, or a joint that is not there.
        """
        for name, value in values.items():
            joint = self.joints.get(name)
            if joint is None or joint.kind not in MOVING:
                moving = [joint.name for joint in self.joints.values() if joint.kind in MOVING]
                raise InvalidProblem("locked", f"no joint {name!r} moves; there are {_some(moving)}")
            if joint.has_range and joint.position is not None and not joint.position[0] <= value <= joint.position[1]:
                low, high = joint.position
                raise InvalidProblem("locked", f"{name}: {value:g} is not within {low:g} to {high:g}")
        leads = {name: self.lead(name, values) for name, joint in self.joints.items() if joint.kind in MOVING}
        return self._at({name: lead.at(values[lead.joint]) for name, lead in leads.items() if lead.joint in values})

    def lead(self, name: str, known: Collection[str] = ()) -> Mimic:
        """The rule by which a joint follows the first that is known, or a joint that mimics no other.

        Raises:
            InvalidProblem: ``urdf`` has joints that mimic each other in a circle, or a joint that is not there.
        """
        lead, passed = Mimic(name), {name}
        while lead.joint not in known and (mimic := self.joints[lead.joint].mimic) is not None:
            if mimic.joint not in self.joints:
                reason = f"joint {lead.joint!r} mimics {mimic.joint!r}, which is not in the file"
                raise refused(f"{reason}; state where it stands: locked = {{ {json.dumps(lead.joint)} = 0.0 }}")
            if mimic.joint in passed:
                raise refused(f"joint {mimic.joint!r} mimics itself, by way of others")
            passed.add(mimic.joint)
            lead = Mimic(mimic.joint, lead.multiplier * mimic.multiplier, lead.at(mimic.offset))
        return lead

    def standing(self, chain: Collection[str]) -> tuple[Tree, dict[str, float], dict[str, str]]:
        """The tree with all joints off a chain fixed at usual values; these, and joints that follow the chain.

        Args:
            chain: names of its joints.

        Returns:
            A tree; the value, rad or m, of each joint that it holds; and by the name of each joint that mimics one of
            the chain the name of that one. These are left as they are.

        Raises:
            InvalidProblem: as :meth:`lead`.
        """
        off = [name for name, joint in self.joints.items() if joint.kind != "fixed" and name not in chain]
        leads = {name: self.lead(name, chain) for name in off}
        leaders = {name: lead.joint for name, lead in leads.items() if lead.joint in chain}
        values = {name: leads[name].at(self.joints[leads[name].joint].usual) for name in off if name not in leaders}
        far = next((name for name, value in values.items() if not abs(value) <= FARTHEST), None)
        if far is not None:
            raise refused(f"joint {far!r} would stand at {values[far]:g}, as it mimics {leads[far].joint!r}")
        return self._at(values), values, leaders

    def _at(self, values: Mapping[str, float]) -> Tree:
        held = {name: self.joints[name].at(value) for name, value in values.items()}
        return Tree(self.links, {**self.joints, **held})

    def around(self, link: str) -> Iterator[tuple[UrdfJoint, str, Transform]]:
        """The joints of a link, the link at the other end of each, and its pose in the frame of this one, at zero."""
        if link in self.above:
            joint = self.above[link]
            yield joint, joint.parent, joint.origin.inverse
        for joint in self.children[link]:
            yield joint, joint.child, joint.origin


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """The tree of a robot, with names, contacts and postures, as a file of any kind states it.

    Attributes:
        name: of the robot.
        tree: its links and joints.
        may_touch: names of links whose contacts the file does not count.
        postures: values of joints by their names, rad or m, by the names of the postures.
        notes: what is not planned with, a line each.
    """

    name: str
    tree: Tree
    may_touch: tuple[tuple[str, str], ...] = ()
    postures: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


def _some(names: list[str]) -> str:
    return ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")


def _counted(joints: Sequence[UrdfJoint]) -> str:
    names = ", ".join(joint.name for joint in (joints if len(joints) <= 3 else (joints[0], joints[-1])))
    dots = names if len(joints) <= 3 else names.replace(", ", " to ", 1)
    return f"{len(joints)} joint{'s' * (len(joints) > 1)}: {dots}"

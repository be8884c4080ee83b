"""The tree of links, and which chain of it is the arm."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from problems.base.errors import InvalidProblem
from problems.robots.spatial.urdf.document import refused
from problems.robots.spatial.urdf.elements import UrdfJoint, UrdfLink, read_joint, read_link

MOST_LINKS = 1_000
USUAL_TIP = "tool0"  # of robots that follow ROS-Industrial


@dataclass(frozen=True)
class Tree:
    """Links and joints by name.

    Attributes:
        links: in the order of the file.
        joints: the same.
    """

    links: dict[str, UrdfLink]
    joints: dict[str, UrdfJoint]

    @classmethod
    def of(cls, robot: ET.Element) -> Tree:
        """What a ``robot`` element holds.

        Raises:
            InvalidProblem: two of a name, a link that no one states, a loop.
        """
        if len(robot.findall("link")) > MOST_LINKS:
            raise refused(f"more than {MOST_LINKS} links")
        links = [read_link(element) for element in robot.findall("link")]
        joints = [read_joint(element) for element in robot.findall("joint")]
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

    def _moves(self, joint: UrdfJoint) -> bool:
        return joint.kind != "fixed" or any(other.kind != "fixed" for other in self.below(joint.child))

    def _tip(self, base: str) -> tuple[str, list[str]]:
        """As far as one joint after the other moves: to where the chain ends, or forks into fingers."""
        body = base
        while True:
            moving = [joint for joint in self.children[body] if self._moves(joint)]
            if len(moving) != 1:
                break
            body = moving[0].child
        if body == base and moving:
            ends = [joint.child for joint in self.below(base) if not self.children[joint.child]]
            raise InvalidProblem("tip_link", f"must be stated, the chain forks at {body!r}; it can be {_some(ends)}")
        tip = self._farthest_frame(body)
        return tip, [f"tip_link is not stated: {tip!r} is taken"]

    def _farthest_frame(self, body: str) -> str:
        """Of the frames fixed to a body the one called as tools are, or the one that most others carry."""
        depths = {body: 0}
        for joint in self.below(body):
            if joint.kind == "fixed" and joint.parent in depths:
                depths[joint.child] = depths[joint.parent] + 1
        return USUAL_TIP if USUAL_TIP in depths else max(depths, key=lambda link: depths[link])


def _some(names: list[str]) -> str:
    return ", ".join(names[:20]) + (", ..." if len(names) > 20 else "")

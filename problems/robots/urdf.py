"""Robots from URDF text, read with ``xml.etree`` alone; the robots that are built in."""

from __future__ import annotations

import tomllib
import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from importlib.resources import files
from typing import Any

from problems.base import InvalidProblem
from problems.robots.chain import Chain, ChainJoint, JointKind, LinkFrame
from problems.robots.description import RobotDescription
from problems.robots.inertia import Inertia, impossible
from problems.robots.spheres_file import read_spheres
from problems.robots.transform import Transform, numbers_of
from problems.robots.urdf_elements import (
    MOVING,
    UrdfJoint,
    UrdfLink,
    document,
    joined,
    moved_inertia,
    name_of,
    read_joint,
    read_link,
    refused,
)

MOST_PAIRS = 100_000


def read_srdf(text: str) -> tuple[tuple[str, str], ...]:
    """The pairs of links in the ``disable_collisions`` of a file.

    Raises:
        InvalidProblem: ``srdf`` is impossible, with the reason in one line.
    """
    try:
        found = document(text).findall("disable_collisions")
        pairs = tuple((name_of(pair, "link1"), name_of(pair, "link2")) for pair in found[: MOST_PAIRS + 1])
    except InvalidProblem as error:
        raise InvalidProblem("srdf", error.reason) from error
    if not 0 < len(pairs) <= MOST_PAIRS:
        raise InvalidProblem("srdf", "no <disable_collisions>" if not pairs else f"more than {MOST_PAIRS} pairs")
    return pairs


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


MOST_JOINTS = 50


def read_urdf(text: str, base_link: str | None = None, tip_link: str | None = None) -> RobotDescription:
    """The arm that a URDF describes.

    Args:
        text: of the file.
        base_link: what stands still; the root by default.
        tip_link: the end of the chain; by default the frame at its end, or where it forks (as before two fingers).

    Returns:
        Its chain, the spheres that hold its collision shapes, and notes: a line for each thing that the file
        does not state or that is not planned with.

    Raises:
        InvalidProblem: ``urdf``, ``base_link`` or ``tip_link`` is impossible, with the reason in one line.
    """
    robot = document(text)
    tree = Tree.of(robot)
    base, joints, notes = tree.chain(base_link, tip_link)
    moving = [joint for joint in joints if joint.kind != "fixed"]
    _check(moving, base)
    bodies = _bodies(tree, base, moving)
    frames = {frame.name: frame for body in bodies for frame in body.frames}
    tip = frames[joints[-1].child]
    chain = Chain(
        name=robot.get("name") or "robot",
        joints=tuple(_joint(joint, frames[joint.parent], body) for joint, body in zip(moving, bodies[1:], strict=True)),
        base_link=base,
        tip_link=tip.name,
        tip_translation=tip.translation,
        tip_rotation=tip.rotation,
    )
    notes += [note for body in bodies for note in (*body.faults, *body.notes)]
    notes += _gaps(moving) + _massless(bodies)
    shapes = tuple((name, tree.links[name].shapes) for name in frames if tree.links[name].shapes)
    description = RobotDescription(chain=chain, links=tuple(frames.values()), shapes=shapes, notes=tuple(notes))
    return description.with_covers({})


def _check(moving: list[UrdfJoint], base: str) -> None:
    if not moving:
        raise InvalidProblem("tip_link", f"no joint moves between {base!r} and the tip")
    if len(moving) > MOST_JOINTS:
        raise refused(f"{len(moving)} joints in a chain, of at most {MOST_JOINTS}")
    for joint in moving:
        if joint.kind not in MOVING:
            raise refused(f"joint {joint.name!r} of the chain is {joint.kind}, which cannot be planned")
        if joint.mimic is not None:
            raise refused(f"joint {joint.name!r} of the chain mimics {joint.mimic!r}, which cannot be planned")


@dataclass
class _Body:
    """A link that moves, or the base, and all that is fixed to it."""

    frames: list[LinkFrame] = field(default_factory=list)
    inertias: list[Inertia] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)  # why inertias are none


def _bodies(tree: Tree, base: str, moving: list[UrdfJoint]) -> list[_Body]:
    """The base and the bodies of the chain's joints, in the order of the chain."""
    along = {joint.name for joint in moving}
    return [_body(tree, number, link, along) for number, link in enumerate([base, *(joint.child for joint in moving)])]


def _body(tree: Tree, number: int, link: str, along: set[str]) -> _Body:
    body = _Body()
    poses = {link: Transform()}
    body.frames.append(LinkFrame.of(link, number, Transform()))
    for joint in tree.below(link):
        if joint.name in along or joint.parent not in poses:
            continue
        frame = LinkFrame.of(joint.child, number, poses[joint.parent] @ joint.origin)
        poses[joint.child] = frame.pose
        body.frames.append(frame)
        if joint.kind != "fixed":
            body.notes.append(f"joint {joint.name!r} is off the chain: locked at 0, its masses kept")
    for name, pose in poses.items():
        inertia = tree.links[name].inertia
        if inertia is not None:
            body.inertias.append(moved_inertia(inertia, pose))
            reason = impossible(inertia.matrix)
            body.faults += [] if reason is None else [f"link {name!r}: no body has its inertia, {reason}"]
    return body


def _joint(joint: UrdfJoint, carrier: LinkFrame, body: _Body) -> ChainJoint:
    translation, rotation = numbers_of(carrier.pose @ joint.origin)
    return ChainJoint(
        name=joint.name,
        link=joint.child,
        kind=JointKind(joint.kind),
        translation=translation,
        rotation=rotation,
        axis=joint.axis,
        position=joint.position,
        speed=joint.speed,
        effort=joint.effort,
        damping=joint.damping,
        friction=joint.friction,
        inertia=joined(body.inertias),
        fault=next(iter(body.faults), ""),
    )


def _gaps(moving: list[UrdfJoint]) -> list[str]:
    """What the file does not say of the joints that move."""
    missing = {
        "position limits": [j.name for j in moving if j.position is None and j.kind != JointKind.CONTINUOUS],
        "velocity": [joint.name for joint in moving if joint.speed is None],
        "effort": [joint.name for joint in moving if joint.effort is None],
    }
    return [f"no {what} stated for {', '.join(names)}" for what, names in missing.items() if names]


def _massless(bodies: list[_Body]) -> list[str]:
    massless = [body.frames[0].name for body in bodies[1:] if not body.inertias]
    return [f"no masses stated for {', '.join(massless)}: torques are unknown"] if massless else []


BUILT_IN: Collection[str] = ("panda", "ur5e", "iiwa14")


def built_in(name: str, tip_link: str | None = None) -> RobotDescription:
    """A robot that is built in, with its limits and spheres.

    Args:
        name: one of ``BUILT_IN``.
        tip_link: the end of the chain; the robot's usual tool frame by default.

    Raises:
        InvalidProblem: there is no such robot, or no such link.
    """
    if name not in BUILT_IN:
        raise InvalidProblem("model", f"{name!r} is not built in; there are {', '.join(BUILT_IN)}")
    known = tomllib.loads(_text(f"{name}.toml"))
    description = read_urdf(_text(f"{name}.urdf"), tip_link=tip_link or known["tip_link"])
    return replace(
        description.with_spheres(read_spheres(_text(f"{name}-spheres.toml"), description.links)),
        title=known["title"],
        max_acceleration=_known(description, known, "max_acceleration"),
        max_jerk=_known(description, known, "max_jerk"),
        disabled=tuple((one, two) for one, two in known["disabled"]),
        notes=tuple(known["notes"]),
    )


def _known(description: RobotDescription, known: dict[str, Any], field: str) -> tuple[float, ...] | None:
    """The values of the chain's joints; None where one of them has none."""
    values: dict[str, float] = known.get(field, {})
    names = [joint.name for joint in description.chain.joints]
    return tuple(values[name] for name in names) if set(names) <= set(values) else None


def _text(name: str) -> str:
    return files(__package__).joinpath("models", name).read_text(encoding="utf-8")

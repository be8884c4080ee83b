"""SRDF: groups of joints, where they begin and end, their named postures, and which links may touch."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass

from problems.base import InvalidProblem, number_of
from problems.robots.urdf_elements import MOVING, UrdfJoint, document, name_of
from problems.robots.urdf_tree import Tree

MOST_PAIRS = 100_000
KINDS = ("group", "group_state", "end_effector", "virtual_joint", "disable_collisions", "disable_default_collisions")


@dataclass(frozen=True, kw_only=True)
class Group:
    """Joints that are planned together.

    Attributes:
        chains: base and tip of each, names of links.
        joints: their names.
        links: names of links that joints of the group carry.
        groups: names of groups that are part of it.
    """

    chains: tuple[tuple[str, str], ...]
    joints: tuple[str, ...]
    links: tuple[str, ...]
    groups: tuple[str, ...]

    @property
    def chain(self) -> tuple[str, str] | None:
        """Base and tip, where the group is stated as one chain and nothing else."""
        return self.chains[0] if len(self.chains) == 1 and not (self.joints or self.links or self.groups) else None


@dataclass(frozen=True, kw_only=True)
class GroupState:
    """A named posture of a group: values of joints, rad or m, by their names."""

    name: str
    group: str
    values: Mapping[str, float]


@dataclass(frozen=True, kw_only=True)
class Srdf:
    """The groups, named postures and harmless contacts of a robot.

    Attributes:
        groups: by their names.
        states: named postures.
        tools: links that carry end effectors, by the groups that move them.
        hands: names of groups that are end effectors.
        virtual_joints: kinds of joints between the world and the robot, by their names.
        touching: pairs of links that may touch.
        untested: links that may touch all others,
        tested: but for these pairs.
    """

    groups: Mapping[str, Group]
    states: tuple[GroupState, ...]
    tools: Mapping[str, str]
    hands: frozenset[str]
    virtual_joints: Mapping[str, str]
    touching: tuple[tuple[str, str], ...]
    untested: tuple[str, ...]
    tested: frozenset[frozenset[str]]

    @property
    def notes(self) -> tuple[str, ...]:
        """A line for each joint between world and robot that is not planned with."""
        kinds = ((name, kind) for name, kind in self.virtual_joints.items() if kind != "fixed")
        return tuple(f"virtual joint {name!r} is {kind}: the robot stands where base says" for name, kind in kinds)

    def may_touch(self, links: Collection[str]) -> tuple[tuple[str, str], ...]:
        """The pairs among links that may touch."""
        pairs = ((one, other) for one in self.untested for other in links if one != other)
        return (*self.touching, *(pair for pair in pairs if frozenset(pair) not in self.tested))

    def postures(self, joints: Sequence[str], group: str | None) -> dict[str, tuple[float, ...]]:
        """The named postures that state all of some joints, of several groups together, a group before others."""
        stated: dict[str, dict[str, float]] = {}
        for state in sorted(self.states, key=lambda state: state.group == group):
            stated.setdefault(state.name, {}).update(state.values)
        complete = {name: values for name, values in stated.items() if values.keys() >= {*joints}}
        return {name: tuple(values[joint] for joint in joints) for name, values in complete.items()}

    def group_of(self, tree: Tree, group: str | None) -> str | None:
        """The group that is planned: the one that is named, or else the only chain without a hand.

        Raises:
            InvalidProblem: ``group`` is not in the file, or has to be stated.
        """
        if group is not None:
            if group not in self.groups:
                known = f"; there are {', '.join(self.groups)}" if self.groups else ""
                raise InvalidProblem("group", f"the SRDF states no group {group!r}{known}")
            return group
        fingerless = [name for name, each in self.groups.items() if self.hands.isdisjoint((name, *each.groups))]
        arms = {name: ends for name in fingerless if (ends := self._ends_or_none(tree, name))}
        if len({*arms.values()}) > 1:
            raise InvalidProblem("group", f"must be stated, for there are {', '.join(arms)}")
        return next(iter(arms), None)

    def _ends_or_none(self, tree: Tree, group: str) -> tuple[str, str] | None:
        try:
            return self.ends(tree, group)
        except InvalidProblem:
            return None

    def ends(self, tree: Tree, group: str) -> tuple[str, str]:
        """The base and the tip of a group, names of links.

        Args:
            tree: of the robot, in which joints may be locked.
            group: its name.

        Raises:
            InvalidProblem: ``group`` is no chain of joints.
        """
        stated = self.groups[group].chain
        if stated is not None:
            return stated
        names = self._joints(tree, group, ())
        joints = [tree.joints[name] for name in names if _moves(tree.joints[name])]
        if not joints:
            raise InvalidProblem("group", f"{group!r} moves no joint")
        last = max(joints, key=lambda joint: len(list(tree.way(joint.child))))
        way = [joint for joint in tree.way(last.child) if _moves(joint)]  # from the last to the root
        aside = next((joint.name for joint in joints if joint not in way), None)
        if aside is not None:
            raise InvalidProblem("group", f"{group!r} is no chain: {aside!r} is not between the base and {last.name!r}")
        first = max(map(way.index, joints))
        between = next((joint.name for joint in way[:first] if joint not in joints), None)
        if between is not None:
            cure = f"locked = {{ {between} = 0.0 }} says where it stands"
            raise InvalidProblem("group", f"{between!r} moves between its joints, and is none of {group!r}; {cure}")
        return tree.fixed_root(way[first].parent), self._tip(tree, group, last)

    def branches(self, tree: Tree, group: str) -> dict[str, str]:
        """The tips of the parts of a group that are chains, by their names; none where the group itself is one."""
        parts = self.groups.get(group)
        if parts is None or not self.groups.keys() >= {*parts.groups}:
            return {}  # which is said where it is read as a chain
        if parts.joints or parts.links or parts.chains or self._ends_or_none(tree, group) is not None:
            return {}
        ends = {part: self._ends_or_none(tree, part) for part in parts.groups if part not in self.hands}
        return {part: both[1] for part, both in ends.items() if both is not None}

    def _tip(self, tree: Tree, group: str, last: UrdfJoint) -> str:
        """The link on the last body that carries the end effector, or else the farthest of the group's links."""
        carried = [link for link in tree.links if tree.fixed_root(link) == last.child]
        if self.tools.get(group) in carried:
            return self.tools[group]
        stated = [link for link in self.groups[group].links if link in carried]
        return max(stated, key=lambda link: len(list(tree.way(link))), default=last.child)

    def _joints(self, tree: Tree, group: str, passed: tuple[str, ...]) -> list[str]:
        """The joints of a group and its parts, by their names.

        Raises:
            InvalidProblem: ``group`` names what is not there, is part of itself, or moves the base.
        """
        if group in passed or group not in self.groups:
            raise InvalidProblem("group", f"{group!r} is {'part of itself' if group in passed else 'not in the SRDF'}")
        parts = self.groups[group]
        names = [name for name in parts.joints if self.virtual_joints.get(name) != "fixed"]
        moved = next((name for name in names if name in self.virtual_joints), None)
        if moved is not None:
            kind = self.virtual_joints[moved]
            raise InvalidProblem("group", f"{group!r} moves the base: virtual joint {moved!r} is {kind}; only fixed is")
        missing = [name for name in names if name not in tree.joints]
        missing += [link for link in parts.links if link not in tree.links]
        if missing:
            raise InvalidProblem("group", f"{group!r}: the URDF has no {missing[0]!r}")
        names += [tree.above[link].name for link in parts.links if link in tree.above]
        for base, tip in parts.chains:
            names += [joint.name for joint in tree.chain(base, tip)[1]]
        for part in parts.groups:
            names += self._joints(tree, part, (*passed, group))
        return list(dict.fromkeys(names))


def _moves(joint: UrdfJoint) -> bool:
    return joint.kind in MOVING and joint.mimic is None


def read_srdf(text: str) -> Srdf:
    """Read the text of an SRDF.

    Raises:
        InvalidProblem: ``srdf`` is impossible, with the reason in one line.
    """
    try:
        return _srdf(document(text))
    except InvalidProblem as error:
        raise InvalidProblem("srdf", error.reason) from error


def _srdf(robot: ET.Element) -> Srdf:
    if not any(robot.find(kind) is not None for kind in KINDS):
        raise InvalidProblem("srdf", f"states nothing: no {', '.join(f'<{kind}>' for kind in KINDS)}")
    groups = {name_of(element): _group(element) for element in robot.iterfind("group")}
    if len(groups) < len(robot.findall("group")):
        raise InvalidProblem("srdf", "two groups of one name")
    touching = list(_pairs(robot, "disable_collisions"))
    if len(touching) > MOST_PAIRS:
        raise InvalidProblem("srdf", f"more than {MOST_PAIRS} pairs")
    hands = robot.findall("end_effector")
    return Srdf(
        groups=groups,
        states=tuple(_state(element) for element in robot.iterfind("group_state")),
        tools={element.get("parent_group", ""): name_of(element, "parent_link") for element in hands},
        hands=frozenset(element.get("group", "") for element in hands),
        virtual_joints={name_of(each): name_of(each, "type") for each in robot.iterfind("virtual_joint")},
        touching=tuple(touching),
        untested=tuple(name_of(each, "link") for each in robot.iterfind("disable_default_collisions")),
        tested=frozenset(map(frozenset, _pairs(robot, "enable_collisions"))),
    )


def _pairs(robot: ET.Element, kind: str) -> Iterator[tuple[str, str]]:
    return ((name_of(each, "link1"), name_of(each, "link2")) for each in robot.iterfind(kind))


def _group(element: ET.Element) -> Group:
    chains = ((name_of(chain, "base_link"), name_of(chain, "tip_link")) for chain in element.iterfind("chain"))
    joints, links, groups = (tuple(map(name_of, element.iterfind(kind))) for kind in ("joint", "link", "group"))
    return Group(chains=tuple(chains), joints=joints, links=links, groups=groups)


def _state(element: ET.Element) -> GroupState:
    name, values = name_of(element), {}
    for joint in element.iterfind("joint"):
        stated = name_of(joint, "value").split()
        try:
            numbers = [number_of(word) for word in stated]
        except ValueError as error:
            reason = (
                f"group_state {name!r}: joint {name_of(joint)!r} is at {' '.join(stated)[:40]!r}, which is no number"
            )
            raise InvalidProblem("srdf", reason) from error
        if len(numbers) == 1:  # others are of several degrees of freedom, which no chain has
            values[name_of(joint)] = numbers[0]
    return GroupState(name=name, group=name_of(element, "group"), values=values)

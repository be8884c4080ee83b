"""Robots from the text of a URDF or an MJCF, read with ``xml.etree`` alone."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from problems.base import InvalidProblem
from problems.robots.chain import Chain, ChainJoint, JointKind, LinkFrame, OffChainJoint, Tip
from problems.robots.description import RobotDescription
from problems.robots.inertia import Inertia, combined, inertia_fault, moved_inertia
from problems.robots.mjcf import read_mjcf
from problems.robots.srdf import Srdf
from problems.robots.transform import FixedFrame
from problems.robots.urdf_elements import (
    MOVING,
    UrdfJoint,
    document,
    refused,
)
from problems.robots.urdf_tree import RobotFile, Tree

MOST_JOINTS = 50


def read_urdf(
    text: str,
    base_link: str | None = None,
    tip_link: str | None = None,
    locked: Mapping[str, float] | str | None = None,
    srdf: Srdf | None = None,
    group: str | None = None,
    visual_geometry: bool = False,
    tips: Mapping[str, str] | None = None,
) -> RobotDescription:
    """The arm that a URDF or an MJCF describes, or several arms on one base.

    Args:
        text: of the file.
        base_link: what stands still; the root by default.
        tip_link: the end of the chain; by default that of the group, or else the tool's frame before fingers, where
            there is one arm alone.
        locked: joints that are held at values, rad or m, by their names; those that mimic them follow. Or the name of
            a posture of the SRDF or the file, in which joints off the chain are held.
        srdf: what states groups, named postures, and links that may touch.
        group: that is planned, of the SRDF; the only chain without a hand by default.
        visual_geometry: whether links are as they are shown, not as their collision geometry says.
        tips: the ends of several branches by their names, in the place of ``tip_link``; the first carries the tool.

    Returns:
        Its chain, the spheres that hold its collision shapes, and notes: a line for each thing that the file
        does not state or that is not planned with.

    Raises:
        InvalidProblem: ``urdf``, ``base_link``, ``tip_link``, ``locked``, ``group`` or ``tips`` is impossible, with the
            reason in one line.
    """
    file = _file(text)
    stated = file.tree.with_visual_geometry if visual_geometry else file.tree
    ends = _Ends(base_link, tip_link, srdf, group, tips or {})
    locked = _held(file, stated, ends, locked) if isinstance(locked, str) else dict(locked or {})
    tree = stated.locked(locked)
    base, joints, notes, group = ends.chain(tree)
    moving = [joint for joint in joints if joint.kind != "fixed"]
    _check(moving, base)
    along = {joint.name for joint in moving}
    standing, values, leads = tree.standing(along)
    _check_followers(stated, locked, base, along, leads)
    firsts = [LinkFrame(base, 0)]
    firsts += [LinkFrame(joint.child, number, parent=joint.parent) for number, joint in enumerate(moving, 1)]
    bodies = [_body(standing, first, along, {*values, *leads}) for first in firsts]
    frames = {frame.name: frame for body in bodies for frame in body.frames}
    several = ends.branches(tree)
    ended = [(name, frames[link]) for name, link in several.items()]
    tip = ended[0][1] if ended else frames[joints[-1].child]
    chain = Chain(
        name=file.name,
        joints=tuple(_joint(joint, frames[joint.parent], body) for joint, body in zip(moving, bodies[1:], strict=True)),
        base_link=base,
        tip_link=tip.name,
        tip=tip.pose,
        tip_body=None if tip.body == len(moving) else tip.body,
        tips=tuple(Tip(name=name, link=end.name, frame=end.pose, body=end.body) for name, end in ended),
    )
    held = {name: value for name, value in values.items() if tree.joints[name].kind in MOVING}
    off_chain = [
        OffChainJoint(name, tuple(body.beyond(name)), held.get(name), leads.get(name, ""))
        for body in bodies
        for name in body.off_chain
    ]
    apart = tuple(name for name, link in tree.links.items() if name not in frames and link.shapes)
    notes += [note for body in bodies for note in body.faults] + [joint.note for joint in off_chain]
    notes += [f"no joint connects {', '.join(apart)} with {base!r}: left out"] if apart else []
    notes += _soft_limits(moving) + _massless(bodies)
    allowed = () if srdf is None else srdf.may_touch(frames)
    shapes = tuple((name, tree.links[name].shapes) for name in frames if tree.links[name].shapes)
    description = RobotDescription(
        chain=chain,
        links=tuple(frames.values()),
        shapes=shapes,
        off_chain=tuple(off_chain),
        locked=tuple(({name: value for name, value in held.items() if value is not None} | locked).items()),
        apart=apart,
        visuals=tuple((name, tree.links[name].visuals) for name in frames if tree.links[name].visuals),
        unseen=tuple((name, tree.links[name].unseen) for name in frames if tree.links[name].unseen),
        notes=(*notes, *file.notes, *(() if srdf is None else srdf.notes)),
        disabled=(*(pair for pair in file.may_touch if frames.keys() >= {*pair}), *allowed),
        postures=_postures(file, moving)
        | ({} if srdf is None else srdf.postures([joint.name for joint in moving], group)),
    )
    return description.with_covers({})


def _file(text: str) -> RobotFile:
    """The robot of a URDF or an MJCF, by the root element of its text."""
    root = document(text)
    return read_mjcf(root) if root.tag == "mujoco" else RobotFile(name=root.get("name") or "robot", tree=Tree.of(root))


@dataclass(frozen=True)
class _Ends:
    """The ends of a chain, or of several branches, as they are stated: links, or a group of an SRDF."""

    base_link: str | None
    tip_link: str | None
    srdf: Srdf | None
    group: str | None
    tips: Mapping[str, str]

    def branches(self, tree: Tree) -> Mapping[str, str]:
        """The ends of several branches by their names; none of a chain."""
        if self.tips or self.srdf is None or self.group is None or self.tip_link is not None:
            return self.tips
        return self.srdf.branches(tree, self.group)

    def chain(self, tree: Tree) -> tuple[str, list[UrdfJoint], list[str], str | None]:
        """The base, the joints from it to the tips, notes on what was not stated, and the group."""
        if branches := self.branches(tree):
            return *tree.branches(self.base_link, branches), self.group
        base, tip, group = self.base_link, self.tip_link, self.group
        if self.srdf is not None and (group is not None or tip is None):
            group = self.srdf.group_of(tree, group)
        if self.srdf is not None and group is not None and tip is None:
            first, tip = self.srdf.ends(tree, group)
            base = base or first
        return *tree.chain(base, tip), group


def _held(file: RobotFile, tree: Tree, ends: _Ends, posture: str) -> dict[str, float]:
    """The values, rad or m, that a named posture states of joints off the chain.

    Raises:
        InvalidProblem: ``locked`` names no posture, or one that states none of these.
    """
    states = [(name, values) for name, values in file.postures.items()]
    states += [] if ends.srdf is None else [(state.name, state.values) for state in ends.srdf.states]
    named = [values for name, values in states if name == posture]
    if not named:
        known = f"; there are {', '.join(dict.fromkeys(name for name, _ in states))}" if states else ""
        raise InvalidProblem("locked", f"no posture {posture!r}{known}")
    along = {joint.name for joint in ends.chain(tree)[1]}
    stated = {name: value for values in named for name, value in values.items()}
    held = {name: value for name, value in stated.items() if name not in along and name in tree.joints}
    if not held:
        raise InvalidProblem("locked", f"posture {posture!r} states no joint off the chain")
    return held


def _postures(file: RobotFile, moving: Sequence[UrdfJoint]) -> dict[str, tuple[float, ...]]:
    """The named postures that state all of some joints."""
    complete = {name: values for name, values in file.postures.items() if values.keys() >= {j.name for j in moving}}
    return {name: tuple(values[joint.name] for joint in moving) for name, values in complete.items()}


def _check(moving: list[UrdfJoint], base: str) -> None:
    if not moving:
        raise InvalidProblem("tip_link", f"no joint moves between {base!r} and the tip")
    if len(moving) > MOST_JOINTS:
        raise refused(f"{len(moving)} joints in a chain, of at most {MOST_JOINTS}")
    for joint in moving:
        if joint.kind not in MOVING:
            raise refused(f"joint {joint.name!r} of the chain is {joint.kind}, which cannot be planned")
        if joint.mimic is not None:
            raise refused(f"joint {joint.name!r} of the chain mimics {joint.mimic.joint!r}, which cannot be planned")


def _check_followers(
    tree: Tree, locked: Collection[str], base: str, along: Collection[str], leads: Mapping[str, str]
) -> None:
    """Check that no joint that mimics one of the chain is locked, or carries the base.

    Args:
        tree: as the file states it.
        locked: names of joints that are to be held.
        base: its link.
        along: names of the chain's joints.
        leads: joints of the chain, by the names of those that mimic them.
    """
    for name in locked:
        mimic = tree.joints[name].mimic
        lead = (
            "" if mimic is None or mimic.joint not in tree.joints else tree.lead(mimic.joint, [*along, *locked]).joint
        )
        if lead in along:
            raise InvalidProblem("locked", f"{name} mimics {lead}, which is planned: lock {lead}, or neither")
    link = base
    while link in tree.above:
        joint = tree.above[link]
        if joint.name in leads:
            reason = f"{base!r} itself moves with {leads[joint.name]!r} of the chain, which joint {joint.name!r} mimics"
            raise InvalidProblem("base_link", reason)
        link = joint.parent


@dataclass
class _Body:
    """A moving link, or the base, and all links that are fixed to it.

    Attributes:
        frames: of its links.
        inertias: of these, in its own frame.
        joints_between: joints off the chain between its first link and each, by the names of links.
        faults: why inertias are none.
    """

    frames: list[LinkFrame] = field(default_factory=list)
    inertias: list[Inertia] = field(default_factory=list)
    joints_between: dict[str, tuple[str, ...]] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)

    @property
    def off_chain(self) -> list[str]:
        """Joints off the chain that carry its links, each once."""
        return list(dict.fromkeys(name for way in self.joints_between.values() for name in way))

    def beyond(self, joint: str) -> Iterator[str]:
        """Links that a joint off the chain carries, as seen from the chain."""
        return (link for link, way in self.joints_between.items() if joint in way)


def _body(tree: Tree, first: LinkFrame, along: Collection[str], off_chain: Collection[str]) -> _Body:
    """A link and all links fixed to it, above it too, as far as no joint of the chain moves them."""
    body = _Body([first], joints_between={first.name: ()})
    for frame in body.frames:  # which grows
        for joint, link, pose in tree.around(frame.name):
            if joint.name not in along and link not in body.joints_between:
                body.joints_between[link] = (
                    *body.joints_between[frame.name],
                    *((joint.name,) if joint.name in off_chain else ()),
                )
                body.frames.append(LinkFrame(link, first.body, FixedFrame.of(frame.pose @ pose), frame.name))
    for frame in body.frames:
        inertia = tree.links[frame.name].inertia
        if inertia is not None:
            body.inertias.append(moved_inertia(inertia, frame.pose))
            reason = inertia_fault(inertia.matrix)
            body.faults += [] if reason is None else [f"link {frame.name!r}: no body has its inertia, {reason}"]
    return body


def _joint(joint: UrdfJoint, carrier: LinkFrame, body: _Body) -> ChainJoint:
    return ChainJoint(
        name=joint.name,
        link=joint.child,
        kind=JointKind(joint.kind),
        pose=FixedFrame.of(carrier.pose @ joint.origin),
        axis=joint.axis,
        parent=None if carrier.body == body.frames[0].body - 1 else carrier.body,
        position=joint.position if joint.has_range else None,
        speed=joint.speed,
        effort=joint.effort,
        damping=joint.damping,
        friction=joint.friction,
        inertia=combined(body.inertias),
        fault=next(iter(body.faults), ""),
    )


def _soft_limits(moving: list[UrdfJoint]) -> list[str]:
    """A note on joints that a safety controller slows down, which plans do not count on."""
    braked = [joint.name for joint in moving if joint.is_braked]
    return [f"soft limits bound {', '.join(braked)}; that speeds fall near them is not planned with"] if braked else []


def _massless(bodies: list[_Body]) -> list[str]:
    massless = [body.frames[0].name for body in bodies[1:] if not body.inertias]
    return [f"no masses stated for {', '.join(massless)}: torques are unknown"] if massless else []

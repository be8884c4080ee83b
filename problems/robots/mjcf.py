"""Robots from MJCF, the files of MuJoCo, as the same tree of links and joints that a URDF gives.

A body is a link, and so is a site, as a frame of the tool; what has no joint is fixed. Geoms that nothing collides with
are what is shown, all others are collision geometry: meshes themselves, not the hulls or fitted shapes by which MuJoCo
replaces them. A joint that an equality ties to another one mimics it, keyframes are named postures, and the force of an
actuator is the effort of its joint. MJCF states no speeds.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import count

import numpy as np

from problems.base import FloatArray, InvalidProblem
from problems.robots.appearance import Visual
from problems.robots.mjcf_elements import ACTUATORS, MAIN, Reader, unit
from problems.robots.shapes import Shape
from problems.robots.transform import FixedFrame, Transform, as_point
from problems.robots.urdf_elements import Mimic, UrdfJoint, UrdfLink, number, numbers, placed_at, point, refused
from problems.robots.urdf_tree import RobotFile, Tree

WORLD = "world"
UNREAD = ("attach", "composite", "flexcomp", "replicate")  # which make bodies
ENTRIES = {"free": 7, "ball": 4}  # that a joint has in a keyframe; others have one


def read_mjcf(root: ET.Element) -> RobotFile:
    """The robot that a ``mujoco`` element describes.

    Raises:
        InvalidProblem: ``urdf`` needs what is not read, or states what cannot be.
    """
    if root.find(".//include") is not None:
        raise refused("it includes other files, which only a scenario file or a path can name")
    bodies = _Bodies(root, Reader.of(root))
    for world in root.findall("worldbody"):
        bodies.add_content(world, WORLD, Transform(), MAIN)
    tree = Tree.checked([bodies.link(name) for name in bodies.contents], bodies.tied(bodies.joints))
    return RobotFile(
        name=root.get("model") or "robot",
        tree=tree,
        may_touch=tuple((pair.get("body1", ""), pair.get("body2", "")) for pair in root.iterfind("contact/exclude")),
        postures=bodies.postures(),
        notes=tuple(bodies.notes()),
    )


@dataclass
class _Content:
    """The element and the geometry of a link, in its own frame."""

    element: ET.Element | None = None
    shapes: list[Shape] = field(default_factory=list)
    visuals: list[Visual] = field(default_factory=list)
    unseen: str = ""


@dataclass
class _Bodies:
    """The bodies of a file, and the joints between them.

    Attributes:
        root: the ``mujoco`` element.
        reader: of its elements.
        contents: of links, by their names.
        joints: in the order of the file.
        entries: numbers that a keyframe has for each joint that moves, by its name, in order.
        references: the value of a joint in the posture in which the file states the bodies, by its name.
        armatures: joints with the inertia of a rotor.
    """

    root: ET.Element
    reader: Reader
    contents: dict[str, _Content] = field(default_factory=lambda: {WORLD: _Content()})
    joints: list[UrdfJoint] = field(default_factory=list)
    entries: dict[str, int] = field(default_factory=dict)
    references: dict[str, float] = field(default_factory=dict)
    armatures: list[str] = field(default_factory=list)

    def link(self, name: str) -> UrdfLink:
        """A link as a file of any kind states it."""
        content = self.contents[name]
        return UrdfLink(
            name=name,
            inertia=None if content.element is None else self.reader.inertia(content.element, f"body {name!r}"),
            shapes=tuple(content.shapes),
            visuals=() if content.unseen else tuple(content.visuals),
            unseen=content.unseen,
        )

    def add_content(self, element: ET.Element, link: str, pose: Transform, class_name: str) -> None:
        """Add geoms, sites and bodies in an element, whose frame has a pose in that of a link."""
        for inner in element:
            own_class = inner.get("childclass", class_name)
            if inner.tag == "body":
                self._add_body(inner, link, pose, own_class)
            elif inner.tag == "frame":
                self.add_content(inner, link, pose @ self.reader.pose(inner, f"a frame in {link!r}"), own_class)
            elif inner.tag == "geom":
                self._add_geom(self.reader.complete(inner, class_name), link, pose)
            elif inner.tag == "site" and inner.get("name") is not None:
                site = self.reader.complete(inner, class_name)
                self._fix(self._named(inner.attrib["name"]), link, pose @ self.reader.pose(site, f"a site of {link!r}"))
            elif inner.tag in UNREAD:
                raise refused(f"body {link!r}: <{inner.tag}> is not read: save the model as MuJoCo has compiled it")

    def _add_geom(self, geom: ET.Element, link: str, pose: Transform) -> None:
        owner, content = f"body {link!r}: geom {geom.get('name', '')!r}", self.contents[link]
        collides = any(geom.get(key, "1") != "0" for key in ("contype", "conaffinity"))
        try:
            visual = self.reader.visual(geom, owner)
        except InvalidProblem as error:
            if collides:
                raise
            content.unseen = error.reason
            return
        shape = replace(visual.shape, pose=FixedFrame.of(pose @ visual.shape.pose))
        if collides:
            content.shapes.append(shape)
        else:
            content.visuals.append(replace(visual, shape=shape))

    def _add_body(self, body: ET.Element, parent: str, pose: Transform, class_name: str) -> None:
        """Add a body with its joints: each but the last moves a link without geometry, and so do those beside it."""
        name = self._named(body.get("name") or next(f"body_{n}" for n in count(1) if f"body_{n}" not in self.contents))
        here, place = parent, pose @ self.reader.pose(body, f"body {name!r}")
        stated = [self.reader.complete(joint, class_name) for joint in body if joint.tag in ("joint", "freejoint")]
        for number_, element in enumerate(stated, 1):
            title = element.get("name") or f"{name}_joint" + (f"_{number_}" if len(stated) > 1 else "")
            joint, anchor = self._joint(element, title, here, place)
            is_last = number_ == len(stated) and not np.any(anchor)
            child = name if is_last else self._named(f"{name}_{title}")
            self.contents.setdefault(child, _Content())
            self.joints.append(replace(joint, child=child))
            here, place = child, Transform(translation=as_point(-anchor))
        if here != name:
            self._fix(name, here, place)
        self.contents[name].element = body
        self.add_content(body, name, Transform(), class_name)

    def _named(self, name: str) -> str:
        if name in self.contents:
            raise refused(f"two bodies, sites or joints make a link {name!r}")
        return name

    def _fix(self, name: str, link: str, pose: Transform) -> None:
        """Add a link that is fixed to another one."""
        self.contents[name] = _Content()
        self.joints.append(_unmoved(f"{name}_fixed", "fixed", link, pose))

    def _joint(self, element: ET.Element, name: str, parent: str, pose: Transform) -> tuple[UrdfJoint, FloatArray]:
        """A joint without its child, and the place in the body, (3,), m, about which it turns."""
        owner = f"joint {name!r}"
        kind = "free" if element.tag == "freejoint" else element.get("type", "hinge")
        if kind not in ("free", "ball", "slide", "hinge"):
            raise refused(f"{owner}: type {kind!r}; there are hinge, slide, ball and free")
        self.entries[name] = ENTRIES.get(kind, 1)
        if kind in ENTRIES:
            return _unmoved(name, "floating", parent, pose), np.zeros(3)
        turns = kind == "hinge"
        axis = as_point(unit(point(element, "axis", (0.0, 0.0, 1.0), owner), owner))
        anchor = np.array(point(element, "pos", (0.0, 0.0, 0.0), owner)) if turns else np.zeros(3)
        reference = number(element, "ref", owner) or 0.0
        self.references[name] = self.reader.angle(reference) if turns else reference
        self.armatures += [name] if number(element, "armature", owner) else []
        at_zero = placed_at(pose @ Transform(translation=as_point(anchor)), axis, turns, -self.references[name])
        position = self._range(element, turns, owner)
        joint = _unmoved(
            name, "prismatic" if not turns else "continuous" if position is None else "revolute", parent, at_zero
        )
        friction = [max(number(element, key, owner) or 0.0, 0.0) for key in ("damping", "frictionloss")]
        return replace(
            joint,
            axis=axis,
            position=position,
            effort=self._effort(element, name),
            damping=friction[0],
            friction=friction[1],
        ), anchor

    def _range(self, joint: ET.Element, turns: bool, owner: str) -> tuple[float, float] | None:
        """The range of a joint, rad or m; None where it has none."""
        if not _is_limited(joint, "limited", "range", self.reader):
            return None
        low, high = numbers(joint, "range", 2, (0.0, 0.0), owner)
        if not low < high:
            raise refused(f"{owner}: its range {low:g} to {high:g} is empty")
        return (self.reader.angle(low), self.reader.angle(high)) if turns else (low, high)

    def _effort(self, joint: ET.Element, name: str) -> float | None:
        """The least that the joint and its actuators allow either way, N m or N; None where nothing is stated."""
        known = []
        if _is_limited(joint, "actuatorfrclimited", "actuatorfrcrange", self.reader):
            known.append(_either_way(joint, "actuatorfrcrange", name))
        for element in self._actuators(name):
            owner = f"actuator of {name!r}"
            gear = abs(float(element.get("gear", "1").split()[0]))
            if _is_limited(element, "forcelimited", "forcerange", self.reader):
                known.append(gear * _either_way(element, "forcerange", owner))
            if element.tag == "motor" and _is_limited(element, "ctrllimited", "ctrlrange", self.reader):
                known.append(gear * _either_way(element, "ctrlrange", owner))
        return min(known, default=0.0) or None

    def _actuators(self, joint: str) -> Iterator[ET.Element]:
        for element in self.root.iterfind("actuator/*"):
            if element.tag in ACTUATORS and element.get("joint") == joint:
                yield self.reader.complete(element, MAIN)

    def tied(self, joints: list[UrdfJoint]) -> list[UrdfJoint]:
        """The joints, of which those that an equality ties to another one mimic it."""
        rules = {}
        for element in self.root.iterfind("equality/joint"):
            tie = self.reader.complete(element, MAIN)
            name, other = tie.get("joint1", ""), tie.get("joint2")
            if tie.get("active", "true") == "false" or other is None:
                continue
            offset, factor, *bent = numbers(tie, "polycoef", 5, (0.0, 1.0, 0.0, 0.0, 0.0), f"equality of {name!r}")
            if any(bent):
                raise refused(f"joint {name!r} follows {other!r} along a curve, which is not read")
            known = self.references
            rules[name] = Mimic(other, factor, offset + known.get(name, 0.0) - factor * known.get(other, 0.0))
        return [replace(joint, mimic=rules.get(joint.name)) for joint in joints]

    def postures(self) -> dict[str, Mapping[str, float]]:
        """The values of the joints in each keyframe that has a name, by the names of both."""
        named: dict[str, Mapping[str, float]] = {}
        for key in self.root.iterfind("keyframe/key"):
            if key.get("name") is None or key.get("qpos") is None:
                continue
            owner = f"keyframe {key.attrib['name']!r}"
            values = iter(numbers(key, "qpos", sum(self.entries.values()), (), owner))
            each = {joint: [next(values) for _ in range(entries)] for joint, entries in self.entries.items()}
            named[key.attrib["name"]] = {joint: own[0] for joint, own in each.items() if len(own) == 1}
        return named

    def notes(self) -> Iterator[str]:
        """Lines on what is not planned with."""
        if self.armatures:
            yield f"the inertia of rotors (armature) of {', '.join(self.armatures)} is not planned with"
        kinds = sorted({element.tag for element in self.root.iterfind("equality/*")} - {"joint"})
        if kinds:
            yield f"equalities of kind {', '.join(kinds)} are not kept: what they move stands as its joints say"


def _unmoved(name: str, kind: str, parent: str, pose: Transform) -> UrdfJoint:
    """A joint of which only the pose is known, without its child."""
    return UrdfJoint(
        name=name, kind=kind, parent=parent, child=name.removesuffix("_fixed"), origin=pose, axis=(1.0, 0.0, 0.0),
        position=None, speed=None, effort=None, damping=0.0, friction=0.0, mimic=None,
    )  # fmt: skip


def _is_limited(element: ET.Element, switch: str, key: str, reader: Reader) -> bool:
    """Whether a range of an element counts: it is switched on, or it is stated and nothing says otherwise."""
    stated = element.get(switch, "auto")
    return stated == "true" or (
        stated == "auto" and key in element.attrib and reader.setting("autolimits", "true") == "true"
    )


def _either_way(element: ET.Element, key: str, owner: str) -> float:
    low, high = numbers(element, key, 2, (0.0, 0.0), owner)
    return min(abs(low), abs(high))

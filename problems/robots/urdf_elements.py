"""The elements of a URDF file, one at a time: links, joints, inertias, collision and visual geometry."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np

from problems.base import COORDINATES, MASSES, InvalidProblem, number_of, shown
from problems.robots.appearance import Colour, Visual, colour_of
from problems.robots.inertia import Inertia, moved_inertia
from problems.robots.shapes import BoxShape, CapsuleShape, CylinderShape, MeshShape, Shape, SphereShape
from problems.robots.transform import (
    FixedFrame,
    Point3,
    Transform,
    as_point,
    from_angles,
    matrix_of,
    moved,
    snapped,
)

MOST_CHARACTERS = 10_000_000
NUMBERS = (-1e12, 1e12)  # of any attribute; masses and inertias included


class WithoutDoctype(ET.TreeBuilder):
    """A builder of elements that refuses document types, whose entities may grow without end."""

    def doctype(self, *_: str | None) -> None:
        """Refuse a document type before an entity is read."""
        raise refused("a document type (DOCTYPE) is not read")


def refused(reason: str) -> InvalidProblem:
    """The error for a URDF that cannot be read or planned with."""
    return InvalidProblem("urdf", reason)


def document(text: str) -> ET.Element:
    """The ``robot`` element of a URDF, or the ``mujoco`` element of an MJCF.

    Raises:
        InvalidProblem: it is too long, no XML, neither of them, or a xacro that has to be expanded first.
    """
    if len(text) > MOST_CHARACTERS:
        raise refused(f"{len(text)} characters, of at most {MOST_CHARACTERS}")
    try:
        robot = ET.fromstring(text, ET.XMLParser(target=WithoutDoctype()))
    except (ET.ParseError, UnicodeError) as error:
        reason = (
            XACRO if "unbound prefix" in str(error) and "xacro:" in text else f"no XML: {' '.join(str(error).split())}"
        )
        raise refused(reason) from error
    if robot.tag not in ROOTS:
        raise refused(f"its root is <{robot.tag}>, not {' or '.join(f'<{tag}>' for tag in ROOTS)}")
    if any(_is_of_xacro(element) for element in robot.iter()):
        raise refused(XACRO)
    return robot


ROOTS = ("robot", "mujoco")
XACRO = "a xacro file: let its name end with .xacro, or expand it first (xacro FILE > robot.urdf)"


def _is_of_xacro(element: ET.Element) -> bool:
    namespace = element.tag.rpartition("}")[0]
    return "xacro" in namespace or any("${" in value or "$(" in value for value in element.attrib.values())


def name_of(element: ET.Element, key: str = "name") -> str:
    """The value of an attribute that must be there."""
    value = element.get(key)
    if not value:
        raise refused(f"<{element.tag}> without {key!r}")
    return value


def numbers(element: ET.Element, key: str, count: int, default: Sequence[float], owner: str) -> tuple[float, ...]:
    """The numbers, so many, in an attribute of the element of ``owner``.

    Raises:
        InvalidProblem: other numbers, or something else.
    """
    text = element.get(key)
    if text is None:
        return tuple(default)
    try:
        values = tuple(map(number_of, text.split()))
    except ValueError:
        raise refused(f"{owner}: {key} of <{element.tag}> is {text[:40]!r}, which are no numbers") from None
    if len(values) != count:
        raise refused(f"{owner}: {key} of <{element.tag}> has {len(values)} numbers, not {count}")
    for value in values:
        if not NUMBERS[0] <= value <= NUMBERS[1]:
            raise refused(f"{owner}: {key} of <{element.tag}> is {shown(value)}, out of range")
    return values


def number(element: ET.Element | None, key: str, owner: str) -> float | None:
    """The number in an attribute, or None where element or attribute is missing."""
    if element is None or element.get(key) is None:
        return None
    return numbers(element, key, 1, (), owner)[0]


def point(element: ET.Element, key: str, default: Point3, owner: str) -> Point3:
    """Three numbers in an attribute."""
    x, y, z = numbers(element, key, 3, default, owner)
    return x, y, z


def origin(element: ET.Element, owner: str) -> Transform:
    """The pose that an element's ``origin`` states: none is the identity."""
    found = element.find("origin")
    if found is None:
        return Transform()
    translation = point(found, "xyz", (0.0, 0.0, 0.0), owner)
    if not all(COORDINATES[0] <= part <= COORDINATES[1] for part in translation):
        raise refused(f"{owner}: xyz of <origin> is out of range")
    if found.get("quat_xyzw") is None:
        return Transform(from_angles(point(found, "rpy", (0.0, 0.0, 0.0), owner)), translation)
    if found.get("rpy") is not None:
        raise refused(f"{owner}: <origin> has both rpy and quat_xyzw: state one of them")
    quaternion = np.array(numbers(found, "quat_xyzw", 4, (), owner))
    length = float(np.linalg.norm(quaternion))
    if not length > 1e-6:
        raise refused(f"{owner}: quat_xyzw of <origin> is zero")
    return Transform(matrix_of((quaternion / length).tolist()), translation)


MOVING = ("revolute", "continuous", "prismatic")
KINDS = (*MOVING, "fixed", "floating", "planar")


@dataclass(frozen=True, kw_only=True)
class UrdfLink:
    """A body as the file states it, in its own frame.

    Attributes:
        name: unique.
        inertia: None where the file has no ``inertial``.
        shapes: of its collision geometry.
        visuals: of its visual geometry; none where any of it cannot be read.
        unseen: why, in a line; empty where all of it can.
    """

    name: str
    inertia: Inertia | None
    shapes: tuple[Shape, ...]
    visuals: tuple[Visual, ...] = ()
    unseen: str = ""


@dataclass(frozen=True)
class Mimic:
    """The rule by which a joint follows another: multiplier times its value and an offset, rad or m."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0

    def at(self, value: float) -> float:
        """The value of the joint, rad or m, when the other has a value."""
        return self.multiplier * value + self.offset


@dataclass(frozen=True, kw_only=True)
class UrdfJoint:
    """A joint as the file states it; None where it does not.

    Attributes:
        name: unique.
        kind: one of ``KINDS``.
        parent: name of the link that carries it.
        child: name of the link that it moves.
        origin: of the child's frame in the parent's, at zero.
        axis: unit vector.
        position: (lowest, highest), rad or m.
        speed: rad/s or m/s.
        effort: N m or N.
        damping: N m s or N s/m.
        friction: N m or N.
        mimic: how it follows another; None where it does not.
        is_braked: whether a safety controller slows it down near the ends of its range.
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Transform
    axis: Point3
    position: tuple[float, float] | None
    speed: float | None
    effort: float | None
    damping: float
    friction: float
    mimic: Mimic | None
    is_braked: bool = False

    @property
    def has_range(self) -> bool:
        """Whether the range of the joint is stated and not empty."""
        return self.position is not None and self.position[0] < self.position[1]

    @property
    def usual(self) -> float:
        """The value 0 if it is in the range, else its middle, as ROS's publisher of joint states has it."""
        low, high = self.position if self.position is not None and self.kind in MOVING else (0.0, 0.0)
        return 0.0 if low <= 0.0 <= high else (low + high) / 2.0

    def at(self, value: float) -> UrdfJoint:
        """The joint fixed at a value, rad or m; at none if it has several degrees of freedom."""
        if self.kind not in MOVING:
            return replace(self, kind="fixed")
        return replace(self, kind="fixed", origin=placed_at(self.origin, self.axis, self.kind != "prismatic", value))


def placed_at(pose: Transform, axis: Point3, turns: bool, value: float) -> Transform:
    """The pose, in numbers, of what a joint moves when it has a value, rad or m.

    Args:
        pose: of it at zero.
        axis: unit vector.
        turns: whether the joint is revolute; else it slides.
        value: of the joint.
    """
    reached = moved(pose, axis, turns, ca.DM(value))
    entries = [[float(entry) for entry in row] for row in (*reached.rotation, reached.translation)]
    return Transform(snapped(np.array(entries[:3])), as_point(entries[3]))


def read_link(element: ET.Element, colours: Mapping[str, Colour]) -> UrdfLink:
    """The link that a ``link`` element states.

    Args:
        element: of it.
        colours: of materials, by their names.

    Raises:
        InvalidProblem: it has impossible numbers.
    """
    name = name_of(element)
    owner = f"link {name!r}"
    shapes: list[Shape] = []
    for collision in element.findall("collision"):
        pose = FixedFrame.of(origin(collision, owner))
        shapes += [_shape(shape, owner, pose) for shape in collision.iterfind("geometry/*")]
    visuals, unseen = _visuals(element, owner, colours)
    return UrdfLink(name=name, inertia=_inertia(element, owner), shapes=tuple(shapes), visuals=visuals, unseen=unseen)


def read_colours(robot: ET.Element) -> dict[str, Colour]:
    """The colours that are stated for materials anywhere in a ``robot``, by the materials' names."""
    stated = ((material.get("name", ""), _stated_colour(material)) for material in robot.iter("material"))
    return {name: colour for name, colour in stated if colour}


def _stated_colour(material: ET.Element) -> Colour:
    """The colour of a ``material``; empty where it states none, or one that cannot be read."""
    colour = material.find("color")
    try:
        return "" if colour is None else colour_of(numbers(colour, "rgba", 4, (), "material"))
    except InvalidProblem:
        return ""


def _visuals(element: ET.Element, owner: str, colours: Mapping[str, Colour]) -> tuple[tuple[Visual, ...], str]:
    """The visual geometry of a link, or nothing and the reason."""
    visuals = []
    try:
        for visual in element.findall("visual"):
            pose = FixedFrame.of(origin(visual, owner))
            material = visual.find("material")
            colour = "" if material is None else _stated_colour(material) or colours.get(material.get("name", ""), "")
            shapes = [_shape(shape, owner, pose) for shape in visual.iterfind("geometry/*")]
            visuals += [Visual(shape, colour) for shape in shapes]
    except InvalidProblem as error:
        return (), error.reason
    return tuple(visuals), ""


def _shape(shape: ET.Element, owner: str, pose: FixedFrame) -> Shape:
    def size(key: str) -> float:
        value = number(shape, key, owner)
        if value is None or not 0.0 < value <= 1e4:
            raise refused(f"{owner}: {key} of <{shape.tag}> must be a length above 0 m")
        return value

    if shape.tag == "sphere":
        return SphereShape(pose, radius=size("radius"))
    if shape.tag == "cylinder":
        return CylinderShape(pose, radius=size("radius"), length=size("length"))
    if shape.tag == "capsule":
        return CapsuleShape(pose, radius=size("radius"), length=size("length"))
    if shape.tag == "box":
        sizes = point(shape, "size", (0.0, 0.0, 0.0), owner)
        if not all(0.0 < part <= 1e4 for part in sizes):
            raise refused(f"{owner}: size of <box> must be three lengths above 0 m")
        return BoxShape(pose, sizes=sizes)
    if shape.tag == "mesh":
        scale = point(shape, "scale", (1.0, 1.0, 1.0), owner)
        if not all(1e-9 <= abs(part) <= 1e9 for part in scale):
            raise refused(f"{owner}: scale of <mesh> must be three factors other than 0")
        return MeshShape(pose, file=shape.get("filename", "?"), scale=scale)
    raise refused(f"{owner}: a shape <{shape.tag}>; there are box, cylinder, sphere, capsule and mesh")


def _inertia(element: ET.Element, owner: str) -> Inertia | None:
    inertial = element.find("inertial")
    mass = None if inertial is None else number(inertial.find("mass"), "value", owner)
    if inertial is None or mass is None:
        return None
    if not 0.0 <= mass <= MASSES[1]:
        raise refused(f"{owner}: a mass of {mass:g} kg; from 0 to {MASSES[1]:g} kg can be computed with")
    matrix = inertial.find("inertia")
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    xx, xy, xz, yy, yz, zz = (0.0 if matrix is None else numbers(matrix, key, 1, (0.0,), owner)[0] for key in keys)
    at_center = Inertia(mass=mass, matrix=((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    return moved_inertia(at_center, origin(inertial, owner))


def read_joint(element: ET.Element) -> UrdfJoint:
    """The joint that a ``joint`` element states.

    Raises:
        InvalidProblem: it has impossible numbers, or lacks its links.
    """
    name = name_of(element)
    owner = f"joint {name!r}"
    kind = element.get("type", "")
    if kind not in KINDS:
        raise refused(f"{owner}: type {kind!r}; there are {', '.join(KINDS)}")
    limit, dynamics, mimic, safety = (element.find(tag) for tag in ("limit", "dynamics", "mimic", "safety_controller"))
    position = _position(limit, kind, owner)
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=_link(element, "parent", owner),
        child=_link(element, "child", owner),
        origin=origin(element, owner),
        axis=_axis(element, owner),
        position=position if safety is None or position is None else _softened(position, safety, owner),
        speed=_not_negative(limit, "velocity", owner) or None,  # exporters write 0 for what they do not know
        effort=_not_negative(limit, "effort", owner) or None,
        damping=_not_negative(dynamics, "damping", owner) or 0.0,
        friction=_not_negative(dynamics, "friction", owner) or 0.0,
        mimic=None if mimic is None else _mimic(mimic, owner),
        is_braked=safety is not None and position is not None,
    )


def _mimic(element: ET.Element, owner: str) -> Mimic:
    multiplier, offset = number(element, "multiplier", owner), number(element, "offset", owner)
    return Mimic(name_of(element, "joint"), 1.0 if multiplier is None else multiplier, offset or 0.0)


def _not_negative(element: ET.Element | None, key: str, owner: str) -> float | None:
    value = number(element, key, owner)
    if element is not None and value is not None and value < 0.0:
        raise refused(f"{owner}: {key} of <{element.tag}> is {value:g}, below 0")
    return value


def _link(element: ET.Element, tag: str, owner: str) -> str:
    found = element.find(tag)
    if found is None:
        raise refused(f"{owner}: no <{tag}>")
    return name_of(found, "link")


def _axis(element: ET.Element, owner: str) -> Point3:
    found = element.find("axis")
    axis = (1.0, 0.0, 0.0) if found is None else point(found, "xyz", (1.0, 0.0, 0.0), owner)
    length = float(np.linalg.norm(axis))
    if element.get("type") in MOVING and not length > 1e-6:
        raise refused(f"{owner}: its axis is zero")
    return as_point([part / length if length else 0.0 for part in axis])


def _position(limit: ET.Element | None, kind: str, owner: str) -> tuple[float, float] | None:
    if limit is None or kind == "continuous" or (limit.get("lower") is None and limit.get("upper") is None):
        return None
    low, high = (number(limit, key, owner) or 0.0 for key in ("lower", "upper"))
    if low > high:
        raise refused(f"{owner}: lower limit {low:g} is above upper limit {high:g}")
    return (low, high) if low < high or low != 0.0 else None  # exporters write zeros for what they do not know


def _softened(position: tuple[float, float], safety: ET.Element, owner: str) -> tuple[float, float]:
    """A range within the soft limits of a ``safety_controller``, beyond which a joint is only let back.

    Two limits of one value say nothing: exporters write zeros for what they do not know.
    """
    stated = (number(safety, key, owner) for key in ("soft_lower_limit", "soft_upper_limit"))
    soft = [end if limit is None else limit for end, limit in zip(position, stated, strict=True)]
    if soft[0] == soft[1]:
        return position
    return max(position[0], soft[0]), min(position[1], soft[1])

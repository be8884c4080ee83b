"""URDF text as elements, and numbers in them. Text is not trusted: its size is bounded, entities are refused."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence

from problems.base.errors import InvalidProblem
from problems.base.ranges import COORDINATES, shown
from problems.robots.rigid.inertia import Point3
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.rotations import from_angles

MOST_CHARACTERS = 10_000_000
NUMBERS = (-1e12, 1e12)  # of any attribute; masses and inertias included


class WithoutDoctype(ET.TreeBuilder):
    """Builds elements; refuses document types, in which entities that grow without end are declared."""

    def doctype(self, *_: str | None) -> None:
        """Refuse it before an entity is read."""
        raise refused("a document type (DOCTYPE) is not read")


def refused(reason: str) -> InvalidProblem:
    """The error for a URDF that cannot be read or planned with."""
    return InvalidProblem("urdf", reason)


def document(text: str) -> ET.Element:
    """The ``robot`` element of a text.

    Raises:
        InvalidProblem: it is too long, no XML, no URDF, or a xacro that has to be expanded first.
    """
    if len(text) > MOST_CHARACTERS:
        raise refused(f"{len(text)} characters, of at most {MOST_CHARACTERS}")
    try:
        robot = ET.fromstring(text, ET.XMLParser(target=WithoutDoctype()))
    except (ET.ParseError, UnicodeError) as error:
        raise refused(f"no XML: {' '.join(str(error).split())}") from error
    if robot.tag != "robot":
        raise refused(f"its root is <{robot.tag}>, not <robot>")
    if any("ros.org/wiki/xacro" in element.tag for element in robot.iter()):
        raise refused("a xacro file: expand it to a URDF first (xacro FILE > robot.urdf)")
    return robot


def name_of(element: ET.Element, key: str = "name") -> str:
    """An attribute that must be there."""
    value = element.get(key)
    if not value:
        raise refused(f"<{element.tag}> without {key!r}")
    return value


def numbers(element: ET.Element, key: str, count: int, default: Sequence[float], owner: str) -> tuple[float, ...]:
    """So many numbers in an attribute of the element of ``owner``.

    Raises:
        InvalidProblem: other numbers, or something else.
    """
    text = element.get(key)
    if text is None:
        return tuple(default)
    try:
        values = tuple(float(part) for part in text.split())
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
    return Transform(from_angles(point(found, "rpy", (0.0, 0.0, 0.0), owner)), translation)

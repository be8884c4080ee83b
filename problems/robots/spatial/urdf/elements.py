"""Links and joints as a URDF states them, before they become a chain."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np

from problems.robots.rigid.inertia import Inertia, Point3
from problems.robots.rigid.transform import Transform
from problems.robots.spatial.collision.covering import Ball, cover_box, cover_cylinder, covered_capsule
from problems.robots.spatial.pose import as_point
from problems.robots.spatial.urdf.document import name_of, number, numbers, origin, point, refused
from problems.robots.spatial.urdf.masses import moved_inertia

MOVING = ("revolute", "continuous", "prismatic")
KINDS = (*MOVING, "fixed", "floating", "planar")


@dataclass(frozen=True, kw_only=True)
class UrdfLink:
    """A body as the file states it, in its own frame.

    Attributes:
        name: unique.
        inertia: None where the file has no ``inertial``.
        balls: that hold its collision shapes.
        meshes: file names of collision meshes, which are not read.
    """

    name: str
    inertia: Inertia | None
    balls: tuple[Ball, ...]
    meshes: tuple[str, ...]


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
        mimic: name of the joint that it follows.
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
    mimic: str | None


def read_link(element: ET.Element) -> UrdfLink:
    """A ``link`` element.

    Raises:
        InvalidProblem: it has impossible numbers.
    """
    name = name_of(element)
    owner = f"link {name!r}"
    balls: list[Ball] = []
    meshes: list[str] = []
    for collision in element.findall("collision"):
        pose = origin(collision, owner)
        for shape in collision.iterfind("geometry/*"):
            if shape.tag == "mesh":
                meshes.append(shape.get("filename", "?"))
            else:
                balls += [ball.seen_from(pose) for ball in _balls(shape, owner)]
    return UrdfLink(name=name, inertia=_inertia(element, owner), balls=tuple(balls), meshes=tuple(meshes))


def _balls(shape: ET.Element, owner: str) -> tuple[Ball, ...]:
    def size(key: str) -> float:
        value = number(shape, key, owner)
        if value is None or not 0.0 < value <= 1e4:
            raise refused(f"{owner}: {key} of <{shape.tag}> must be a length above 0 m")
        return value

    if shape.tag == "sphere":
        return (Ball((0.0, 0.0, 0.0), size("radius")),)
    if shape.tag == "cylinder":
        return cover_cylinder(size("radius"), size("length"))
    if shape.tag == "capsule":
        half = size("length") / 2
        return covered_capsule((0.0, 0.0, -half), (0.0, 0.0, half), size("radius"))
    if shape.tag == "box":
        sizes = point(shape, "size", (0.0, 0.0, 0.0), owner)
        if not all(0.0 < part <= 1e4 for part in sizes):
            raise refused(f"{owner}: size of <box> must be three lengths above 0 m")
        return cover_box(sizes)
    raise refused(f"{owner}: a collision shape <{shape.tag}>; there are box, cylinder, sphere, capsule and mesh")


def _inertia(element: ET.Element, owner: str) -> Inertia | None:
    inertial = element.find("inertial")
    mass = None if inertial is None else number(inertial.find("mass"), "value", owner)
    if inertial is None or mass is None:
        return None
    if mass < 0.0:
        raise refused(f"{owner}: a mass of {mass:g} kg")
    matrix = inertial.find("inertia")
    keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    xx, xy, xz, yy, yz, zz = (0.0 if matrix is None else numbers(matrix, key, 1, (0.0,), owner)[0] for key in keys)
    at_center = Inertia(mass=mass, matrix=((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
    return moved_inertia(at_center, origin(inertial, owner))


def read_joint(element: ET.Element) -> UrdfJoint:
    """A ``joint`` element.

    Raises:
        InvalidProblem: it has impossible numbers, or lacks its links.
    """
    name = name_of(element)
    owner = f"joint {name!r}"
    kind = element.get("type", "")
    if kind not in KINDS:
        raise refused(f"{owner}: type {kind!r}; there are {', '.join(KINDS)}")
    limit, dynamics, mimic = (element.find(tag) for tag in ("limit", "dynamics", "mimic"))
    return UrdfJoint(
        name=name,
        kind=kind,
        parent=_link(element, "parent", owner),
        child=_link(element, "child", owner),
        origin=origin(element, owner),
        axis=_axis(element, owner),
        position=_position(limit, kind, owner),
        speed=_not_negative(limit, "velocity", owner) or None,  # exporters write 0 for what they do not know
        effort=_not_negative(limit, "effort", owner) or None,
        damping=_not_negative(dynamics, "damping", owner) or 0.0,
        friction=_not_negative(dynamics, "friction", owner) or 0.0,
        mimic=None if mimic is None else mimic.get("joint", "?"),
    )


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
    return (low, high) if low < high else None

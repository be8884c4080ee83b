"""The elements of an MJCF file of MuJoCo, one at a time: classes of defaults, poses, geoms, inertias and joints.

Conventions are those of the XML reference: https://mujoco.readthedocs.io/en/stable/XMLreference.html.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import radians
from pathlib import PurePosixPath
from typing import TypeAlias

import numpy as np

from problems.base import MASSES, FloatArray
from problems.geometry import ball_corners
from problems.robots.appearance import Colour, Visual, colour_of
from problems.robots.inertia import Inertia, as_matrix, moved_inertia
from problems.robots.shapes import BoxShape, CapsuleShape, CylinderShape, HullShape, MeshShape, Shape, SphereShape
from problems.robots.transform import FixedFrame, Point3, Transform, about, as_point, compose, matrix_of
from problems.robots.urdf_elements import number, numbers, point, refused

Classes: TypeAlias = dict[str, dict[str, dict[str, str]]]  # attributes by the names of a class and of an element
MAIN = "main"
ACTUATORS = ("general", "motor", "position", "velocity", "intvelocity", "damper", "cylinder", "muscle", "adhesion")
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3}  # numbers that a size has
WITHOUT_END = ("plane", "hfield", "sdf")
Z = np.array([0.0, 0.0, 1.0])
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Mesh:
    """A mesh of the assets: its file, the scale of its coordinates, and the pose that these are stated in."""

    file: str
    scale: Point3
    reference: FixedFrame


@dataclass(frozen=True, eq=False)
class Reader:
    """A reader of elements, with the units, classes, meshes and colours of their file.

    Attributes:
        root: the ``mujoco`` element.
        classes: of defaults.
        meshes: by their names.
        colours: of materials, by their names.
    """

    root: ET.Element
    classes: Classes = field(default_factory=dict)
    meshes: dict[str, Mesh] = field(default_factory=dict)
    colours: dict[str, Colour] = field(default_factory=dict)

    @classmethod
    def of(cls, root: ET.Element) -> Reader:
        """The reader of the elements of a ``mujoco`` element.

        Raises:
            InvalidProblem: its defaults or meshes are impossible.
        """
        reader = cls(root, _classes(root))
        for element in root.iterfind("asset/mesh"):
            mesh = reader.complete(element, MAIN)
            file = mesh.get("file")
            if file is None:
                raise refused(f"mesh {mesh.get('name', '?')!r} of <asset> names no file: its vertices are not read")
            owner = f"mesh {file!r}"
            translation = point(mesh, "refpos", (0.0, 0.0, 0.0), owner)
            reference = FixedFrame(_of_quaternion(numbers(mesh, "refquat", 4, (1, 0, 0, 0), owner), owner), translation)
            scale = point(mesh, "scale", (1.0, 1.0, 1.0), owner)
            if not all(1e-9 <= abs(part) <= 1e9 for part in scale):
                raise refused(f"{owner}: scale must be three factors other than 0")
            name = mesh.get("name") or PurePosixPath(file).stem
            reader.meshes[name] = Mesh(reader._place(file), scale, reference)
        for element in root.iterfind("asset/material"):
            material = reader.complete(element, MAIN)
            reader.colours[element.get("name", "")] = _colour(material, "material")
        return reader

    def _place(self, file: str) -> str:
        folder = self.setting("meshdir", self.setting("assetdir", ""))
        name = PurePosixPath(file).name if self.setting("strippath", "false") == "true" else file
        return str(PurePosixPath(folder) / name)

    def setting(self, key: str, default: str) -> str:
        """A setting of the compiler; the last that is stated counts."""
        return next(
            (each.attrib[key] for each in reversed(self.root.findall("compiler")) if key in each.attrib), default
        )

    def complete(self, element: ET.Element, class_name: str) -> ET.Element:
        """An element with the attributes that its class, or else the one around it, states by default.

        Raises:
            InvalidProblem: there is no such class.
        """
        name = element.get("class", class_name)
        if name not in self.classes:
            raise refused(f"<{element.tag}>: no default class {name!r}; there are {', '.join(self.classes)}")
        return ET.Element(element.tag, self.classes[name].get(_kind(element.tag), {}) | element.attrib)

    def angle(self, value: float) -> float:
        """A stated angle, rad."""
        return value if self.setting("angle", "degree") == "radian" else radians(value)

    def pose(self, element: ET.Element, owner: str) -> FixedFrame:
        """The pose that an element states; an orientation in other words than a quaternion goes before that."""
        return FixedFrame.of(Transform(self._rotation(element, owner), point(element, "pos", (0.0, 0.0, 0.0), owner)))

    def _rotation(self, element: ET.Element, owner: str) -> tuple[Point3, Point3, Point3]:
        if element.get("axisangle") is not None:
            *axis, angle = numbers(element, "axisangle", 4, (), owner)
            return _turn(unit(axis, owner), self.angle(angle))
        if element.get("xyaxes") is not None:
            rows = np.array(numbers(element, "xyaxes", 6, (), owner)).reshape(2, 3)
            x = unit(rows[0], owner)
            y = unit(rows[1] - x * (x @ rows[1]), owner)
            return as_matrix(np.column_stack([x, y, np.cross(x, y)]))
        if element.get("zaxis") is not None:
            return towards(np.array(point(element, "zaxis", (0.0, 0.0, 1.0), owner)), owner)
        if element.get("euler") is not None:
            return self._euler(point(element, "euler", (0.0, 0.0, 0.0), owner))
        return _of_quaternion(numbers(element, "quat", 4, (1.0, 0.0, 0.0, 0.0), owner), owner)

    def _euler(self, angles: Point3) -> tuple[Point3, Point3, Point3]:
        """Turns about axes that move with the body (small letters) or stand still (capitals), in order."""
        rotation = matrix_of((0.0, 0.0, 0.0, 1.0))
        for letter, angle in zip(self.setting("eulerseq", "xyz"), angles, strict=False):
            if letter.lower() not in AXES:
                raise refused(f"eulerseq of <compiler> has {letter!r}; there are x, y, z, X, Y, Z")
            turn = _turn(AXES[letter.lower()], self.angle(angle))
            pair = (rotation, turn) if letter.islower() else (turn, rotation)
            rotation = as_matrix(np.array(compose(*pair), dtype=float))
        return rotation

    def shape(self, geom: ET.Element, owner: str) -> Shape:
        """The shape of a geom, completed by its defaults; the mesh itself of one that is fitted to a mesh.

        Raises:
            InvalidProblem: it has no end, needs what is not read, or its numbers are impossible.
        """
        kind = geom.get("type", "sphere")
        if kind in WITHOUT_END:
            advice = "name the file of the robot alone, and state what is around it as obstacles"
            raise refused(f"{owner}: a geom of type {kind!r} is not read: {advice}")
        if kind == "mesh" or (kind in SIZES and geom.get("mesh") is not None):
            return self._mesh(geom, owner)
        if kind not in SIZES:
            raise refused(f"{owner}: a geom of type {kind!r}; there are {', '.join(SIZES)} and mesh")
        return self._primitive(geom, kind, owner)

    def _mesh(self, geom: ET.Element, owner: str) -> Shape:
        mesh = self.meshes.get(geom.get("mesh", ""))
        if mesh is None:
            raise refused(f"{owner}: no mesh {geom.get('mesh', '')!r} in <asset>")
        pose = FixedFrame.of(self.pose(geom, owner) @ mesh.reference.inverse)
        return MeshShape(pose, file=mesh.file, scale=mesh.scale)

    def _primitive(self, geom: ET.Element, kind: str, owner: str) -> Shape:
        ends = geom.get("fromto")
        count = SIZES[kind] - (ends is not None and kind != "sphere")
        text = geom.get("size", "").split()
        sizes = list(numbers(ET.Element("geom", {"size": " ".join(text[:count])}), "size", count, (), owner))
        pose = self.pose(geom, owner)
        if ends is not None and kind != "sphere":
            one, two = np.array(numbers(geom, "fromto", 6, (), owner)).reshape(2, 3)
            pose = FixedFrame(towards(one - two, owner), as_point((one + two) / 2.0))
            sizes.append(float(np.linalg.norm(one - two)) / 2.0)
        if len(sizes) != SIZES[kind] or not all(0.0 < size <= 1e4 for size in sizes):
            raise refused(f"{owner}: size of a geom of type {kind!r} must be {SIZES[kind]} lengths above 0 m")
        match kind:
            case "sphere":
                return SphereShape(pose, radius=sizes[0])
            case "capsule":
                return CapsuleShape(pose, radius=sizes[0], length=2.0 * sizes[1])
            case "cylinder":
                return CylinderShape(pose, radius=sizes[0], length=2.0 * sizes[1])
            case "box":
                return BoxShape(pose, sizes=as_point(2.0 * np.array(sizes)))
        return HullShape(pose, points=tuple(map(as_point, ball_corners() * np.array(sizes))))

    def visual(self, geom: ET.Element, owner: str) -> Visual:
        """A geom as it is shown."""
        own = _colour(geom, owner) if "rgba" in geom.attrib else self.colours.get(geom.get("material", ""), "")
        return Visual(self.shape(geom, owner), own)

    def inertia(self, body: ET.Element, owner: str) -> Inertia | None:
        """The inertia that a body states; None where it is left to be computed of geoms."""
        inertial = body.find("inertial")
        if inertial is None or self.setting("inertiafromgeom", "auto") == "true":
            return None
        mass = number(inertial, "mass", owner)
        if mass is None or not 0.0 <= mass <= MASSES[1]:
            raise refused(f"{owner}: the mass of <inertial> must be from 0 to {MASSES[1]:g} kg")
        if inertial.get("fullinertia") is not None:
            xx, yy, zz, xy, xz, yz = numbers(inertial, "fullinertia", 6, (), owner)
        else:
            (xx, yy, zz), (xy, xz, yz) = point(inertial, "diaginertia", (0.0, 0.0, 0.0), owner), (0.0, 0.0, 0.0)
        at_center = Inertia(mass=mass, matrix=((xx, xy, xz), (xy, yy, yz), (xz, yz, zz)))
        return moved_inertia(at_center, self.pose(inertial, owner))


def _kind(tag: str) -> str:
    """The kind of element whose defaults a tag has: all actuators share theirs."""
    return "actuator" if tag in ACTUATORS else tag


def _classes(root: ET.Element) -> Classes:
    """The attributes that each class states by default, those of the classes around it included."""
    classes: Classes = {MAIN: {}}

    def add(default: ET.Element, name: str, around: Mapping[str, Mapping[str, str]]) -> None:
        own = {kind: dict(attributes) for kind, attributes in around.items()}
        for element in default:
            if element.tag != "default":
                kept = {key: value for key, value in element.attrib.items() if key != "class"}
                own[_kind(element.tag)] = own.get(_kind(element.tag), {}) | kept
        classes[name] = own
        for inner in default.findall("default"):
            if inner.get("class") is None:
                raise refused("a <default> within another one has no class")
            add(inner, inner.attrib["class"], own)

    for default in root.findall("default"):
        add(default, default.get("class", MAIN), classes[MAIN])
    return classes


def _colour(element: ET.Element, owner: str) -> Colour:
    return colour_of(numbers(element, "rgba", 4, (1.0, 1.0, 1.0, 1.0), owner)) if "rgba" in element.attrib else ""


def unit(vector: Sequence[float] | FloatArray, owner: str) -> FloatArray:
    """A vector of length one."""
    length = float(np.linalg.norm(vector))
    if not length > 1e-9:
        raise refused(f"{owner}: an axis is zero")
    return np.asarray(vector) / length


def towards(way: FloatArray, owner: str) -> tuple[Point3, Point3, Point3]:
    """The least turn that takes the z axis to a way."""
    z = unit(way, owner)
    across = np.cross(Z, z)
    sine = float(np.linalg.norm(across))
    return _turn(across / sine if sine > 1e-10 else (1.0, 0.0, 0.0), float(np.arctan2(sine, z[2])))


def _turn(axis: Sequence[float] | FloatArray, angle: float) -> tuple[Point3, Point3, Point3]:
    return as_matrix(np.array(about(list(axis), angle), dtype=float))


def _of_quaternion(wxyz: Sequence[float], owner: str) -> tuple[Point3, Point3, Point3]:
    """The rotation of a quaternion w, x, y, z, of any length."""
    w, x, y, z = unit(wxyz, owner).tolist()
    return matrix_of((x, y, z, w))

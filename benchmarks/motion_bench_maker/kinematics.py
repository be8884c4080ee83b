"""Forward kinematics of a URDF in NumPy, for checking: written apart from the models that are checked with it."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from benchmarks.motion_bench_maker.problem_file import InvalidFile
from problems.base import FloatArray

TURNING = ("revolute", "continuous")


@dataclass(frozen=True)
class Kinematics:
    """A serial chain of k joints that turn; others are held at zero.

    Attributes:
        names: of the joints.
        placements: (k, 4, 4), of each joint's frame in that of the body before.
        axes: (k, 3), unit vectors in the joint's frame.
        bodies: by the name of each link, the number of the body that it belongs to, 0 for the base, and its placement
            in that body's frame, (4, 4).
        position: (k, 2), lowest and highest angles, rad.
        speed: (k,), rad/s.
    """

    names: tuple[str, ...]
    placements: FloatArray
    axes: FloatArray
    bodies: dict[str, tuple[int, FloatArray]]
    position: FloatArray
    speed: FloatArray

    def frames(self, theta: FloatArray) -> FloatArray:
        """Frames of the bodies in n postures (n, k), rad: (k + 1, n, 4, 4)."""
        frames = [np.broadcast_to(np.eye(4), (len(theta), 4, 4))]
        for placement, axis, angle in zip(self.placements, self.axes, theta.T, strict=True):
            frames.append(frames[-1] @ placement @ _turned(axis, angle))
        return np.array(frames)

    def pose(self, theta: FloatArray, link: str) -> FloatArray:
        """The frame of a link in one posture (k,), (4, 4)."""
        body, placement = self.bodies[link]
        return np.asarray(self.frames(theta[None])[body, 0] @ placement)


def _turned(axis: FloatArray, angle: FloatArray) -> FloatArray:
    """Turns about an axis, (n, 4, 4), by angles (n,): Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned = np.zeros((len(angle), 4, 4))
    turned[:, 3, 3] = 1.0
    turned[:, :3, :3] = (
        np.eye(3) + np.sin(angle)[:, None, None] * cross + (1.0 - np.cos(angle))[:, None, None] * (cross @ cross)
    )
    return turned


def read_kinematics(path: Path) -> Kinematics:
    """Read the chain from a URDF's root to the link with most turning joints before it.

    Raises:
        InvalidFile: it cannot be read, or is not a URDF of such a robot.
    """
    try:
        root = ElementTree.parse(path).getroot()
        joints = {_child(joint): joint for joint in root.iter("joint") if joint.find("child") is not None}
        return _chain(joints)
    except (OSError, ElementTree.ParseError, AttributeError, KeyError, TypeError, ValueError) as error:
        raise InvalidFile(f"{path}: is not a URDF of a serial arm ({type(error).__name__}: {error})") from error


def _chain(joints: dict[str, ElementTree.Element]) -> Kinematics:
    ways = {link: _way(link, joints) for link in joints}
    turning = max(([joint for joint in way if joint.get("type") in TURNING] for way in ways.values()), key=len)
    numbers = {joint.get("name"): number for number, joint in enumerate(turning, start=1)}
    bodies = {_parent(ways[link][0]): (0, np.eye(4)) for link in joints}
    placements: dict[str | None, FloatArray] = {}
    for link, way in ways.items():
        body, placement = 0, np.eye(4)
        for joint in way:
            placement = placement @ _origin(joint)
            if joint.get("name") in numbers:
                placements[joint.get("name")] = placement
                body, placement = numbers[joint.get("name")], np.eye(4)
        bodies[link] = body, placement
    limits = [joint.find("limit").attrib for joint in turning]  # type: ignore[union-attr]
    return Kinematics(
        tuple(str(joint.get("name")) for joint in turning),
        np.array([placements[name] for name in numbers]),
        np.array([_vector(joint.find("axis"), "xyz", (1.0, 0.0, 0.0)) for joint in turning]),
        bodies,
        np.array([[float(limit[key]) for key in ("lower", "upper")] for limit in limits]),
        np.array([float(limit["velocity"]) for limit in limits]),
    )


def _way(link: str, joints: dict[str, ElementTree.Element]) -> list[ElementTree.Element]:
    way: list[ElementTree.Element] = []
    while link in joints and len(way) <= len(joints):
        way.insert(0, joints[link])
        link = _parent(joints[link])
    return way


def _child(joint: ElementTree.Element) -> str:
    return joint.find("child").attrib["link"]  # type: ignore[union-attr]


def _parent(joint: ElementTree.Element) -> str:
    return joint.find("parent").attrib["link"]  # type: ignore[union-attr]


def _vector(element: ElementTree.Element | None, key: str, default: tuple[float, ...] = (0.0, 0.0, 0.0)) -> FloatArray:
    text = None if element is None else element.get(key)
    return np.array(default if text is None else [float(part) for part in text.split()])


def _origin(joint: ElementTree.Element) -> FloatArray:
    origin = joint.find("origin")
    placement = np.eye(4)
    for axis, angle in zip(np.eye(3)[::-1], _vector(origin, "rpy")[::-1], strict=True):
        placement = placement @ _turned(axis, np.array([angle]))[0]
    placement[:3, 3] = _vector(origin, "xyz")
    return placement


@dataclass(frozen=True)
class Spheres:
    """Spheres that hold a robot.

    Attributes:
        bodies: (m,), the number of the body that each moves with.
        links: the m links that they are stated for.
        centers: (m, 3), in the body's frame, m.
        radii: (m,), m.
    """

    bodies: np.ndarray[tuple[int], np.dtype[np.int_]]
    links: tuple[str, ...]
    centers: FloatArray
    radii: FloatArray


def read_spheres(path: Path, kinematics: Kinematics) -> Spheres:
    """Read a file with tables ``[[spheres]]``: link, center, radius.

    Raises:
        InvalidFile: it cannot be read, or names a link that the robot does not have.
    """
    try:
        tables = tomllib.loads(path.read_text())["spheres"]
        links = tuple(str(table["link"]) for table in tables)
        unknown = next((link for link in links if link not in kinematics.bodies), None)
        if unknown is not None:
            raise InvalidFile(f"{path}: the robot has no link {unknown}")
        at = [kinematics.bodies[link] for link in links]
        centers = [(place @ [*table["center"], 1.0])[:3] for (_, place), table in zip(at, tables, strict=True)]
        radii = np.array([float(table["radius"]) for table in tables])
        return Spheres(np.array([body for body, _ in at]), links, np.array(centers), radii)
    except (OSError, UnicodeError, tomllib.TOMLDecodeError, KeyError, TypeError) as error:
        raise InvalidFile(f"{path}: is not a file of spheres ({type(error).__name__}: {error})") from error

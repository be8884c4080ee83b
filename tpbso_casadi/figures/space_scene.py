"""Scenes in space as polyhedra, seen from a point of view."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, product

import casadi as ca
import numpy as np

from problems import Obstacle, Robot
from problems.base import FloatArray, as_array
from problems.robots import Body, LinkAppearance, SpatialArm
from problems.tasks import Marker
from tpbso_casadi.figures.scene import Course, placed

EYE = 3.2  # how far it is away, in radii of what it looks at
AZIMUTH, ELEVATION = -50.0, 24.0  # degrees; where it is


@dataclass(frozen=True)
class View:
    """The view from which a picture is seen.

    Attributes:
        axes: to the right, up, and toward the eye: unit vectors in rows, (3, 3).
        center: what it looks at, (3,), m.
        distance: of the eye from there, m; None where all lines of sight are parallel.
    """

    axes: FloatArray
    center: FloatArray
    distance: float | None = None

    def project(self, points: FloatArray) -> FloatArray:
        """Points (..., 3) in the picture, (..., 2): in m at the centre's depth."""
        if self.distance is None:
            return np.asarray(points @ self.axes[:2].T)
        return np.asarray((points - self.center) @ self.axes[:2].T * self.magnification(points)[..., None])

    def magnification(self, points: FloatArray) -> FloatArray:
        """How much larger than at the centre something looks at points (..., 3)."""
        if self.distance is None:
            return np.ones(points.shape[:-1])
        return np.asarray(self.distance / np.maximum(self.distance - self.depth(points), self.distance / 100.0))

    def depth(self, points: FloatArray) -> FloatArray:
        """How far points (..., 3) are from the centre toward the eye, m."""
        return np.asarray((points - self.center) @ self.axes[2])

    def sees(self, normals: FloatArray, offsets: FloatArray) -> np.ndarray:
        """Whether the eye is outside of planes: normals (n, 3), offsets (n,) in m."""
        if self.distance is None:
            return np.asarray(normals @ self.axes[2] > 0.0)
        return np.asarray(normals @ self.eye > offsets)

    @property
    def eye(self) -> FloatArray:
        """The place of the eye of a view in perspective, (3,), m."""
        return np.asarray(self.center + (self.distance or 0.0) * self.axes[2])


def orthogonal(right: int, up: int, toward: tuple[float, float, float]) -> View:
    """The view in which two coordinates are to the right and up."""
    return View(np.array([np.eye(3)[right], np.eye(3)[up], toward]), np.zeros(3))


TOP, FRONT, SIDE = orthogonal(0, 1, (0, 0, 1)), orthogonal(0, 2, (0, -1, 0)), orthogonal(1, 2, (1, 0, 0))


def perspective(center: FloatArray, radius: float, azimuth: float = AZIMUTH, elevation: float = ELEVATION) -> View:
    """The view of a ball by an eye at so many degrees."""
    a, e = np.radians([azimuth, elevation])
    toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return View(np.array([right, np.cross(toward, right), toward]), center, EYE * radius)


SHARP = float(np.cos(np.radians(30.0)))  # of the angle between two faces whose common edge is drawn
TOUCHING = 1e-9  # m: what lies on a face is outside


@dataclass(frozen=True)
class Edge:
    """An edge between two vertices.

    Attributes:
        ends: their numbers.
        faces: the numbers of those that meet in it, one or two.
        sharp: whether it is drawn wherever it is seen from.
    """

    ends: tuple[int, int]
    faces: tuple[int, ...]
    sharp: bool


@dataclass(frozen=True)
class Polyhedron:
    """The surface of something convex.

    Attributes:
        vertices: (n, 3), m.
        faces: their corners, counter-clockwise from outside.
    """

    vertices: FloatArray
    faces: tuple[tuple[int, ...], ...]

    @cached_property
    def normals(self) -> FloatArray:
        """Unit normals of the faces, outwards, (faces, 3)."""
        sums, counts = np.empty((len(self.faces), 3)), np.array([len(face) for face in self.faces])
        for count in np.unique(counts):
            numbers = np.flatnonzero(counts == count)
            rings = self.vertices[np.array([self.faces[number] for number in numbers])]
            sums[numbers] = np.cross(rings, np.roll(rings, -1, axis=1)).sum(axis=1)
        return np.asarray(sums / np.maximum(np.linalg.norm(sums, axis=1, keepdims=True), np.finfo(float).tiny))

    @cached_property
    def offsets(self) -> FloatArray:
        """Offsets of the faces' planes from the origin along the normals, (faces,), m."""
        middles = np.array([self.vertices[list(face)].mean(axis=0) for face in self.faces])
        return np.asarray(np.sum(middles * self.normals, axis=1))

    @cached_property
    def center(self) -> FloatArray:
        """The mean of its vertices, (3,), m."""
        return np.asarray(self.vertices.mean(axis=0))

    def beyond(self, points: FloatArray) -> FloatArray:
        """How far points (..., 3) are outside of each face, (..., faces), m."""
        return np.asarray(points @ self.normals.T - self.offsets)

    def hides(self, points: FloatArray, eye: FloatArray) -> np.ndarray:
        """Whether it is between points (n, 3) and an eye (3,): (n,)."""
        near, far = self.beyond(points), self.beyond(eye)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = near / (near - far)  # of the way to the eye
        enters = np.where(near > 0.0, np.where(far > 0.0, np.inf, crossing), 0.0).max(axis=1)
        leaves = np.where((near <= 0.0) & (far > 0.0), crossing, 1.0).min(axis=1)
        return np.asarray(enters < leaves)

    @cached_property
    def edges(self) -> tuple[Edge, ...]:
        """The edges of the solid, each once."""
        meeting: dict[tuple[int, int], list[int]] = {}
        for number, face in enumerate(self.faces):
            for one, two in zip(face, (*face[1:], face[0]), strict=True):
                meeting.setdefault((min(one, two), max(one, two)), []).append(number)
        return tuple(
            Edge(ends, tuple(faces), len(faces) == 1 or float(self.normals[faces[0]] @ self.normals[faces[1]]) < SHARP)
            for ends, faces in meeting.items()
        )


def polyhedron_of(obstacle: Obstacle) -> Polyhedron:
    """The surface of an obstacle in space."""
    vertices, faces = obstacle.surface()
    return Polyhedron(vertices, tuple(tuple(face) for face in faces))


def separating_planes(
    solids: Sequence[Polyhedron], pairs: Iterable[tuple[int, int]] | None = None
) -> dict[tuple[int, int], int]:
    """Faces of a outside of whose plane b lies, by pairs (a, b); pairs without one are left out.

    Args:
        solids: all of them.
        pairs: that are looked at; all where None.
    """
    found = {}
    for pair in combinations(range(len(solids)), 2) if pairs is None else pairs:
        for a, b in (pair, pair[::-1]):
            outside = solids[a].beyond(solids[b].vertices).min(axis=0)
            if outside.max() >= -TOUCHING:
                found[a, b] = int(outside.argmax())
    return found


PADDING = 0.05  # around everything that moves, of its largest side
SURROUNDINGS = 0.35  # beyond what moves, of its largest side: what obstacles are shown of
GRID = 0.25  # m: of the ground
MOST_LINES = 40  # of the grid
TURN = 15.0  # degrees between views to choose from
POSTURES = 9  # that have to be seen
BESIDE = 60.0  # degrees by which the eye is beside the line from the obstacles to the robot


@dataclass(frozen=True)
class Scene:
    """A robot, obstacles, and positions that the tool has to reach.

    Attributes:
        robot: in space, whose bodies are balls.
        obstacles: in space.
        markers: of the task.
        courses: of the obstacles that move.
    """

    robot: Robot
    obstacles: Sequence[Obstacle] = ()
    markers: Sequence[Marker] = ()
    courses: Sequence[Course] = ()

    @cached_property
    def balls(self) -> tuple[Body, ...]:
        """The bodies that are thicker than a point."""
        return tuple(body for body in self.robot.bodies.each if float(body.radius) > 0.0)

    @cached_property
    def radii(self) -> FloatArray:
        """The radii of the balls, (balls,), m."""
        return np.array([float(body.radius) for body in self.balls])

    @property
    def appearances(self) -> tuple[LinkAppearance, ...]:
        """Appearances of the robot's links, as far as they are known."""
        return self.robot.appearances if isinstance(self.robot, SpatialArm) else ()

    @cached_property
    def bare(self) -> np.ndarray:
        """Numbers of the balls of links without a look, (n,)."""
        dressed = {appearance.link for appearance in self.appearances}
        return np.array([number for number, ball in enumerate(self.balls) if ball.name not in dressed], dtype=np.intp)

    def frames(self, theta: FloatArray) -> FloatArray:
        """Origin, m, and axes in rows of what carries looks, in n postures (n, dof), rad: (n, bodies, 4, 3)."""
        return self.robot.body_frames(theta) if isinstance(self.robot, SpatialArm) else np.empty((len(theta), 0, 4, 3))

    @cached_property
    def solids(self) -> tuple[Polyhedron, ...]:
        """The obstacles, those that move as seen from the frames that move with them."""
        return tuple(polyhedron_of(obstacle.unmoved) for obstacle in self.obstacles)

    @cached_property
    def moving(self) -> tuple[int, ...]:
        """The numbers 0, 1, ... of the obstacles that move."""
        return tuple(number for number, obstacle in enumerate(self.obstacles) if obstacle.moves)

    @cached_property
    def planes(self) -> dict[tuple[int, int], int]:
        """Planes that part the standing obstacles."""
        return separating_planes(self.solids, self._pairs(moving=False))

    def solids_at(self, time: float) -> tuple[Polyhedron, ...]:
        """The obstacles where they are at a time in s."""
        return tuple(
            replace(solid, vertices=placed(obstacle, solid.vertices, np.array([time]))[0]) if obstacle.moves else solid
            for solid, obstacle in zip(self.solids, self.obstacles, strict=True)
        )

    def planes_of(self, solids: Sequence[Polyhedron]) -> dict[tuple[int, int], int]:
        """Planes that part the obstacles where they are at some time."""
        return self.planes | separating_planes(solids, self._pairs(moving=True))

    def _pairs(self, *, moving: bool) -> list[tuple[int, int]]:
        """Numbers of all pairs of obstacles of which one moves, or of which none does."""
        pairs = combinations(range(len(self.obstacles)), 2)
        return [pair for pair in pairs if bool(set(pair) & set(self.moving)) == moving]

    def centers(self, theta: FloatArray) -> FloatArray:
        """Centres of the balls in n postures (n, dof), rad: (n, balls, 3), m."""
        frames = self.robot.positions(ca.DM(theta))
        found = [as_array(frames[body.start]) for body in self.balls]
        return np.stack(found, axis=1) if found else np.empty((len(theta), 0, 3))

    def bounds(self, theta: FloatArray) -> FloatArray:
        """Lower and upper corner of what is shown of postures (n, dof), (2, 3), m.

        All of the robot and the markers; of obstacles what is near.
        """
        skeleton = self.robot.skeleton(theta).reshape(-1, 3)
        centers, radii = self.centers(theta), self.radii[:, None]
        balls = [(centers + side * radii).reshape(-1, 3) for side in (-1.0, 1.0)]
        shown = [marker.points for marker in self.markers] + [*self._look_corners(theta)]
        lower, upper = corners(np.vstack([skeleton, *balls, *shown]))
        near = SURROUNDINGS * float((upper - lower).max())
        still = [solid for number, solid in enumerate(self.solids) if number not in self.moving]
        shown = [np.clip(solid.vertices, lower - near, upper + near) for solid in still]
        shown += [course.within(lower - near, upper + near) for course in self.courses]
        lower, upper = corners(np.vstack([lower, upper, *shown]))
        padding = PADDING * float((upper - lower).max())
        return np.array([lower - padding, upper + padding])

    def _look_corners(self, theta: FloatArray) -> Iterator[FloatArray]:
        """Corners of boxes around looks in n postures, each (8 n, 3), m."""
        frames = self.frames(theta)
        for appearance in self.appearances:
            box = np.array(list(product(*np.transpose(corners(appearance.triangles.vertices)))))
            yield (box @ frames[:, appearance.body, 1:] + frames[:, appearance.body, :1]).reshape(-1, 3)

    def view(self, theta: FloatArray, bounds: FloatArray) -> View:
        """The view in perspective that obstacles hide least in of postures (n, dof), rad, within bounds (2, 3), m.

        Of several as good it is the one nearest to that from behind the robot, a little beside it.
        """
        center, radius = bounds.mean(axis=0), float(np.linalg.norm(bounds[1] - bounds[0])) / 2.0
        shown = theta[np.linspace(0, len(theta) - 1, min(len(theta), POSTURES)).astype(int)]
        points, solids = self.robot.skeleton(shown).reshape(-1, 3), self._solids_halfway

        def hidden(view: View) -> int:
            return sum(int(solid.hides(points, view.eye).sum()) for solid in solids)

        turns = sorted(np.arange(-180.0, 180.0, TURN), key=abs)
        return min((perspective(center, radius, self._behind(bounds) + turn) for turn in turns), key=hidden)

    @cached_property
    def _solids_halfway(self) -> tuple[Polyhedron, ...]:
        """The obstacles in the middle of the time for which their courses are known."""
        ends = [course.times[[0, -1]] for course in self.courses]
        return self.solids_at(float(np.mean(ends))) if ends else self.solids

    def _behind(self, bounds: FloatArray) -> float:
        """Degrees at which an eye has the robot before the obstacles, and sees both."""
        if not self.solids:
            return AZIMUTH
        middles = [np.clip(solid.vertices, *bounds).mean(axis=0) for solid in self._solids_halfway]
        x, y, _ = np.array(self.robot.base) - np.mean(middles, axis=0)
        return float(np.degrees(np.arctan2(y, x))) + BESIDE


def corners(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The lower and the upper corner of the box around points (n, 3), each (3,)."""
    return points.min(axis=0), points.max(axis=0)


def ground(bounds: FloatArray) -> FloatArray:
    """Lines of a grid below everything within bounds (2, 3), m: (lines, 2, 3)."""
    low, high = bounds
    step = GRID * max(1.0, np.ceil(float((high - low)[:2].max()) / GRID / MOST_LINES))
    lines = []
    for axis in (0, 1):
        for place in np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step:
            lines.append(bounds.copy())
            lines[-1][:, axis], lines[-1][:, 2] = place, low[2]
    return np.array(lines).reshape(-1, 2, 3)

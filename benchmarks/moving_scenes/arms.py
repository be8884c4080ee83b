"""The arms of random scenes: where they are, and how much room is left around them, in NumPy alone."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np

import tpbso_casadi
from benchmarks.motion_bench_maker.kinematics import Kinematics, Spheres, read_kinematics, read_spheres
from benchmarks.moving_scenes.courses import Course
from benchmarks.moving_scenes.shapes import Shape
from problems import robots
from problems.base import FloatArray

SPHERES = Path(tpbso_casadi.__file__).parent / "suite" / "arm_motions_1" / "panda-spheres.toml"
APART = 3  # joints between spheres of the robot's own that are looked at
READY = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])  # rad: a posture in which nothing meets

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int_]]


@dataclass(frozen=True)
class Thing:
    """An obstacle of a random scene."""

    shape: Shape
    course: Course

    @property
    def moves(self) -> bool:
        """Whether it does not stand still."""
        return bool(np.ptp(self.course.places, axis=0).any() or not self.course.tabled)

    @property
    def toml(self) -> str:
        """Its table in a scenario."""
        if not self.moves and self.course.turns is None:
            stated, motion = self.course.places[0], ""
        elif self.course.tabled:
            stated, motion = np.zeros(self.course.places.shape[1]), f"motion_rows = {self.course.rows}"
        else:
            stated, motion = self.course.places[0], f"velocity = {self.course.velocity.tolist()}"
        return "\n".join(["[[obstacles]]", self.shape.toml, self.shape.stated_at(stated), motion, ""])

    def room(self, points: FloatArray, times: FloatArray) -> FloatArray:
        """What :meth:`Shape.room` says of points (n, m, dim) at times (n,)."""
        return self.shape.room(self.course.seen(points, times))


class Arm(ABC):
    """An arm and how fast its joints may be.

    Attributes:
        speed: of each joint, (k,), rad/s.
        acceleration: (k,), rad/s^2.
        lower: angles of random postures, (k,), rad.
        upper: likewise.
        dim: 2 or 3.
    """

    speed: FloatArray
    acceleration: FloatArray
    lower: FloatArray
    upper: FloatArray
    dim: int

    @property
    @abstractmethod
    def toml(self) -> str:
        """Its table in a scenario."""

    @abstractmethod
    def points(self, theta: FloatArray) -> FloatArray:
        """What rooms are measured from, (n, m, dim), m, in postures (n, k)."""

    @abstractmethod
    def around(self, points: FloatArray, thing: Thing, times: FloatArray) -> FloatArray:
        """The least room between the arm and a thing at times (n,), (n,), m; points as above."""

    def fits(self, theta: FloatArray) -> bool:
        """Whether the arm itself is well placed in all of n postures (n, k)."""
        return True

    def room(self, theta: FloatArray, times: FloatArray, things: Sequence[Thing]) -> FloatArray:
        """The least room around the arm at times (n,), (n,), m."""
        points = self.points(theta)
        return np.asarray(np.min([self.around(points, thing, times) for thing in things], axis=0))


@dataclass(frozen=True)
class PlanarThreeLinks(Arm):
    """Three links in the plane."""

    lengths: tuple[float, ...] = (0.7, 0.7, 0.6)
    speed = np.full(3, 4.0)
    acceleration = np.full(3, 20.0)
    lower = np.array([-3.0, -2.4, -2.4])
    upper = np.array([3.0, 2.4, 2.4])
    dim = 2

    @property
    def toml(self) -> str:
        """Links and limits."""
        return f"[arm]\nlink_lengths = {list(self.lengths)}\nmax_speed = 4.0\nmax_acceleration = 20.0\n"

    def points(self, theta: FloatArray) -> FloatArray:
        """Base and the ends of links."""
        angles = np.cumsum(theta, axis=1)
        steps = np.array(self.lengths)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=2)
        return np.concatenate([np.zeros((len(theta), 1, 2)), np.cumsum(steps, axis=1)], axis=1)

    def around(self, points: FloatArray, thing: Thing, times: FloatArray) -> FloatArray:
        """Of the links."""
        return np.asarray(thing.room(points, times).min(axis=1))


@dataclass(frozen=True)
class Panda(Arm):
    """A Panda and the spheres that hold it, without those that no joint moves."""

    acceleration = np.array([15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0])
    dim = 3

    @property
    def toml(self) -> str:
        """The robot with the spheres by which it is judged."""
        text = SPHERES.read_text()
        return f'[robot]\nmodel = "panda"\nspheres = "{SPHERES.name}"\nspheres_text = """\n{text}"""\n'

    @cached_property
    def _files(self) -> tuple[Kinematics, Spheres]:
        kinematics = read_kinematics(Path(robots.__file__).parent / "models" / "panda.urdf")
        return kinematics, read_spheres(SPHERES, kinematics)

    @cached_property
    def speed(self) -> FloatArray:  # type: ignore[override]
        """As in its URDF."""
        return self._files[0].speed

    @cached_property
    def lower(self) -> FloatArray:  # type: ignore[override]
        """The limits of the joints, and no far turns of the base."""
        return np.maximum(self._files[0].position[:, 0] + 0.1, -1.6)

    @cached_property
    def upper(self) -> FloatArray:  # type: ignore[override]
        """Likewise."""
        return np.minimum(self._files[0].position[:, 1] - 0.1, 2.2)

    @cached_property
    def _moved(self) -> Spheres:
        spheres = self._files[1]
        still = (spheres.bodies == 0) | ((spheres.bodies == 1) & (np.hypot(*spheres.centers[:, :2].T) < 1e-9))
        return Spheres(
            spheres.bodies[~still],
            tuple(link for link, left in zip(spheres.links, ~still, strict=True) if left),
            spheres.centers[~still],
            spheres.radii[~still],
        )

    @property
    def radii(self) -> FloatArray:
        """Of the spheres, (m,), m."""
        return self._moved.radii

    @cached_property
    def _own_pairs(self) -> IntArray:
        """Numbers of spheres so many joints apart that do not always meet, (q, 2)."""
        bodies = self._moved.bodies
        pairs = np.array(np.triu_indices(len(bodies), 1)).T
        pairs = pairs[np.abs(np.diff(bodies[pairs], axis=1)[:, 0]) >= APART]
        return np.asarray(pairs[self._own_distances(READY[None], pairs)[0] > 0.0])

    def _own_distances(self, theta: FloatArray, pairs: IntArray) -> FloatArray:
        one, two = pairs.T
        points, radii = self.points(theta), self._moved.radii
        return np.asarray(np.linalg.norm(points[:, one] - points[:, two], axis=2) - radii[one] - radii[two])

    def fits(self, theta: FloatArray) -> bool:
        """High enough above the table, the hand away from the foot, and no body near another."""
        points = self.points(theta)
        hand = self._moved.bodies == self._moved.bodies.max()
        outer = self._moved.bodies > 2
        lowest = (points[:, outer, 2] - self._moved.radii[outer]).min()
        foot = np.linalg.norm(points[:, hand, :2], axis=2).min()
        return bool(lowest > 0.05 and foot > 0.3 and self._own_distances(theta, self._own_pairs).min() > 0.02)

    def points(self, theta: FloatArray) -> FloatArray:
        """Centres of the spheres."""
        frames = self._files[0].frames(theta)[self._moved.bodies]
        turned = np.einsum("mnij,mj->nmi", frames[:, :, :3, :3], self._moved.centers)
        return np.asarray(turned + frames[:, :, :3, 3].transpose(1, 0, 2))

    def around(self, points: FloatArray, thing: Thing, times: FloatArray) -> FloatArray:
        """Of the spheres."""
        return np.asarray((thing.room(points, times) - self._moved.radii).min(axis=1))


@cache
def arm_of(dim: int) -> Arm:
    """The arm of random scenes in the plane or in space."""
    return PlanarThreeLinks() if dim == 2 else Panda()

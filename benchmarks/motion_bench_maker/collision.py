"""Distances of spheres from boxes, cylinders and each other in NumPy: what motions are judged with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from benchmarks.motion_bench_maker.kinematics import Kinematics, Spheres
from benchmarks.motion_bench_maker.problem_file import MotionProblem, Obstacle
from problems.base import FloatArray

APART = 3  # joints between the bodies of a pair of spheres that must not meet
COARSE, CHUNK = 1001, 500  # times of the first look at a motion; postures computed together

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int_]]


@dataclass(frozen=True)
class Checker:
    """How far a robot's spheres are from obstacles and from each other.

    Attributes:
        kinematics: of the robot.
        spheres: m of them.
        obstacles: of the scene.
        near: (p, 2), numbers of a sphere and an obstacle; the pairs that are computed.
        own: (q, 2), numbers of two spheres, likewise.
    """

    kinematics: Kinematics
    spheres: Spheres
    obstacles: tuple[Obstacle, ...]
    near: IntArray
    own: IntArray

    @classmethod
    def of(cls, kinematics: Kinematics, spheres: Spheres, problem: MotionProblem) -> Checker:
        """All spheres against all obstacles; pairs at least three joints apart that are clear at start and goal."""
        near = np.indices((len(spheres.radii), len(problem.obstacles))).reshape(2, -1).T
        own = np.array(np.triu_indices(len(spheres.radii), 1)).T
        own = own[np.abs(np.diff(spheres.bodies[own], axis=1)[:, 0]) >= APART]
        every = cls(kinematics, spheres, problem.obstacles, near, own)
        ends = every.own_distances(every.centers(np.array([problem.start, problem.goal])))
        return replace(every, own=own[ends.min(axis=0) > 0.0])

    def centers(self, theta: FloatArray) -> FloatArray:
        """Of the spheres in n postures (n, k), rad: (n, m, 3), m."""
        frames = self.kinematics.frames(theta)[self.spheres.bodies]
        moved = np.einsum("mnij,mj->nmi", frames[:, :, :3, :3], self.spheres.centers)
        return np.asarray(moved + frames[:, :, :3, 3].transpose(1, 0, 2))

    @cached_property
    def _sizes(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        round_ = np.array([obstacle.shape == "cylinder" for obstacle in self.obstacles])
        rotations = np.array([obstacle.rotation for obstacle in self.obstacles])
        half = np.array([obstacle.size for obstacle in self.obstacles]) / 2.0
        return rotations, np.array([obstacle.position for obstacle in self.obstacles]), half, round_

    def obstacle_distances(self, centers: FloatArray) -> FloatArray:
        """Signed distances (n, p), m, of the pairs in ``near``; centres of all spheres (n, m, 3)."""
        if not len(self.near):
            return np.full((len(centers), 0), np.inf)
        sphere, obstacle = self.near.T
        rotations, positions, half, is_round = (part[obstacle] for part in self._sizes)
        local = np.einsum("npi,pij->npj", centers[:, sphere] - positions, rotations)
        beyond = np.abs(local) - half
        across = np.hypot(local[..., 0], local[..., 1]) - half[:, 0]
        beyond[..., 0] = np.where(is_round, across, beyond[..., 0])
        beyond[..., 1] = np.where(is_round, beyond[..., 0], beyond[..., 1])
        outside = np.maximum(beyond, 0.0)
        outside[..., 1] = np.where(is_round, 0.0, outside[..., 1])
        distance = np.sqrt((outside**2).sum(axis=2)) + np.minimum(beyond.max(axis=2), 0.0)
        return np.asarray(distance - self.spheres.radii[sphere])

    def own_distances(self, centers: FloatArray) -> FloatArray:
        """Distances (n, q), m, of the pairs in ``own``."""
        one, two = self.own.T
        between = np.linalg.norm(centers[:, one] - centers[:, two], axis=2)
        return np.asarray(between - self.spheres.radii[one] - self.spheres.radii[two])

    def clearance(self, theta: FloatArray) -> FloatArray:
        """The least distance in each of n postures (n, k): (n,), m."""
        parts = [self.centers(theta[first : first + CHUNK]) for first in range(0, len(theta), CHUNK)]
        least = [
            np.minimum(
                self.obstacle_distances(part).min(axis=1, initial=np.inf),
                self.own_distances(part).min(axis=1, initial=np.inf),
            )
            for part in parts
        ]
        return np.concatenate(least)

    def least_clearance(self, at: Callable[[FloatArray], FloatArray], duration: float, samples: int) -> float:
        """The least distance, m, at equally spaced times of a motion.

        Only pairs that can be the closest are computed at all times: those whose distance at a first look is less than
        the least one plus what the spheres move from one of its times to the next.

        Args:
            at: joint angles (n, k), rad, at times (n,), s.
            duration: of the motion, s.
            samples: the number of times.
        """
        centers = self.centers(at(np.linspace(0.0, duration, COARSE)))
        moved = 2.0 * float(np.linalg.norm(np.diff(centers, axis=0), axis=2).max())
        near = np.concatenate([self.obstacle_distances(part) for part in np.array_split(centers, 10)]).min(axis=0)
        own = self.own_distances(centers).min(axis=0)
        most = min(near.min(initial=np.inf), own.min(initial=np.inf)) + 2.0 * moved
        closest = replace(self, near=self.near[near <= most], own=self.own[own <= most])
        return float(closest.clearance(at(np.linspace(0.0, duration, samples))).min())

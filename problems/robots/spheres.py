"""Spheres for bodies: covers of boxes, cylinders and capsules."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from problems.base import FloatArray, Parametric
from problems.robots.transform import Point3, Transform, as_point


@dataclass(frozen=True)
class Sphere(Parametric):
    """A ball that moves with a body of the chain and holds a part of it.

    Attributes:
        link: the body's number: 0 for the base, then that of the joint that moves it.
        center: in the body's frame, m.
        radius: m.
        name: for messages, as ``panda_link5``.
        inner: radius of the ball around the same centre that lies in the body, m; None where it is not known.
    """

    link: int
    center: Point3
    radius: float
    name: str
    inner: float | None = None


EXCESS = 1.1  # of a ball's radius over that of the cylinder it holds a piece of
MOST_BALLS = 64  # for one shape
MOST_FINE_BALLS = 2_000  # where it is said how far they may leave it
STICK_OUT = 0.015  # m, of the balls of a box, if so many do


@dataclass(frozen=True)
class Ball:
    """A ball that holds a part of a body.

    Attributes:
        center: m.
        radius: m.
        inner: radius of the ball around the same centre that lies in the body, m; None where it is not known.
    """

    center: Point3
    radius: float
    inner: float | None = None

    def seen_from(self, pose: Transform) -> Ball:
        """The ball as seen from the frame in which its own has this pose."""
        return Ball(as_point(np.array(pose.apply(self.center), dtype=float)), self.radius, self.inner)

    def on(self, link: int, name: str) -> Sphere:
        """The ball as a sphere on a body of the chain, from whose frame it is seen."""
        return Sphere(link, self.center, self.radius, name, self.inner)


def covered_capsule(start: Point3, end: Point3, radius: float, overhang: float | None = None) -> tuple[Ball, ...]:
    """Balls around points of a capsule's middle line, its ends included.

    Args:
        start: of the middle line, m.
        end: likewise.
        radius: m.
        overhang: how far they may leave it, m; a share of the radius where None.
    """
    ends = np.array([start, end], dtype=float)
    length = float(np.linalg.norm(ends[1] - ends[0]))
    excess = EXCESS if overhang is None else 1.0 + overhang / radius
    gaps = _pieces(length, radius, excess, MOST_BALLS if overhang is None else MOST_FINE_BALLS)
    reach = sqrt(radius**2 + (length / gaps / 2) ** 2)
    count = gaps + 1 if length else 1
    return _balls(ends[0] + np.linspace(0.0, 1.0, count)[:, None] * (ends[1] - ends[0]), reach, radius)


def cover_cylinder(radius: float, length: float) -> tuple[Ball, ...]:
    """Balls around points of the axis of a cylinder about the origin along z, each for a slice of it."""
    slices = _pieces(length, radius)
    heights = (np.arange(slices) + 0.5) * (length / slices) - length / 2
    centers = np.column_stack([np.zeros((slices, 2)), heights])
    return _balls(centers, sqrt(radius**2 + (length / slices / 2) ** 2), min(radius, length / slices / 2))


def cover_box(sizes: Point3, overhang: float | None = None) -> tuple[Ball, ...]:
    """Balls around the cells of a box about the origin, as near to cubes as can be.

    Args:
        sizes: full, m.
        overhang: how far they may leave it, m, as far as ``MOST_FINE_BALLS`` allow; as usual, of few, where None.
    """
    box = np.array(sizes)
    counts = np.ones(3, dtype=int)
    allowed, most = (STICK_OUT, MOST_BALLS) if overhang is None else (overhang, MOST_FINE_BALLS)
    while _sticking_out(box / counts) > allowed:
        finer = counts + (np.arange(3) == np.argmax(box / counts))
        if np.prod(finer) > most:
            break
        counts = finer
    cell = box / counts
    steps = [(np.arange(count) + 0.5) * side - count * side / 2 for count, side in zip(counts, cell, strict=True)]
    centers = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3)
    return _balls(centers, float(np.linalg.norm(cell)) / 2, float(np.min(cell)) / 2)


def _pieces(length: float, radius: float, excess: float = EXCESS, most: int = MOST_BALLS) -> int:
    gap = 2.0 * radius * sqrt(excess**2 - 1.0)
    return int(min(max(1, ceil(length / gap)), most))


def _sticking_out(cell: FloatArray) -> float:
    """The distance by which the ball around a cell leaves it, m."""
    return float(np.linalg.norm(cell) - np.min(cell)) / 2


def _balls(centers: FloatArray, radius: float, inner: float) -> tuple[Ball, ...]:
    enough = radius * (1.0 + 1e-12)  # rounding must not uncover a corner
    return tuple(Ball(as_point(center), enough, inner) for center in centers)

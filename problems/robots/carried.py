"""What the hand holds: bodies on the tool, kept clear and weighed like a link that ends the chain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from problems.base import FloatArray
from problems.geometry import Triangles
from problems.robots.inertia import Inertia, Payload
from problems.robots.looks import Parts
from problems.robots.shapes import Shape
from problems.robots.transform import as_point

COLOUR = "#c9974c"


@dataclass(frozen=True)
class Carried:
    """A body that is fixed to the tool.

    Attributes:
        name: for messages.
        shapes: that it is made of, in the tool's frame.
        mass: spread evenly over them, kg; None where none is stated.
    """

    name: str
    shapes: tuple[Shape, ...]
    mass: float | None = None

    @property
    def looks(self) -> Parts:
        """Its surfaces, in the tool's frame."""
        surfaces = [shape.placed(shape.surface) for shape in self.shapes]
        return ((COLOUR, Triangles.of(np.concatenate(surfaces))),)

    @property
    def inertia(self) -> Inertia:
        """Of its mass, 0 where none is stated, in the tool's frame."""
        bulks = [shape.bulk for shape in self.shapes]
        poses = [(np.array(shape.rotation), np.array(shape.translation)) for shape in self.shapes]
        shares = np.array([bulk.volume for bulk in bulks]) / sum(bulk.volume for bulk in bulks)
        centers = np.array([turn @ bulk.center + shift for bulk, (turn, shift) in zip(bulks, poses, strict=True)])
        center = shares @ centers
        about = [
            turn @ bulk.spread @ turn.T + np.outer(place - center, place - center)
            for bulk, (turn, _), place in zip(bulks, poses, centers, strict=True)
        ]
        spread = np.einsum("n,nij->ij", shares, np.array(about))
        return _inertia(self.mass or 0.0, center, (self.mass or 0.0) * spread)


def _inertia(mass: float, center: FloatArray, second: FloatArray) -> Inertia:
    """From the integral of r r^T over the masses about their centre, kg m^2."""
    matrix = np.trace(second) * np.eye(3) - second
    one, two, three = (as_point(row) for row in (matrix + matrix.T) / 2.0)
    return Inertia(mass=mass, center=as_point(center), matrix=(one, two, three))


def payload_of(carried: Sequence[Carried], payload: Payload | None) -> Payload | None:
    """What the tool carries in all; None where nothing has a mass.

    Args:
        carried: bodies in the tool's frame.
        payload: that is stated besides.
    """
    parts: Iterable[Inertia] = [*(body.inertia for body in carried if body.mass), *filter(None, [payload])]
    parts = [part for part in parts if part.mass > 0.0]
    if not parts:
        return payload
    if len(parts) == 1 and payload in parts:
        return payload
    masses, centers = np.array([part.mass for part in parts]), np.array([part.center for part in parts])
    center = masses @ centers / masses.sum()
    seconds = [
        np.trace(matrix) / 2.0 * np.eye(3) - matrix + mass * np.outer(place - center, place - center)
        for matrix, mass, place in zip((np.array(part.matrix) for part in parts), masses, centers, strict=True)
    ]
    total = _inertia(float(masses.sum()), center, np.sum(seconds, axis=0))
    return Payload(mass=total.mass, center=total.center, matrix=total.matrix)

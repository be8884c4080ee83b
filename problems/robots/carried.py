"""What the hand holds: bodies on the tool, kept clear and weighed like a link that ends the chain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from problems.geometry import Triangles
from problems.robots.appearance import Parts
from problems.robots.inertia import Inertia, Payload, as_matrix, combined, moved_inertia
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
        tip: name of the tip whose tool holds it, of a robot with several; empty for the first.
    """

    name: str
    shapes: tuple[Shape, ...]
    mass: float | None = None
    tip: str = ""

    @property
    def appearances(self) -> Parts:
        """The surfaces of its shapes, in the tool's frame."""
        surfaces = [shape.placed(shape.surface) for shape in self.shapes]
        return ((COLOUR, Triangles.of(np.concatenate(surfaces))),)

    @property
    def inertia(self) -> Inertia:
        """The inertia of its mass, 0 where none is stated, in the tool's frame."""
        mass, volume = self.mass or 0.0, sum(shape.bulk.volume for shape in self.shapes)
        return combined([_placed(shape, mass * shape.bulk.volume / volume) for shape in self.shapes]) or Inertia(
            mass=0.0
        )


def _placed(shape: Shape, mass: float) -> Inertia:
    """A shape's mass in kg, spread evenly, in the frame in which it is posed."""
    spread = shape.bulk.spread
    matrix = as_matrix(mass * (np.trace(spread) * np.eye(3) - spread))
    return moved_inertia(Inertia(mass=mass, center=as_point(shape.bulk.center), matrix=matrix), shape.pose)


def payload_of(carried: Sequence[Carried], payload: Payload | None) -> Payload | None:
    """The whole load of the tool; None where nothing has a mass.

    Args:
        carried: bodies in the tool's frame.
        payload: that is stated besides.
    """
    stated = [] if payload is None else [payload]
    total = combined([*(body.inertia for body in carried if body.mass), *stated])
    if not any(body.mass for body in carried) or total is None:
        return payload
    return Payload(mass=total.mass, center=total.center, matrix=total.matrix)

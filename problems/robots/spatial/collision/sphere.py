"""A ball that moves with a body."""

from __future__ import annotations

from dataclasses import dataclass

from problems.base.arguments import Statement
from problems.robots.rigid.inertia import Point3


@dataclass(frozen=True)
class Sphere(Statement):
    """A ball that moves with a body of the chain and holds a part of it.

    Attributes:
        link: the body's number: 0 for the base, then that of the joint that moves it.
        center: in the body's frame, m.
        radius: m.
        name: for messages, as ``panda_link5``.
    """

    link: int
    center: Point3
    radius: float
    name: str

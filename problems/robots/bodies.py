"""The bodies of a robot: how they move, and which of them are compared with each other."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from problems.base import FloatArray, Operand, Parametric


@dataclass(frozen=True)
class Body(Parametric):
    """A part of the robot that must not touch anything: a capsule, the points near the segment between two frames.

    Attributes:
        name: for messages, as ``link 2``.
        start: index of the frame at its start, in the order of :meth:`Robot.positions`.
        end: index of the frame at its end; of a ball it is the same.
        radius: of the capsule, m; with 0 it is the segment itself.
    """

    numbers: ClassVar[tuple[str, ...]] = ("radius",)
    zero_is_structure: ClassVar[tuple[str, ...]] = ("radius",)

    name: str
    start: int
    end: int
    radius: Operand = 0.0

    @property
    def is_ball(self) -> bool:
        """Whether its middle line is a point."""
        return self.start == self.end

    @property
    def form(self) -> Body:
        """A body of the same form somewhere: a ball, or a line."""
        return Body("ball", 0, 0) if self.is_ball else Body("line", 0, 1)

    @property
    def frames(self) -> tuple[int, ...]:
        """The indices of the frames where it begins and ends; one of a ball."""
        return (self.start,) if self.is_ball else (self.start, self.end)


BodyPairs = tuple[tuple[Body, Body], ...]


@dataclass(frozen=True)
class Bodies(ABC):
    """The bodies of a robot: how they move, and which of them are compared with each other.

    Args:
        each: the bodies, no two of one name between the same frames.
    """

    each: tuple[Body, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the bodies, each once."""
        return tuple(dict.fromkeys(body.name for body in self.each))

    def number_of(self, body: Body) -> int:
        """The number of a body, whatever its radius, from 0 on."""
        return self._numbers[body.name, body.start, body.end]

    @cached_property
    def _numbers(self) -> dict[tuple[str, int, int], int]:
        return {(body.name, body.start, body.end): number for number, body in enumerate(self.each)}

    @property
    @abstractmethod
    def turns(self) -> FloatArray:
        """Matrix (m, dof) from joint speeds to the angular rates u = turns @ dq/dt that move the bodies."""

    @property
    @abstractmethod
    def levers(self) -> FloatArray:
        """Factors (bodies, m), m: no point of body b moves faster than the sum over j of ``levers[b, j] |u_j|``."""

    def motion(self, body: Body, seen_from: Body | None = None) -> tuple[FloatArray, FloatArray]:
        """How fast a body can move, as seen from outside or from another body, nearer the base in a chain.

        Returns:
            turns (m, dof), from joint speeds to angular rates u = turns @ dq/dt; and levers (m,), m: no point of the
            body moves faster than the sum over j of ``levers[j] |u_j|``.
        """
        turns, levers = self.turns, self.levers[self.number_of(body)]
        if seen_from is None:
            return turns, levers
        both, last = self.moved_by(seen_from), self.moved_by(body)
        between = turns[both:last].copy()
        between[:, :both] = 0.0  # joints that move both bodies
        return between, levers[both:last]

    def moved_by(self, body: Body) -> int:
        """The number of the last joint that moves a body: bodies with the same number are fixed to each other."""
        return body.end

    @property
    @abstractmethod
    def pairs(self) -> BodyPairs:
        """Pairs that must not touch if ``self_collision``, the body nearer the base first; none meet in a joint."""

    @property
    def proven_pairs(self) -> BodyPairs:
        """Pairs that the verdict on a finished motion covers; a search may use fewer."""
        return self.pairs

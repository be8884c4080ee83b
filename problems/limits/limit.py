"""The interface of limits: the constraint itself, and the durations with which a shape satisfies it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Self

import casadi as ca

from problems.base.arguments import Statement
from problems.base.matrix import FloatArray, Matrix
from problems.limits.constraint import Constraint
from problems.motions.samples import Samples
from problems.robots.robot import Robot
from problems.scene.obstacle import Obstacle

FAR = 0.25  # of a constraint's scale: a motion that is everywhere farther from a limit may forget it
SAMPLING_MARGIN = 1e-3  # margin at the samples for what lies between them; relative to the reach or a joint's range


class Limit(Statement, ABC):
    """A limit on a whole motion.

    A subclass is a frozen dataclass. What it says is written once, over n samples: one symbolic row for compiled code,
    all rows for a nonlinear program, numbers for a verification.

    Attributes:
        name: of its constraint, short and unique.
        order: which derivative of the joint angles it bounds (0: the angles), so that its extremes over all t are found
            exactly, and proven; None where it is about something else.
        bends: whether it may bend much between two samples, so that nonlinear programs need short, even pieces.
    """

    name: ClassVar[str]
    order: ClassVar[int | None] = None
    bends: ClassVar[bool] = False

    @classmethod
    def holding(cls, robot: Robot, obstacles: Sequence[Obstacle]) -> Self | None:
        """The limit of a robot among obstacles; None where it does not apply."""
        raise NotImplementedError(f"{cls.__name__} is not made from a robot and obstacles alone")

    @abstractmethod
    def at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """Constraints with one row per sample.

        Args:
            samples: of the motion, in order of time.
            margin: to keep at the samples for what lies between them, a share of the limit's own size.
        """

    def between(self, before: Samples, after: Samples, margin: float = 0.0) -> list[Constraint]:
        """Constraints with one row per step from one sample to the next; none by default."""
        return []

    def constraints(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        """All constraints, at samples and between them."""
        steps = self.between(*samples.steps, margin) if samples.count > 1 else []
        return [*self.at(samples, margin), *steps]

    def repetitions(self, twin: Self) -> list[Repetition]:
        """The limit as a few that are each repeated with other numbers; none by default: it is evaluated as it is.

        Args:
            twin: the same limit with symbols for its numbers.
        """
        return []

    def repeated_numbers(self) -> list[FloatArray]:
        """The numbers of each of :meth:`repetitions`, in their order, without anything symbolic."""
        return []

    def may_break(self, samples: Samples, margin: float = 0.0) -> Matrix | None:
        """Whether it can be broken at one sample, for little work; None where nothing is known for less than all."""
        return None

    def near(self, samples: Samples) -> Self | None:
        """The limit as far as it may matter near a motion, given by numeric samples; None where it is far from it."""
        if self.order is not None:
            return self
        return self if any(constraint.room < FAR for constraint in self.constraints(samples)) else None

    @property
    def timed(self) -> Limit | None:
        """The limit as far as it matters at which time a posture is reached: nothing of it by default."""
        return None

    @property
    def untimed(self) -> Limit | None:
        """The limit as far as it does not matter at which time a posture is reached: all of it by default."""
        return self

    @property
    def robot_or_none(self) -> Robot | None:
        """The robot, for a limit that needs more than joint angles; else None."""
        return getattr(self, "robot", None)

    @property
    def scales_with_time(self) -> bool:
        """Whether every shape satisfies the limit if it is run slowly enough."""
        return False

    @property
    def kept_by_scan(self) -> bool:
        """Whether the timing of a path on a grid, :mod:`problems.motions.path_scan`, keeps it at the grid points."""
        return False

    @property
    def statics(self) -> tuple[Limit, ...]:
        """What is left of the limit however slowly a motion is run, as limits of their own; nothing by default."""
        return ()

    def magnitudes(self, samples: Samples) -> Matrix:
        """Quantities (n, m) whose peaks determine the time scale; only where the limit scales with time."""
        raise NotImplementedError

    def time_scale(self, peaks: Matrix) -> Matrix:
        """The smallest factor by which time must be multiplied for the limit to hold.

        Args:
            peaks: the largest magnitudes of each column over the motion, (1, m).

        Returns:
            A scalar; below 1 where time can be saved.
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True, eq=False)
class Repetition:
    """What a limit says of many things in the same words: written once, evaluated for each with its own numbers.

    Attributes:
        limits: about one of them, on positions of the robot's frames alone.
        symbols: the numbers of that one, (r, 1).
        numbers: of all of them, (things, r).
        frames: of which positions it needs.
        timed: whether it also needs the time.
    """

    limits: tuple[Limit, ...]
    symbols: ca.SX
    numbers: FloatArray
    frames: tuple[int, ...]
    timed: bool = False

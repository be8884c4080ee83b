"""Tasks, and their parts that figures show."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType
from typing import ClassVar, Self

import casadi as ca
import numpy as np

from problems.base import FloatArray, Parametric, Relaxation, as_array
from problems.limits import Constraint, DurationBounds
from problems.motions import Trajectory
from problems.robots import Robot
from problems.scene import Obstacle
from problems.tasks.place import Place


class MarkerKind(StrEnum):
    """The role of a marker in the task."""

    START = "start"
    VIA = "via"
    GOAL = "goal"
    POINTS = "points"  # on the way


@dataclass(frozen=True, kw_only=True)
class Marker:
    """Positions that the tip has to reach.

    Attributes:
        label: for a legend.
        points: (n, dim), m.
        kind: which role they have.
        tolerance: how near each has to be passed, m; 0 where a figure need not show it.
        connects_points: whether the tool stays as near to the lines between them.
    """

    label: str
    points: FloatArray
    kind: MarkerKind
    tolerance: float = 0.0
    connects_points: bool = False


def end_markers(robot: Robot, postures: FloatArray) -> tuple[Marker, Marker]:
    """Markers of the tool's places in the first and the last posture of a robot, (2, dof), rad."""
    ends = as_array(robot.tool.position(ca.DM(postures)))
    return (
        Marker(label="start", points=ends[:1], kind=MarkerKind.START),
        Marker(label="goal", points=ends[1:], kind=MarkerKind.GOAL),
    )


@dataclass(frozen=True, kw_only=True)
class Milestone:
    """A time of interest within a motion.

    Attributes:
        label: for a legend.
        time: from the start of the motion, s.
    """

    label: str
    time: float


@dataclass(frozen=True, kw_only=True)
class BoundedCurve:
    """A scalar quantity over the time of one motion, with bounds that are known at some times.

    Attributes:
        name: short, for a file name; the curves of one name belong into one figure.
        label: for an axis and a caption.
        symbol: of the quantity, in LaTeX.
        unit: of values and bounds.
        value: the quantity (n,) at times (n,) in s.
        times: at which the bounds are known, (m,), s.
        lower: bounds at these times, (m,).
        upper: likewise.
        event: what happens at these times, for a legend.
    """

    name: str
    label: str
    symbol: str
    unit: str
    value: Callable[[FloatArray], FloatArray]
    times: FloatArray
    lower: FloatArray
    upper: FloatArray
    event: str


@dataclass(frozen=True, kw_only=True)
class ProgressMeasure:
    """A number, beside the cost, that shows the progress of a search: smaller is better.

    Attributes:
        name: short, for a file name.
        label: for an axis and a caption.
        title: what it is, in words.
        unit: of the number and its limit.
        limit: the largest value that is allowed.
        of_candidates: (m,) values of candidates (m, d) of a search.
        of_trajectory: the value of one motion.
    """

    name: str
    label: str
    title: str
    unit: str
    limit: float
    of_candidates: Callable[[FloatArray], FloatArray]
    of_trajectory: Callable[[Trajectory], float]


class Task(Parametric, ABC):
    """A statement of a robot, what it has to do, and what it has to keep clear of. Subclasses are frozen dataclasses.

    Attributes:
        equations: where the paper states a constraint of this task, by its name, if elsewhere than for other tasks.
        duration_symbol: of the total time.
        duration_field: that has the bounds of the durations.
        robot: that moves.
        obstacles: to keep clear of.
        total_time: bounds of the duration of the whole motion, s; None where nothing is promised.
    """

    equations: ClassVar[Mapping[str, str]] = MappingProxyType({})
    duration_symbol: ClassVar[str] = "T"
    duration_field: ClassVar[str] = "total_time"

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    total_time: tuple[float, float] | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Lines on how the statement was read, for whoever made it."""
        return ()

    @property
    def goal_cost(self) -> float:
        """The least that is added to the objective where motions to several goals are compared; 0 by default."""
        return 0.0

    def added_cost(self, trajectory: Trajectory) -> float:
        """The cost of the goal that a motion reaches, added to its objective in comparisons; 0 by default."""
        return 0.0

    def taken(self, trajectory: Trajectory) -> tuple[str, ...]:
        """Lines on what a motion takes of that which the statement leaves to choose; none by default."""
        return ()

    @property
    def end_velocities(self) -> FloatArray:
        """Joint velocities at both ends of the motion, (2, dof), rad/s; at rest by default."""
        return np.zeros((2, self.robot.dof))

    @property
    def stay(self) -> float:
        """The time after arrival for which the robot has to stay clear of what moves, s; 0 by default."""
        return 0.0

    @property
    def end_accelerations(self) -> FloatArray:
        """Joint accelerations before the start and after the end, (2, dof), rad/s^2; zero by default."""
        return np.zeros((2, self.robot.dof))

    @property
    def end_rates(self) -> FloatArray:
        """Joint velocities and accelerations at both ends, (2 ends, 2, dof), rad/s and rad/s^2."""
        return np.stack([self.end_velocities, self.end_accelerations], axis=1)

    @property
    def at_rest(self) -> bool:
        """Whether both ends are at rest."""
        return not self.end_rates.any()

    @property
    def crowded(self) -> bool:
        """Whether there is anything to keep clear of: an obstacle, or the robot itself."""
        return bool(self.obstacles) or self.robot.self_collision

    @property
    def is_timed(self) -> bool:
        """Whether an obstacle moves, so that the time of each posture matters."""
        return any(obstacle.moves for obstacle in self.obstacles)

    @abstractmethod
    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        """The task's own conditions on a finished motion: numeric constraints, and the times of their rows in s."""

    @property
    def duration_bounds(self) -> DurationBounds | None:
        """The bounds of the durations of the finished motion; of the total time by default, None without any."""
        return None if self.total_time is None else DurationBounds("total time", self.duration_symbol, *self.total_time)

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:
        """The numbers of the task that restrict a motion; by default the bounds of its durations."""
        bounds = self.duration_bounds
        if bounds is None:
            return ()
        field, (shortest, longest) = self.duration_field, (bounds.shortest, bounds.longest)
        return (
            Relaxation(
                limit=bounds.name, of="shortest", statement=self, size=shortest, unit="s",
                values=lambda by: {field: (shortest - by, longest)},
            ),
            Relaxation(
                limit=bounds.name, of="longest", statement=self, size=longest, unit="s",
                values=lambda by: {field: (shortest, longest + by)},
            ),
        )  # fmt: skip

    def durations(self, trajectory: Trajectory) -> FloatArray:
        """The durations of a finished motion that these bounds restrict, (n,), s; that of the whole by default."""
        return np.array([trajectory.duration])

    @property
    def passes_nothing(self) -> bool:
        """Whether its two ends alone restrict a motion, and nothing in between; not by default."""
        return False

    @property
    def start_posture(self) -> FloatArray | None:
        """The joint angles at the start, (dof,), rad, where they are given; None where they are not."""
        return None

    def goal_posture(self, theta: FloatArray) -> FloatArray | None:
        """The joint angles of the goal that a posture (dof,), rad, reaches; None where they are not given."""
        return None

    def end_places(self, theta: FloatArray) -> tuple[Place, ...]:
        """The places of the start, and of the goal that a posture (dof,), rad, reaches; none by default."""
        return ()

    @property
    def last_places(self) -> tuple[Place, ...]:
        """The places of which one is the end, where the motion rests at one and nothing else is asked; else none."""
        return ()

    @property
    def given_postures(self) -> FloatArray:
        """Postures that the statement gives, between which joints have to turn, (n, dof), rad; none by default."""
        return np.empty((0, self.robot.dof))

    @property
    def is_plain_move(self) -> bool:
        """Whether it asks for nothing but a motion from rest at one place to rest at another; not by default."""
        return False

    @property
    def passed_postures(self) -> FloatArray | None:
        """The postures that a motion passes, both ends included, (n, dof), rad.

        None where a motion may pass others, or no more than its ends are given, as by default.
        """
        return None

    def at_free_times(self) -> Self:
        """The task of a motion that is timed anew along its path: nothing is asked at given times any more."""
        return self

    @property
    def scenery(self) -> tuple[Obstacle, ...]:
        """The bodies that are drawn around the robot: the obstacles by default."""
        return self.obstacles

    def markers(self) -> tuple[Marker, ...]:
        """Positions that the tool has to reach, for drawing; none by default."""
        return ()

    def milestones(self, trajectory: Trajectory) -> tuple[Milestone, ...]:
        """Times of interest within a motion; none by default."""
        return ()

    def bounded_curves(self, trajectory: Trajectory) -> tuple[BoundedCurve, ...]:
        """Quantities to draw over a motion together with their bounds; none by default."""
        return ()

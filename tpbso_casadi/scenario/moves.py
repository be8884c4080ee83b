"""Moves from a place to another as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import field
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from problems import (
    InvalidProblem,
    Move,
    Obstacle,
    Place,
    PointToPoint,
    Position,
    Problem,
    Robot,
    move,
    point_to_point,
    time_move,
)
from problems.assembly import Criteria, objective_named
from problems.base import Count, InvalidTable
from problems.families.via_times import INTERPOLATIONS, via_times
from problems.limits import limits_of
from problems.tasks import Elbow, ShortTurns
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.model import ModelSection, ObjectiveChoice, OwnObjectives, TaskSection
from tpbso_casadi.scenario.places import AnyGoals, AnyPlace, AnyPlaces
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    MOST_LINKS,
    NotNegative,
    Number,
    Positive,
    ScenarioError,
    Word,
    choice_of,
)

Velocities = Annotated[list[Number], Count(1, MOST_LINKS)]


ACCELERATIONS = ("start_acceleration", "goal_acceleration")
RATES = ("start_velocity", "goal_velocity", *ACCELERATIONS)


class PointToPointTask(TaskSection):
    """[task] from a start to a goal: points in m, angles in rad, times in s."""

    motions: ClassVar[tuple[str, ...]] = ("spline", "paper", "time-spline")
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType(
        {
            "paper": ("segment_time",),
            "spline": ("via", *RATES, "total_time", "stay"),
            "time-spline": (*RATES, "total_time"),
        }
    )

    kind: Literal["point-to-point"]
    start: AnyPlace
    goal: AnyGoals
    via: AnyPlaces | None = None
    start_velocity: Annotated[Velocities | None, ANGULAR] = None
    goal_velocity: Annotated[Velocities | None, ANGULAR] = None
    start_acceleration: Annotated[Velocities | None, ANGULAR] = None
    goal_acceleration: Annotated[Velocities | None, ANGULAR] = None
    objectives: OwnObjectives = field(default_factory=list)
    objective: ObjectiveChoice = "time"
    elbow: Elbow = "free"
    segment_time: tuple[Positive, Positive] | None = None
    total_time: tuple[Positive, Positive] | None = None
    stay: NotNegative | None = None

    def foreign_keys(self, motion: str) -> Iterator[str]:
        yield from super().foreign_keys(motion)
        if motion not in POSTURES_ALLOWED:
            yield from (key for key in ("start", "goal") if not _is_point(getattr(self, key)))
        if motion == "spline" and not self.via:  # past vias direct plans alone have them
            yield from (key for key in ACCELERATIONS if getattr(self, key) is not None)

    def rest_places(self) -> tuple[Any, Any]:
        for key in ("via", *RATES):
            if getattr(self, key):
                raise ScenarioError(f"task.{key}: is for a move from rest to rest that passes nothing; leave it out")
        return self.start, self.goal

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        return BUILDERS[model.motion](self, robot, obstacles, model)

    def move(self, robot: Robot, obstacles: tuple[Obstacle, ...]) -> Move:
        """The move that the table states: places, any of several goals, vias, velocities at the ends.

        Args:
            robot: that moves.
            obstacles: around it.

        Raises:
            InvalidProblem: it cannot be.
        """
        turns = ShortTurns(robot, self.start)
        vias = turns.passed(self.via or ())
        goals = turns.reached(self.goal if isinstance(self.goal, list) else [self.goal])
        return Move(
            robot,
            self.start,
            goals,
            vias,
            self.elbow,
            obstacles,
            tuple(self.start_velocity or ()),
            tuple(self.goal_velocity or ()),
            self.total_time,
            tuple(self.start_acceleration or ()),
            tuple(self.goal_acceleration or ()),
            self.stay or 0.0,
            tuple(turns.notes),
        )

    def judged(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Criteria:
        if model.motion != "spline":
            return super().judged(robot, obstacles, model)
        objective = objective_named(find_objective(self.objective, self.own_objectives), robot)
        limits = limits_of(robot, obstacles, model.further_limits)
        return Criteria(task=self.move(robot, obstacles), objective=objective, limits=limits).at_free_times()


def _is_point(place: Place | list[Place]) -> bool:
    """Whether a place is a point that is reached exactly."""
    return isinstance(place, Position) and not place.within


def _paper(table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
    """The paper's statement: from rest at a point to rest at another."""
    if robot.dim != 2:
        raise InvalidProblem("motion", "'paper' is for robots in the plane; leave it out, or say 'spline'")
    assert isinstance(table.start, Position)
    assert isinstance(table.goal, Position)
    task = PointToPoint(robot, table.start.point, table.goal.point, table.elbow, obstacles, table.segment_time)
    objective = find_objective(table.objective, table.own_objectives)
    return point_to_point(task, objective, model.formulation, model.samples, model.further_limits)


def _spline(
    table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection
) -> Problem[Any]:
    """A path that is timed."""
    task, objective = table.move(robot, obstacles), find_objective(table.objective, table.own_objectives)
    return move(task, objective, model.samples, model.pieces, model.further_limits)


def _time_spline(
    table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection
) -> Problem[Any]:
    """A motion over time that leaves from any state."""
    task, objective = table.move(robot, obstacles), find_objective(table.objective, table.own_objectives)
    pieces = {} if model.pieces is None else {"pieces": model.pieces}
    return time_move(task, objective, model.samples, limits=model.further_limits, **pieces)


class ViaTimesTask(TaskSection):
    """[task] through given postures by an interpolation of the literature, whose interval times are searched."""

    motions: ClassVar[tuple[str, ...]] = ("via-times",)

    kind: Literal["via-times"]
    start: AnyPlace
    via: AnyPlaces | None = None
    goal: AnyPlace
    interpolation: Annotated[Word, choice_of(INTERPOLATIONS)] = "cubic"
    interval_time: tuple[Positive, Positive] | None = None
    objectives: OwnObjectives = field(default_factory=list)
    objective: ObjectiveChoice = "time"

    def check(self) -> None:
        super().check()
        if self.interval_time is not None and not self.interval_time[0] < self.interval_time[1]:
            raise InvalidTable("the first number has to be less than the second", "interval_time")

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        return via_times(
            Move(robot, self.start, (self.goal,), tuple(self.via or ()), obstacles=obstacles),
            find_objective(self.objective, self.own_objectives),
            self.interpolation,
            model.formulation,
            model.samples,
            self.interval_time,
            model.further_limits,
        )


BUILDERS: dict[str, Callable[[PointToPointTask, Robot, tuple[Obstacle, ...], ModelSection], Problem[Any]]] = {
    "paper": _paper,
    "spline": _spline,
    "time-spline": _time_spline,
}
POSTURES_ALLOWED = ("spline", "time-spline")  # motions whose ends may be postures, or one of several goals

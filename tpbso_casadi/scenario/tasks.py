"""Tasks as tables: point to point, and the registry of kinds."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

from pydantic import Field, PlainValidator, SerializeAsAny
from pydantic_core import PydanticCustomError

from problems import (
    InvalidProblem,
    Move,
    Obstacle,
    PathFollowing,
    PointToPoint,
    Problem,
    Robot,
    move,
    point_to_point,
    time_move,
)
from problems.tasks import Elbow, JointFollowing, PathTracing, SpaceTracing, Task
from tpbso_casadi.scenario.catalogues import Catalogue, PluginError, find_objective, subclass_of
from tpbso_casadi.scenario.model import ModelSection, ObjectiveChoice, OwnObjectives, TaskSection
from tpbso_casadi.scenario.path_tasks import (
    ClosedCurveTask,
    JointPathTask,
    JointPiecesTask,
    PentagramTask,
    PointsTask,
    pieces_table,
    points_table,
)
from tpbso_casadi.scenario.places import AnyGoals, AnyPlace, AnyPlaces, built, stated_place
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    MOST_LINKS,
    NotNegative,
    Number,
    Positive,
    ScenarioError,
    hint,
    in_words,
    plain,
    read_section,
)

Velocities = Annotated[list[Number], Field(min_length=1, max_length=MOST_LINKS)]


class PointToPointTask(TaskSection):
    """[task] from a start to a goal: points in m, angles in rad, times in s."""

    motions: ClassVar[tuple[str, ...]] = ("spline", "paper", "time-spline")
    keys_of: ClassVar[Mapping[str, tuple[str, ...]]] = MappingProxyType(
        {
            "paper": ("segment_time",),
            "spline": ("via", "start_velocity", "goal_velocity", "total_time", "stay"),
            "time-spline": ("start_velocity", "start_acceleration", "total_time"),
        }
    )

    kind: Literal["point-to-point"]
    start: AnyPlace
    goal: AnyGoals
    via: AnyPlaces | None = None
    start_velocity: Annotated[Velocities | None, ANGULAR] = None
    goal_velocity: Annotated[Velocities | None, ANGULAR] = None
    start_acceleration: Annotated[Velocities | None, ANGULAR] = None
    objectives: OwnObjectives = Field(default_factory=list)
    objective: ObjectiveChoice = "time"
    elbow: Elbow = "free"
    segment_time: tuple[Positive, Positive] | None = None
    total_time: tuple[Positive, Positive] | None = None
    stay: NotNegative | None = None

    def foreign_keys(self, motion: str) -> Iterator[str]:
        """Also ends that are no points, which the paper's motion has not."""
        yield from super().foreign_keys(motion)
        if motion not in POSTURES_ALLOWED:
            yield from (key for key in ("start", "goal") if not isinstance(getattr(self, key), tuple))

    def rest_places(self) -> tuple[Any, Any]:
        """Start and goal; a goal may be a list."""
        for key in ("via", "start_velocity", "goal_velocity", "start_acceleration"):
            if getattr(self, key):
                raise ScenarioError(f"task.{key}: is for a move from rest to rest that passes nothing; leave it out")
        return self.start, self.goal

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
        """The problem itself."""
        return BUILDERS[model.motion](self, robot, obstacles, model)


def _paper(table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> Problem[Any]:
    """The paper's statement: from rest at a point to rest at another."""
    if robot.dim != 2:
        raise InvalidProblem("motion", "'paper' is for robots in the plane; leave it out, or say 'spline'")
    assert isinstance(table.start, tuple)
    assert isinstance(table.goal, tuple)
    task = PointToPoint(robot, table.start, table.goal, table.elbow, obstacles, table.segment_time)
    objective = find_objective(table.objective, table.own_objectives)
    return point_to_point(task, objective, model.formulation, model.samples, model.further_limits)


def _move(table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...]) -> Move:
    """Ours: places, any of several goals, vias, velocities at the ends."""
    goals = table.goal if isinstance(table.goal, list) else [table.goal]
    return Move(
        robot,
        built(table.start),
        tuple(map(built, goals)),
        tuple(map(built, table.via or ())),
        table.elbow,
        obstacles,
        tuple(table.start_velocity or ()),
        tuple(table.goal_velocity or ()),
        table.total_time,
        tuple(table.start_acceleration or ()),
        table.stay or 0.0,
    )


def _spline(
    table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection
) -> Problem[Any]:
    """A path that is timed."""
    task, objective = _move(table, robot, obstacles), find_objective(table.objective, table.own_objectives)
    return move(task, objective, model.samples, model.pieces, model.further_limits)


def _time_spline(
    table: PointToPointTask, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection
) -> Problem[Any]:
    """A motion over time that leaves from any state."""
    task, objective = _move(table, robot, obstacles), find_objective(table.objective, table.own_objectives)
    pieces = {} if model.pieces is None else {"pieces": model.pieces}
    return time_move(task, objective, model.samples, limits=model.further_limits, **pieces)


BUILDERS: dict[str, Callable[[PointToPointTask, Robot, tuple[Obstacle, ...], ModelSection], Problem[Any]]] = {
    "paper": _paper,
    "spline": _spline,
    "time-spline": _time_spline,
}
POSTURES_ALLOWED = ("spline", "time-spline")  # motions whose ends may be postures, or one of several goals


TASKS: dict[str, type[TaskSection]] = {  # by kind, or by kind/shape
    "point-to-point": PointToPointTask,
    "path": PointsTask,
    "path/pentagram": PentagramTask,
    "path/closed-curve": ClosedCurveTask,
    "joint-path": JointPathTask,
    "joint-path/pieces": JointPiecesTask,
}


class Statement(NamedTuple):
    """How a task is stated.

    Attributes:
        section: of its table.
        model: keys of [model].
        own: makes the keys that are no field of the task as it is.
        replaced: fields whose content those keys state.
    """

    section: type[TaskSection]
    model: Mapping[str, Any]
    own: Callable[[Any], dict[str, Any]] = lambda task: {}
    replaced: tuple[str, ...] = ()


def _stated_places(task: Move) -> dict[str, Any]:
    """The places of a move as tables."""
    goals = [stated_place(goal, f"goal[{k}]" if len(task.goals) > 1 else "goal") for k, goal in enumerate(task.goals)]
    vias = [stated_place(via, f"via[{k}]") for k, via in enumerate(task.vias)]
    via = {"via": vias} if vias else {}
    return {"start": stated_place(task.start, "start"), "goal": goals if len(goals) > 1 else goals[0], **via}


def _stated_points(task: PathFollowing | PathTracing | SpaceTracing) -> dict[str, Any]:
    return points_table(task.path)


STATED: dict[type[Task], Statement] = {
    PointToPoint: Statement(PointToPointTask, {"motion": "paper"}),
    Move: Statement(PointToPointTask, {"motion": "spline"}, _stated_places, ("goals", "vias")),
    PathFollowing: Statement(PointsTask, {"motion": "paper"}, _stated_points, ("path",)),
    PathTracing: Statement(PointsTask, {"motion": "spline"}, _stated_points, ("path",)),
    SpaceTracing: Statement(PointsTask, {"motion": "spline"}, _stated_points, ("path",)),
    JointFollowing: Statement(JointPiecesTask, {}, lambda task: pieces_table(task.path), ("path",)),
}


def task_tables(task: Task) -> tuple[dict[str, Any], dict[str, Any]]:
    """The tables [task] and [model] that state a task; its robot and its obstacles have tables of their own.

    A field is the key of its name, and left out where it has its default.

    Raises:
        ScenarioError: no table states such a task, or one of its fields.
    """
    if type(task) not in STATED:
        kinds = ", ".join(kind.__name__ for kind in STATED)
        raise ScenarioError(f"no table states a {type(task).__name__}; there are {kinds}, or a scenario with its kind")
    section, model, own, replaced = STATED[type(task)]
    values = {field.name: (getattr(task, field.name), field.default) for field in fields(task)}  # type: ignore[arg-type]
    elsewhere = {"robot", "obstacles", *replaced}
    stated = {name: value for name, (value, usual) in values.items() if name not in elsewhere and _is_own(value, usual)}
    lost = stated.keys() - section.model_fields.keys() - ModelSection.model_fields.keys()
    if lost:
        raise ScenarioError(f"no key of [task] states {', '.join(sorted(lost))} of this {type(task).__name__}")
    stated |= own(task)
    stated["kind"] = next(name for name, known in TASKS.items() if known is section).partition("/")[0]
    of_task, of_model = (
        {key: plain(value) for key, value in stated.items() if key in table.model_fields}
        for table in (section, ModelSection)
    )
    return of_task, {**model, **of_model}


def _is_own(value: Any, usual: Any) -> bool:
    """Whether a field has another value than it has by default."""
    return not (value is usual or (type(value) is type(usual) and value == usual))


TASK_CATALOGUE: Catalogue[type[TaskSection]] = Catalogue(
    kind="task",
    group="tpbso_casadi.tasks",
    registry=TASKS,
    accepts=subclass_of(TaskSection),
    requirement="a subclass of tpbso_casadi.scenario.model.TaskSection",
)


def _is_plugin(name: str) -> bool:
    """Whether a kind of task is offered by a plug-in, or is a path to its class."""
    return ":" in name or name in TASK_CATALOGUE.names()


def read_task(table: Any) -> TaskSection:
    """The section of a [task] table, whose kind and shape say which of ``TASKS`` it is."""
    if isinstance(table, TaskSection):
        return table
    named = [table.get(key) for key in ("kind", "shape")] if isinstance(table, dict) else [None]
    name = "/".join(str(part) for part in named if part is not None)
    if name not in TASKS and not _is_plugin(name):
        shapes = (task.partition("/") for task in TASKS)
        options = [f"kind = {kind!r}" + (f" with shape = {shape!r}" if shape else "") for kind, _, shape in shapes]
        raise PydanticCustomError("unknown_task", f"needs {in_words(options)}{hint(name, TASKS)}")
    try:
        section = TASK_CATALOGUE.find(name)
    except PluginError as error:
        raise PydanticCustomError("unknown_task", "{reason}", {"reason": str(error)}) from error
    return read_section(section, table, "kind", name)


AnyTask = Annotated[SerializeAsAny[TaskSection], PlainValidator(read_task)]

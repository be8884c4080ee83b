"""The registry of kinds of tasks, and the tables that state a task."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Annotated, Any, NamedTuple

from problems import (
    Move,
    PathFollowing,
    PointToPoint,
)
from problems.base import InvalidTable, ReadBy, did_you_mean, in_words
from problems.tasks import JointFollowing, PathTracing, RecordedMotion, SpaceTracing, Task
from tpbso_casadi.scenario.catalogues import Catalogue, PluginError, subclass_of
from tpbso_casadi.scenario.model import ModelSection, TaskSection
from tpbso_casadi.scenario.moves import PointToPointTask, ViaTimesTask
from tpbso_casadi.scenario.path_tasks import (
    ClosedCurveTask,
    JointPathTask,
    JointPiecesTask,
    PentagramTask,
    PointsTask,
    pieces_table,
    points_table,
)
from tpbso_casadi.scenario.plugin_failures import plug_in_failures
from tpbso_casadi.scenario.recorded_tasks import MotionPiecesTask, MotionRowsTask, motion_table
from tpbso_casadi.scenario.sequence import SequenceTask
from tpbso_casadi.scenario.validation import ScenarioError, plain

TASKS: dict[str, type[TaskSection]] = {  # by kind, or by kind/shape
    "point-to-point": PointToPointTask,
    "via-times": ViaTimesTask,
    "path": PointsTask,
    "path/pentagram": PentagramTask,
    "path/closed-curve": ClosedCurveTask,
    "joint-path": JointPathTask,
    "joint-path/pieces": JointPiecesTask,
    "recorded-motion": MotionRowsTask,
    "recorded-motion/pieces": MotionPiecesTask,
    "sequence": SequenceTask,
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
    goals = list(task.goals)
    return {"start": task.start, "goal": goals if len(goals) > 1 else goals[0], "via": list(task.vias) or None}


def _stated_points(task: PathFollowing | PathTracing | SpaceTracing) -> dict[str, Any]:
    return points_table(task.path)


STATED: dict[type[Task], Statement] = {
    PointToPoint: Statement(PointToPointTask, {"motion": "paper"}),
    Move: Statement(PointToPointTask, {"motion": "spline"}, _stated_places, ("goals", "vias", "alternatives")),
    PathFollowing: Statement(PointsTask, {"motion": "paper"}, _stated_points, ("path",)),
    PathTracing: Statement(PointsTask, {"motion": "spline"}, _stated_points, ("path",)),
    SpaceTracing: Statement(PointsTask, {"motion": "spline"}, _stated_points, ("path",)),
    JointFollowing: Statement(JointPiecesTask, {}, lambda task: pieces_table(task.path), ("path",)),
    RecordedMotion: Statement(MotionPiecesTask, {}, lambda task: motion_table(task.motion), ("motion", "joined")),
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
    lost = stated.keys() - section.schema().keys() - ModelSection.schema().keys()
    if lost:
        raise ScenarioError(f"no key of [task] states {', '.join(sorted(lost))} of this {type(task).__name__}")
    stated |= own(task)
    stated["kind"] = next(name for name, known in TASKS.items() if known is section).partition("/")[0]
    of_task, of_model = (
        {key: plain(value) for key, value in stated.items() if key in table.schema()}
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
        raise InvalidTable(f"needs {in_words(options)}{did_you_mean(name, TASKS)}")
    try:
        section = TASK_CATALOGUE.find(name)
    except PluginError as error:
        raise InvalidTable(str(error)) from error
    with plug_in_failures("kind", name):
        return section.from_table(table)


def task_with_keys(task: TaskSection, keys: Mapping[str, Any]) -> TaskSection:
    """A task with some keys stated anew; another kind or shape makes it a task of another class.

    Raises:
        InvalidTable: naming the first wrong key.
    """
    if not keys.keys().isdisjoint(("kind", "shape")):
        return read_task(task.table() | dict(keys))
    stated = {key: getattr(task, key) for key in task.stated_keys}
    with plug_in_failures("kind", task.kind):
        return type(task).from_table(stated | dict(keys))


AnyTask = Annotated[TaskSection, ReadBy(read_task)]

"""The kinds of [task] tables, by name."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import PlainValidator, SerializeAsAny
from pydantic_core import PydanticCustomError

from tpbso_casadi.plugins import Catalogue, PluginError, subclass_of
from tpbso_casadi.scenario.section import read_section
from tpbso_casadi.scenario.task import TaskSection
from tpbso_casadi.scenario.tasks.joint_path import JointPathTask, JointPiecesTask
from tpbso_casadi.scenario.tasks.path import ClosedCurveTask, PentagramTask, PointsTask
from tpbso_casadi.scenario.tasks.point_to_point import PointToPointTask
from tpbso_casadi.scenario.validation import hint, in_words

TASKS: dict[str, type[TaskSection]] = {  # by kind, or by kind/shape
    "point-to-point": PointToPointTask,
    "path": PointsTask,
    "path/pentagram": PentagramTask,
    "path/closed-curve": ClosedCurveTask,
    "joint-path": JointPathTask,
    "joint-path/pieces": JointPiecesTask,
}


TASK_CATALOGUE: Catalogue[type[TaskSection]] = Catalogue(
    kind="task",
    group="tpbso_casadi.tasks",
    registry=TASKS,
    accepts=subclass_of(TaskSection),
    requirement="a subclass of tpbso_casadi.scenario.task.TaskSection",
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

"""``tp.certify``: anybody's motion, judged for all t."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from problems import Limit, Obstacle, Trajectory
from problems.base import FloatArray, shown_value
from problems.motions import RowInterpolation
from tpbso_casadi.facade.arguments import in_words_of_python, several, whole
from tpbso_casadi.facade.foreign import exact_pieces
from tpbso_casadi.facade.own import AnyConstraint, constraints_table
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.robots import STANDS, AnyRobot
from tpbso_casadi.facade.statement import obstacles_of
from tpbso_casadi.facade.surroundings import (
    Content,
    carrying,
    changed,
    given_keys,
    in_scene,
    surroundings,
)
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.planning import plan as plan_scenario
from tpbso_casadi.scenario import (
    OF_A_FILE,
    InputFolder,
    Scenario,
    ScenarioError,
    motion_table,
    named,
    read_motion,
    read_recorded,
    reading_of,
    rows_table,
)
from tpbso_casadi.storage import read_run

Rows: TypeAlias = Sequence[Any] | Mapping[str, Any]  # times, positions and, where there are, rates
AnyMotion: TypeAlias = Trajectory | Plan | Rows | str | Path | Any
KEYS = {"times": ("t", "times"), "positions": ("q", "positions"), "velocities": ("qd", "velocities"),
        "accelerations": ("qdd", "accelerations"), "joint_names": ("joint_names",)}  # fmt: skip


def certify(
    trajectory: AnyMotion,
    robot: AnyRobot | None = None,
    *,
    interpolation: RowInterpolation = "auto",
    joint_names: Sequence[str] | None = None,
    obstacles: Iterable[Obstacle | dict[str, Any]] | str | Path | None = None,
    scene: str | Path | None = None,
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None,
    limits: Iterable[str | type[Limit]] | None = None,
    margin: float | None = None,
    self_collision: bool | None = None,
    payload: float | None = None,
    without: Iterable[str] | str = (),
    message: int | None = None,
    topic: str | None = None,
    columns: str | None = None,
    prefix: str | None = None,
    unit: str | None = None,
    time_unit: str | None = None,
    start: Sequence[float] | None = None,
) -> Plan:
    """Judge a motion that is given in time, whoever made it, for all t: nothing of it is changed.

    Args:
        trajectory: rows, as arrays ``(times, positions[, velocities[, accelerations]])`` of shapes (n,) and (n, k), or
            as a mapping with the keys ``t, q, qd, qdd``; in s, rad, rad/s, rad/s^2. A file of rows: CSV, NPZ, a ROS
            message as YAML or JSON. A :class:`Trajectory`, a plan, the folder of a run. A piecewise polynomial of
            SciPy, TOPP-RA, Drake or Ruckig, whose pieces are taken exactly.
        robot: that moves, as for :func:`plan`; or a TOML file with an [arm] or a [robot] table, whose obstacles, margin
            and constraints are judged too. That of the plan or of the scene where it is left out.
        interpolation: between rows. ``auto`` is what the joint trajectory controller of ROS does: rows of positions
            alone are joined by straight lines, with velocities by cubics, with accelerations too by quintics.
        joint_names: of the columns; those of the robot in its own order where they are left out.
        obstacles: to keep clear of, as for :func:`plan`, in place of all others.
        scene: a TOML file with what is around the robot, or a scene file of MoveIt (``.scene``): each of its tables and
            keys holds in place of the robot's, and what it does not state is kept.
        constraints: of your own, to be kept at every time, as for :func:`plan`.
        limits: kinds of limits that hold besides those of the robot and of the obstacles.
        margin: what the robot keeps from obstacles, m.
        self_collision: whether its own bodies must not touch.
        payload: what the tool carries, a mass at its own origin, kg.
        without: names of limits by which it is not judged, such as ``jerk``; they stand beside the status.
        message: which trajectory of a bag of ROS, from 1 on; None of one that holds one.
        topic: of a bag, the one that is read: trajectories, or a recording of ``sensor_msgs/JointState``.
        columns: of a table, and what they hold, as ``timestamp=t,actual_q_*=q*``; none where it says so itself.
        prefix: of names of joints: those that begin with it are read, without it.
        unit: of the rows, ``rad`` or ``deg``, of joints that turn.
        time_unit: of the times of a file, ``s``, ``ms``, ``us`` or ``ns``.
        start: where the joints stand at t = 0, before the first row.

    Returns:
        The motion with a verdict on every constraint: proven, violated (when first, when worst, by how much, which
        joint or which bodies) or undecided; ``certified`` says whether all are proven.

    Raises:
        ScenarioError: it is no motion of this robot, a file cannot be read, or an argument is wrong.
        InvalidRun: a folder is no run.
    """
    with in_words_of_python():
        further = None if limits is None else several("limits", limits, "kinds of limits")
        model: Content = {"margin": margin, "self_collision": self_collision, "limits": further}
        beside = {"obstacles": None if obstacles is None else obstacles_of(obstacles)}
        left_out = [without] if isinstance(without, str) else several("without", without, "names of limits")
        task: Content = {"interpolation": interpolation, "joint_names": joint_names, "without": left_out or None}
        task |= {"topic": topic, "columns": columns, "prefix": prefix, "unit": unit, "time_unit": time_unit}
        task |= {"message": None if message is None else whole("message", message), "start": start}
        scenario = certified_scenario(
            trajectory, robot, task, scene=scene, model=model, beside=beside, payload=payload, constraints=constraints
        )
        return Plan(plan_scenario(scenario))


def certified_scenario(
    trajectory: AnyMotion,
    robot: AnyRobot | None,
    task: Content,
    *,
    scene: str | Path | None = None,
    model: Content | None = None,
    beside: Content | None = None,
    payload: float | None = None,
    constraints: Any = None,
) -> Scenario:
    """The scenario of a motion that is judged as it is.

    Args:
        trajectory: as of :func:`certify`.
        robot: likewise.
        task: how rows are read and joined, and ``without``; None of what is not stated, as of the other tables.
        scene: as of :func:`certify`.
        model: keys of [model].
        beside: tables in place of those of the robot's file, of the scene or of the plan.
        payload: as of :func:`certify`.
        constraints: likewise.

    Raises:
        ScenarioError: naming the first wrong key.
        InvalidRun: a folder is no run.
    """
    motion, around = motion_content(trajectory, given_keys(task))
    known = surrounding_scenario(robot, scene, payload, around)
    stated = dict(model or {})
    if constraints is not None or stated.get("limits"):
        stated |= _further(known, constraints, stated.get("limits"))
    return changed(known, stated, beside, None if scene is not None else robot).replaced(task=read_motion(motion))


def _further(known: Scenario, constraints: Any, limits: Any) -> Content:
    """Keys of [model] for constraints and kinds of limits besides those of a scenario."""
    own: dict[str, list[Any]] = {"constraints": [], "limits": []}
    if constraints is not None:
        own = constraints_table(constraints, known.robot_table.build())
    return {
        "constraints": [*known.model.constraints, *own["constraints"]] or None,
        "limits": list(dict.fromkeys([*known.model.limits, *(limits or []), *own["limits"]])) or None,
    }


def surrounding_scenario(
    robot: AnyRobot | None, scene: str | Path | None, payload: float | None, around: Scenario | None = None
) -> Scenario:
    """The robot and the surroundings by which motions are judged, without a motion.

    Args:
        robot: as of :func:`certify`.
        scene: likewise.
        payload: likewise.
        around: what a motion comes with; None where it comes alone.
    """
    known = surroundings(robot, around) if scene is None else in_scene(Path(scene), around, robot)
    return carrying(known, payload)


def motion_content(trajectory: AnyMotion, given: Content) -> tuple[Content, Scenario | None]:
    """The [task] table that a motion states, and of a plan what is around it.

    Args:
        trajectory: as of :func:`certify`.
        given: how rows are joined, and what their columns are called, where that is stated.

    Raises:
        ScenarioError: it is no motion.
    """
    if isinstance(trajectory, str) and not trajectory:
        raise ScenarioError("trajectory: the name of a file or a folder is needed, not ''")
    if isinstance(trajectory, str | Path) and not Path(trajectory).is_dir():
        return file_content(Path(trajectory), given), None
    of_a_file = next((key for key in OF_A_FILE if key in given), None)
    if of_a_file is not None:
        raise ScenarioError(f"{of_a_file}: says how a file is read; this is none")
    if isinstance(trajectory, str | Path | Plan):
        plan = trajectory.planned if isinstance(trajectory, Plan) else read_run(Path(trajectory))
        return _plan_content(plan, trajectory, given)
    pieces = (trajectory, 0.0) if isinstance(trajectory, Trajectory) else exact_pieces(trajectory)
    if pieces is not None:
        return motion_table(*pieces) | _of_pieces(given), None
    return _rows_content(trajectory) | given, None


def file_content(file: Path, given: Content) -> Content:
    """The [task] table that a file of rows states.

    Raises:
        ScenarioError: naming the file, and what is wrong with it.
    """
    rows = read_recorded(InputFolder(file.parent, outside_allowed=True), file.name, reading_of(given))
    given = {key: value for key, value in given.items() if key not in OF_A_FILE}
    if rows.breakpoints and given.get("interpolation", "auto") == "auto":
        pieces = {"breakpoints": rows.breakpoints, "coefficients": rows.coefficients}
        stated = {"joint_names": rows.joint_names, "remarks": rows.remarks}
        return {**STANDS, "shape": "pieces", **pieces, **stated, **_of_pieces(given)}
    return {**STANDS, **rows_table(rows), **given}


def _plan_content(plan: PlannedMotion, trajectory: AnyMotion, given: Content) -> tuple[Content, Scenario]:
    name = "trajectory" if isinstance(trajectory, Plan) else trajectory
    with named(name):
        if plan.motion.stages:
            raise ScenarioError("a sequence is judged stage by stage, with what it carries; say tpbso audit")
        if not plan.criteria.task.at_rest:
            raise ScenarioError("it begins or ends in motion, as its task says; say tpbso audit")
    motion = motion_table(plan.trajectory, task=plan.criteria.task)
    return motion | _of_pieces(given), plan.scenario


def _of_pieces(given: Content) -> Content:
    """The keys for polynomial pieces.

    Raises:
        ScenarioError: rows are spoken of.
    """
    for key in ("unit", "start", *(("interpolation",) if given.get("interpolation", "auto") != "auto" else ())):
        if key in given:
            raise ScenarioError(f"{key}: the motion is complete between its rows; it is for rows")
    return {key: given[key] for key in ("joint_names", "without") if key in given}


def _rows_content(rows: Any) -> Content:
    """The keys of a [task] table of rows as arrays."""
    if isinstance(rows, Mapping):
        known = {name for names in KEYS.values() for name in names}
        unknown = next((name for name in rows if name not in known), None)
        if unknown is not None:
            raise ScenarioError(
                f"trajectory: has no use for {shown_value(unknown)}; there are {', '.join(sorted(known))}"
            )
        found = {key: next((rows[name] for name in names if name in rows), None) for key, names in KEYS.items()}
    elif isinstance(rows, Sequence) and not isinstance(rows, str | bytes) and 2 <= len(rows) <= 4:
        found = dict(zip(KEYS, rows, strict=False))
    elif all(hasattr(rows, name) for name in ("times", "positions")):
        found = {key: getattr(rows, key, None) for key in KEYS}
    else:
        needed = "(times, positions[, velocities[, accelerations]]), a file, a folder, a plan or a piecewise polynomial"
        raise ScenarioError(f"trajectory: {needed} is needed, not {shown_value(rows)}")
    names = found.pop("joint_names", None)
    stated = {key: _array(key, value) for key, value in found.items() if value is not None}
    for key in ("times", "positions"):
        if not (key in stated and stated[key].size):
            raise ScenarioError(f"trajectory: {key} are needed")
    rows = {key: array.tolist() for key, array in stated.items() if array.size}
    return {**STANDS, **rows, **({} if names is None else {"joint_names": several("joint_names", names, "words")})}


DIMENSIONS = {"times": 1}  # others have 2


def _array(key: str, value: Any) -> FloatArray:
    if np.ma.is_masked(value) or np.iscomplexobj(value):
        raise ScenarioError(f"{key}: an array of numbers is needed, none of them masked or complex")
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise ScenarioError(f"{key}: an array of numbers is needed: {error}") from error
    if array.size and array.ndim != DIMENSIONS.get(key, 2):
        shape = "(n,)" if key in DIMENSIONS else "(n, k)"
        raise ScenarioError(f"{key}: an array {shape} is needed, not {array.shape}")
    return array

"""The robot of a motion that is given, and what is around it, from files and arguments."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any, TypeAlias

from problems.base import at
from tpbso_casadi.facade.robots import STANDS, AnyRobot
from tpbso_casadi.facade.robots import robot as robot_of
from tpbso_casadi.scenario import (
    AnyRobotTable,
    InputFolder,
    RobotSection,
    Scenario,
    ScenarioError,
    as_scenario_errors,
    named,
    parse_scenario,
    plain,
    read_toml,
    with_files_read,
)

Content: TypeAlias = dict[str, Any]
ROBOTS = ("arm", "robot", "robots")  # tables of which one states a robot
AROUND = ("obstacles", "carried", "may_touch")
OF_A_FILE = ("unit", *ROBOTS, *AROUND, "frames", "scene", "constraints", "model")  # which a file says of any motion
MODEL_KEYS = ("limits", "margin", "self_collision", "constraints")  # of [model], that say something of any motion
OF_ONE_ROBOT = (".urdf", ".xacro")  # endings of files that state a robot and nothing around it
SCENE = ".scene"  # the ending of MoveIt's files
ANY_ROBOT = {"robot": {"model": "panda"}}  # beside which the tables of a scene are read that states none


def given_keys(keys: Content) -> Content:
    """The keys that have a value, as plain data."""
    return {key: plain(value) for key, value in keys.items() if value is not None}


def scenario_around(
    task: Content,
    around: Scenario | None,
    robot: AnyRobot | None,
    *,
    model: Content | None = None,
    beside: Content | None = None,
    payload: float | None = None,
) -> Scenario:
    """The scenario of a task on a motion or a path that is given.

    Args:
        task: the [task] table.
        around: what the motion comes with: its robot, obstacles; None where it comes alone.
        robot: another one, as of :func:`retime`; or a TOML file that states one and what is around it.
        model: keys of [model]; None of what is not stated.
        beside: ``obstacles``, ``carried``, ``may_touch`` in place of those of the robot's file or around; likewise.
        payload: what the tool carries, a mass at its own origin, kg; 0 for none.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    return changed(carrying(surroundings(robot, around, task), payload), model, beside, robot)


def changed(
    known: Scenario, model: Content | None = None, tables: Content | None = None, robot: AnyRobot | None = None
) -> Scenario:
    """A scenario with some keys of [model] and some tables stated anew; None of what is not stated.

    Args:
        known: to begin with.
        model: keys of [model].
        tables: of the scenario.
        robot: as of :func:`scenario_around`; beside its file lie the files that tables name.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    stated, keys, file = given_keys(tables or {}), given_keys(model or {}), file_of(robot)
    if not stated and not keys:
        return known
    with nullcontext() if file is None else named(file), as_scenario_errors():
        with at("model"):
            stated |= {"model": known.model.with_keys(keys)} if keys else {}
        found = known.with_keys(stated)
        folder = InputFolder(Path() if file is None else file.parent, outside_allowed=True)
        return with_files_read(found, folder) if tables else found


def surroundings(robot: AnyRobot | None, around: Scenario | None, task: Content = STANDS) -> Scenario:
    """A robot and what is around it, with a task.

    Args:
        robot: as of :func:`scenario_around`.
        around: likewise.
        task: in the unit of the robot's file, where a file states it.

    Raises:
        ScenarioError: naming the first wrong key, or that there is no robot.
    """
    file = file_of(robot)
    if file is not None:
        return _of_file(file, read_toml(file), task)
    stated = {} if around is None else _tables_of(around)
    if robot is not None:
        arm = robot_of(robot)
        others = {key: value for key, value in stated.items() if key not in ROBOTS}
        stated = others | arm.tables | {"model": others.get("model", {}) | arm.tables["model"]}
    if not any(stated.get(key) for key in ROBOTS):
        raise ScenarioError("robot: missing; say which robot runs the path, robot=tp.robot(...)")
    return parse_scenario({**stated, "task": task})


def file_of(robot: AnyRobot | None) -> Path | None:
    """The file that states a robot and what is around it; None where no file does."""
    file = Path(robot) if isinstance(robot, str | Path) else None
    is_one = file is not None and (file.suffix == ".toml" or (file.is_file() and file.suffix not in OF_ONE_ROBOT))
    return file if is_one else None


def _of_file(file: Path, content: Content, task: Content) -> Scenario:
    """The scenario of the tables of a file that say something of any motion, with a task."""
    tables = {key: value for key, value in content.items() if key in OF_A_FILE}
    model = tables.get("model", {})
    if isinstance(model, dict):
        tables["model"] = {key: value for key, value in model.items() if key in MODEL_KEYS}
    with named(file):
        return parse_scenario({**tables, "task": task}, InputFolder(file.parent, outside_allowed=True))


def _tables_of(scenario: Scenario) -> Content:
    """The tables of a scenario that state its robot and its surroundings, as they are."""
    model = {key: getattr(scenario.model, key) for key in MODEL_KEYS if key in scenario.model.stated_keys}
    tables = {key: getattr(scenario, key) for key in (*ROBOTS, *AROUND)}
    return {key: value for key, value in tables.items() if value} | {"model": model}


def carrying(scenario: Scenario, mass: float | None) -> Scenario:
    """A scenario whose robot has another payload, kg, if one is stated; 0 for none."""
    if mass is None:
        return scenario
    if scenario.robots is not None:
        raise ScenarioError("payload: of which robot of the cell? state it in its own table")
    with as_scenario_errors(scenario.robot_key):
        return scenario.replaced(**{scenario.robot_key: _loaded(scenario.robot_table, mass)})


def _loaded(table: AnyRobotTable, mass: float) -> AnyRobotTable:
    """A robot's table with a payload, kg; it is one of the settings where the robot has those."""
    payload = {"mass": mass} if mass else None
    if isinstance(table, RobotSection):
        others = {key: value for key, value in table.settings.items() if key != "payload"}
        return table.with_keys({"settings": others | ({} if payload is None else {"payload": payload})})
    return table.with_keys({"payload": payload})


def in_scene(file: Path, around: Scenario | None, robot: AnyRobot | None) -> Scenario:
    """A scene with its robot: the one that is given, else its own, else that of the motion.

    Args:
        file: a TOML file, or one of MoveIt's.
        around: what the motion comes with; None where it comes alone.
        robot: as of :func:`scenario_around`.

    Raises:
        ScenarioError: it cannot be read, or names the first wrong key.
    """
    tables = {"scene": file.name} if file.suffix == SCENE else read_toml(file)
    own = [key for key in ROBOTS if key in tables]
    scene = _of_file(file, tables | ({} if own else ANY_ROBOT), STANDS)
    if robot is None and own:
        return scene
    known = surroundings(robot, around)
    stated = _tables_of(scene)
    merged = changed(known, stated["model"], {key: stated[key] for key in AROUND if key in stated})
    if "may_touch" in stated:  # whose names are those of links
        with named(file):
            merged.built()
    return merged

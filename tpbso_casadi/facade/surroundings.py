"""The robot of a motion that is given, and what is around it, from files and arguments."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import Any, TypeAlias

from problems.base import at
from tpbso_casadi.facade.robots import AnyRobot, AnyTable
from tpbso_casadi.facade.robots import robot as robot_of
from tpbso_casadi.scenario import (
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
STANDS = {"kind": "recorded-motion"}  # a [task] without rows: what is around a motion is read before it is
ROBOTS = ("arm", "robot")  # tables that state a robot
AROUND = ("obstacles", "carried", "may_touch")
OF_A_FILE = ("unit", *ROBOTS, *AROUND, "scene", "constraints", "model")  # which a file says of any motion
MODEL_KEYS = ("limits", "margin", "self_collision", "constraints")  # of [model], that say something of any motion
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
    file = file_of(robot)
    with nullcontext() if file is None else named(file):
        known = carrying(surroundings(robot, around), payload)
        return changed(known, model, {"task": task, **(beside or {})}, file)


def changed(
    known: Scenario, model: Content | None = None, tables: Content | None = None, file: Path | None = None
) -> Scenario:
    """A scenario with some keys of [model] and some tables stated anew; None of what is not stated.

    Args:
        known: to begin with.
        model: keys of [model].
        tables: of the scenario.
        file: beside which the files lie that tables name; those of the working folder where None.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    stated, keys = given_keys(tables or {}), given_keys(model or {})
    with as_scenario_errors():
        with at("model"):
            stated |= {"model": known.model.with_keys(keys)} if keys else {}
        found = known.with_keys(stated)
    folder = InputFolder(Path() if file is None else file.parent, outside_allowed=True)
    return with_files_read(found, folder) if stated.keys() & {*AROUND, "task"} else found


def surroundings(robot: AnyRobot | None, around: Scenario | None) -> Scenario:
    """A robot and what is around it, with a task that has no rows yet.

    Args:
        robot: as of :func:`scenario_around`.
        around: likewise.

    Raises:
        ScenarioError: naming the first wrong key, or that there is no robot.
    """
    file = file_of(robot)
    if file is not None:
        return _of_file(file, {key: value for key, value in read_toml(file).items() if key in OF_A_FILE})
    stated = {} if around is None else _tables_of(around)
    if robot is not None:
        arm = robot_of(robot)
        others = {key: value for key, value in stated.items() if key not in ROBOTS}
        stated = others | arm.tables | {"model": others.get("model", {}) | arm.tables["model"]}
    if not any(stated.get(key) for key in ROBOTS):
        raise ScenarioError("robot: missing; say which robot runs the path, robot=tp.robot(...)")
    return parse_scenario({**stated, "task": STANDS})


def file_of(robot: AnyRobot | None) -> Path | None:
    """The file that states a robot and what is around it; None where no file does."""
    file = Path(robot) if isinstance(robot, str | Path) else None
    is_one = file is not None and (file.suffix == ".toml" or (file.exists() and file.suffix != ".urdf"))
    return file if is_one else None


def _of_file(file: Path, tables: Content) -> Scenario:
    model = tables.get("model", {})
    if isinstance(model, dict):
        tables = tables | {"model": {key: value for key, value in model.items() if key in MODEL_KEYS}}
    return parse_scenario({**tables, "task": STANDS}, InputFolder(file.parent, outside_allowed=True))


def _tables_of(scenario: Scenario) -> Content:
    """What a scenario states of its robot and of what is around it, as it is."""
    model = {key: getattr(scenario.model, key) for key in MODEL_KEYS if key in scenario.model.stated_keys}
    tables = {key: getattr(scenario, key) for key in (*ROBOTS, *AROUND)}
    return {key: value for key, value in tables.items() if value} | {"model": model}


def carrying(scenario: Scenario, mass: float | None) -> Scenario:
    """A scenario whose robot has another payload, kg, if one is stated; 0 for none."""
    if mass is None:
        return scenario
    key = "arm" if scenario.arm is not None else "robot"
    with as_scenario_errors(key):
        return scenario.replaced(**{key: _loaded(scenario.robot_table, mass)})


def _loaded(table: AnyTable, mass: float) -> AnyTable:
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
    with named(file):
        scene = _of_file(file, ({} if own else ANY_ROBOT) | {key: tables[key] for key in OF_A_FILE if key in tables})
    if robot is None and own:
        return scene
    known = surroundings(robot, around)
    stated = _tables_of(scene)
    merged = changed(known, stated["model"], {key: stated[key] for key in AROUND if key in stated})
    if "may_touch" in stated:  # whose names are those of links
        with named(file):
            merged.built()
    return merged

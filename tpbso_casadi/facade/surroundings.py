"""The robot of a motion that is given, and what is around it, from files and arguments."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any, TypeAlias

from tpbso_casadi.facade.robots import AnyRobot
from tpbso_casadi.facade.robots import robot as robot_of
from tpbso_casadi.scenario import (
    InputFolder,
    Scenario,
    ScenarioError,
    named,
    parse_scenario,
    plain,
    read_toml,
)

Content: TypeAlias = dict[str, Any]
OWN_TABLES = ("arm", "robot")  # that state a robot
AROUND_TABLES = ("obstacles", "scene", "carried", "may_touch", "constraints")
ROBOT_TABLES = ("unit", *OWN_TABLES, *AROUND_TABLES, "model")  # of a file that states a robot, or of a run's scenario
MODEL_KEYS = ("limits", "margin", "self_collision", "constraints")  # of [model], that say something of any motion
SCENE = ".scene"  # the ending of MoveIt's files


def given_keys(keys: Content) -> Content:
    """Those that are stated, as plain data."""
    return {key: plain(value) for key, value in keys.items() if value is not None}


def around_tables(content: Content) -> Content:
    """The tables of a scenario that state a robot and what is around it."""
    return {key: content[key] for key in ROBOT_TABLES if key in content}


def scenario_around(
    task: Content,
    around: Content,
    robot: AnyRobot | None,
    *,
    model: Content | None = None,
    beside: Content | None = None,
    payload: float | None = None,
) -> Scenario:
    """The scenario of a task on a motion or a path that is given.

    Args:
        task: the [task] table.
        around: tables of what the motion comes with: its robot, obstacles; none where it comes alone.
        robot: another one, as of :func:`retime`; or a TOML file that states one and what is around it.
        model: keys of [model]; None of what is not stated.
        beside: ``obstacles``, ``carried``, ``may_touch`` in place of those of the robot's file or around; likewise.
        payload: what the tool carries, a mass at its own origin, kg; 0 for none.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    content, file = around, None
    if robot is not None:
        content, file = _robot_tables(robot, around)
    elif not any(content.get(key) for key in OWN_TABLES):
        raise ScenarioError("robot: missing; say which robot runs the path, robot=tp.robot(...)")
    content = _carrying(content, payload) | {"task": task} | given_keys({} if beside is None else beside)
    stated = content.get("model", {})
    if isinstance(stated, dict):
        kept = {key: stated[key] for key in MODEL_KEYS if key in stated}
        content["model"] = kept | given_keys({} if model is None else model)
    if file is None:
        return parse_scenario(content)
    with named(file):
        return parse_scenario(content, InputFolder(file.parent, outside_allowed=True))


def _robot_tables(robot: AnyRobot, around: Content) -> tuple[Content, Path | None]:
    """The tables that state a robot and what is around it, and the file that has them, where one does."""
    file = Path(robot) if isinstance(robot, str | Path) else None
    if file is not None and (file.suffix == ".toml" or (file.exists() and file.suffix != ".urdf")):
        return around_tables(read_toml(file)), file
    stated = robot_of(robot).content
    kept = {key: value for key, value in around.items() if key not in (*OWN_TABLES, "unit")}
    return {**kept, **stated, "model": around.get("model", {}) | stated["model"]}, None


def _carrying(content: Content, mass: float | None) -> Content:
    """The same with another payload, kg, if one is stated."""
    tables = [key for key in OWN_TABLES if mass is not None and isinstance(content.get(key), dict)]
    return content | {key: _loaded(content[key], mass) for key in tables}


def _loaded(table: Content, mass: float | None) -> Content:
    """A robot's table with a payload, kg; it is one of the settings where the robot has those."""
    if isinstance(table.get("settings"), dict):
        return table | {"settings": _loaded(table["settings"], mass)}
    unloaded = {key: value for key, value in table.items() if key != "payload"}
    return unloaded | ({"payload": {"mass": mass}} if mass else {})


ANY_ROBOT = {"robot": {"model": "panda"}}  # beside which the tables of a scene are read that states none


def scene_tables(file: Path) -> Content:
    """What a scene states, complete without other files, in rad: a TOML file, or one of MoveIt's.

    Its robot is among it, where it states one; its task is not.

    Raises:
        ScenarioError: it cannot be read, or names the first wrong key.
    """
    content = {"scene": file.name} if file.suffix == SCENE else around_tables(read_toml(file))
    own = [key for key in OWN_TABLES if key in content]
    stands = {"kind": "recorded-motion"}  # no task of its own is needed
    with named(file):
        whole = {**({} if own else ANY_ROBOT), **content, "task": stands}
        scene = parse_scenario(whole, InputFolder(file.parent, outside_allowed=True))
    return stated_tables(scene, own)


def stated_tables(scenario: Scenario, own: Collection[str] = OWN_TABLES) -> Content:
    """What a scenario states of its robot and of what is around it, complete without other files.

    Args:
        scenario: of any task.
        own: tables that state its robot.
    """
    model = {
        key: value
        for key, value in scenario.model.table().items()
        if key in scenario.model.stated_keys & set(MODEL_KEYS)
    }
    tables = scenario.part((*own, *AROUND_TABLES))
    return tables | {"model": model}

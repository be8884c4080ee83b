"""Scenarios read from files and from plain data.

Every error is a :class:`ScenarioError` of one line that names the file, the key and the reason.
"""

from __future__ import annotations

import os
import pathlib
from typing import Any

from problems.base import InvalidTable, shown_value, too_much
from tpbso_casadi.scenario.input_files import InputFolder, read_toml
from tpbso_casadi.scenario.obstacles import with_files
from tpbso_casadi.scenario.plugin_failures import failures_named
from tpbso_casadi.scenario.scenario import ROBOTS, Scenario
from tpbso_casadi.scenario.scene_files import read_scene
from tpbso_casadi.scenario.validation import MOST_OBSTACLES, ScenarioError, as_scenario_errors, named


def read_scenario(path: str | pathlib.Path, outside_allowed: bool = False) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: of the file.
        outside_allowed: whether it may name files that lie outside its own folder.

    Raises:
        ScenarioError: unreadable, not TOML, or not a scenario.
    """
    stated = stated_scenario(path, outside_allowed)
    with named(path), as_scenario_errors():
        return stated.with_postures()


def stated_scenario(path: str | pathlib.Path, outside_allowed: bool = False) -> Scenario:
    """Read a scenario file, whose places stay stated by names and in frames; its files are read, and it is in rad.

    ``stated.replaced(frames=[...]).with_postures()`` is the scenario with its frames elsewhere.

    Args:
        path: as of :func:`read_scenario`.
        outside_allowed: likewise.

    Raises:
        ScenarioError: unreadable, not TOML, or not a scenario.
    """
    if not isinstance(path, str | os.PathLike):
        raise ScenarioError(f"path: the path of a file is needed, not {shown_value(path)}")
    file = pathlib.Path(path)
    content = read_toml(file)
    with named(path):
        return parse_stated(content, InputFolder(file.parent, outside_allowed))


def parse_scenario(content: dict[str, Any], folder: InputFolder | None = None) -> Scenario:
    """Check the content of a scenario; what comes out is in rad, and all of it in the world.

    Args:
        content: of the file.
        folder: where the files lie that it names; None where it is complete without them.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    with as_scenario_errors():
        return parse_stated(content, folder).with_postures()


def parse_stated(content: dict[str, Any], folder: InputFolder | None = None) -> Scenario:
    """Check the content of a scenario as far as :func:`stated_scenario` does.

    Args:
        content: as of :func:`parse_scenario`.
        folder: likewise.

    Raises:
        ScenarioError: naming the first wrong key.
    """
    scenario = _validated(content)
    return (scenario if folder is None else with_files_read(scenario, folder)).normalised()


def with_files_read(scenario: Scenario, folder: InputFolder) -> Scenario:
    """The scenario with the content of the files that it names.

    Args:
        scenario: as it is stated.
        folder: where the files lie.

    Raises:
        ScenarioError: a file cannot be read, or may not be.
    """
    with failures_named(scenario.plugins, "task"):
        obstacles = with_files(scenario.obstacles, folder, "obstacles")
        if scenario.scene is not None:
            obstacles += read_scene(scenario.scene, folder)
            if len(obstacles) > MOST_OBSTACLES:
                raise ScenarioError(f"scene: {len(obstacles)} obstacles, of at most {MOST_OBSTACLES}")
        files: dict[str, Any] = {"task": scenario.task.with_files(folder), "obstacles": obstacles, "scene": None}
        files["carried"] = with_files(scenario.carried, folder, "carried")
        for key in ROBOTS[1:]:
            if (table := getattr(scenario, key)) is not None:
                files[key] = table.with_files(folder)
    return scenario.replaced(**files)


def _validated(content: dict[str, Any]) -> Scenario:
    """The scenario in the unit that it states."""
    try:
        return Scenario.from_table(content)
    except InvalidTable as error:
        raise ScenarioError(str(error)) from error
    except RecursionError as error:
        raise ScenarioError(too_much(error)) from error

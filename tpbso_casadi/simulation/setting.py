"""What a simulation begins with: robot, scene and the postures that are visited."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from problems import InvalidProblem, Robot
from problems.base.matrix import FloatArray
from problems.scene.obstacle import Obstacle, standing
from problems.tasks.place import Joints
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.simulation import SimulationSection
from tpbso_casadi.scenario.tasks.places import built
from tpbso_casadi.simulation.postures import posture_at
from tpbso_casadi.simulation.world import World


@dataclass(frozen=True, kw_only=True)
class Setting:
    """What a simulation begins with.

    Attributes:
        scenario: complete: its [simulation] table too, and postures for all places.
        settings: that table.
        robot: that moves.
        world: all obstacles.
        start: where the robot is at t = 0, at rest.
        goals: visited one after the other, cyclically.
    """

    scenario: Scenario
    settings: SimulationSection
    robot: Robot
    world: World
    start: Joints
    goals: tuple[Joints, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> Self:
        """The beginning of the simulation of a scenario.

        Raises:
            ScenarioError: it cannot be simulated; the message names the key.
        """
        settings = scenario.simulation or SimulationSection()
        start, goals = _places(scenario, settings)
        criteria = scenario.criteria()
        robot, obstacles = criteria.robot, criteria.obstacles
        world = World.of(obstacles, scenario.obstacles, settings, scenario.solver.seed)
        first = _posture("task.start", start, robot, obstacles, None)
        near = np.array(first.values)
        visited = tuple(_posture(key, place, robot, standing(obstacles), near) for key, place in goals)
        task = {"start": _table(first), "goal": _table(visited[0])}
        table = settings.model_dump() | {"goals": [_table(goal) for goal in visited]}
        content = scenario.model_dump() | {"model": scenario.model.stated(), "simulation": table}
        complete = parse_scenario(content | {"task": content["task"] | task})
        assert complete.simulation is not None
        return cls(
            scenario=complete,
            settings=complete.simulation,
            robot=robot,
            world=world,
            start=first,
            goals=visited,
        )


def _places(scenario: Scenario, settings: SimulationSection) -> tuple[Any, list[tuple[str, Any]]]:
    """Start, and the places to visit with the keys that state them."""
    start, goal = scenario.task.rest_places()
    if settings.goals is not None:
        return start, [(f"simulation.goals.{number}", place) for number, place in enumerate(settings.goals)]
    if isinstance(goal, list):
        raise ScenarioError("task.goal: is a list; state in simulation.goals which places are visited in which order")
    return start, [("task.goal", goal), ("task.start", start)]


def _posture(key: str, place: Any, robot: Robot, obstacles: tuple[Obstacle, ...], near: FloatArray | None) -> Joints:
    try:
        return posture_at(built(place), robot, obstacles, near, key)
    except InvalidProblem as error:
        raise ScenarioError(f"{key}: {error.reason}") from error


def _table(joints: Joints) -> dict[str, list[float]]:
    return {"joints": list(joints.values)}

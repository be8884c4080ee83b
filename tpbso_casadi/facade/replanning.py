"""``replan(...)``: planning once again, from a plan that is being executed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeAlias

from problems import Obstacle, Trajectory
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.statement import HasScenario, given_scenario
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.planning.replanning.replan import replan as replan_motion
from tpbso_casadi.planning.replanning.step import Step
from tpbso_casadi.scenario.scenario import Scenario

Executed: TypeAlias = Plan | PlannedMotion | Step | Trajectory


def replan(
    previous: Executed,
    at_time: float,
    scene: Scenario | HasScenario | str | Path | Iterable[Obstacle],
    within: float | None = None,
    *,
    every: float = 0.1,
    fail_safe_rate: float = 0.0,
) -> Step:
    """What an arm does that has executed a plan up to some time and then sees another scene.

    Args:
        previous: a plan, a step, or a motion alone.
        at_time: up to which it has been executed, s on its own clock; the new clock starts then.
        scene: the obstacles as seen then, on clocks that start then; or a scenario that states them so, and maybe
            another goal: itself, its file, its name or a plan. For a motion alone a scenario is needed.
        within: s that the search may take; as many evaluations as usual where None.
        every: how long the decision may take, s: the motion goes on for as long.
        fail_safe_rate: how fast obstacles that move may leave their prediction, m/s, in any direction.

    Raises:
        InvalidProblem: the time is not within the motion, or motion, robot and obstacles do not fit together.
        ScenarioError: the scenario is of another robot, or no move to a goal at rest.
    """
    executed = previous.planned if isinstance(previous, Plan) else previous
    given = given_scenario(scene)
    obstacles: Any = scene
    seen = tuple(obstacles) if given is None else given
    return replan_motion(executed, at_time, seen, within, every=every, fail_safe_rate=fail_safe_rate)

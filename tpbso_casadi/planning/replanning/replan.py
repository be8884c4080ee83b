"""Planning once again, from a plan that is being executed: for users."""

from __future__ import annotations

from collections.abc import Sequence

from problems import InvalidProblem, Obstacle, Trajectory
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.planning.replanning.candidates import remaining
from tpbso_casadi.planning.replanning.replanner import Replanner
from tpbso_casadi.planning.replanning.step import Step
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.section import ScenarioError


def replan(
    previous: PlannedMotion | Step | Trajectory,
    at_time: float,
    scene: Scenario | Sequence[Obstacle],
    within: float | None = None,
    *,
    every: float = 0.1,
    fail_safe_rate: float = 0.0,
) -> Step:
    """What an arm does that has executed a plan up to some time and then sees another scene.

    Args:
        previous: a plan, a step, or a motion alone.
        at_time: up to which it has been executed, s on its own clock; the new clock starts then.
        scene: the obstacles as seen then, on clocks that start then, or a whole scenario that states them so, and maybe
            another goal. For a motion alone a scenario is needed.
        within: s that the search may take; as many evaluations as usual where None.
        every: how long the decision may take, s: the motion goes on for as long.
        fail_safe_rate: as in :class:`Replanner`, m/s.

    Raises:
        InvalidProblem: the time is not within the motion, or motion, robot and obstacles do not fit together.
        ScenarioError: the scenario is of another robot, or no move to a goal at rest.
    """
    trajectory = previous if isinstance(previous, Trajectory) else previous.trajectory
    own = None if isinstance(previous, Trajectory) else previous.scenario
    stated = scene if isinstance(scene, Scenario) else None
    scenario = stated or own
    if scenario is None:
        raise ScenarioError("scene: for a motion alone a scenario is needed, which states robot and goal")
    if own is not None and own.robot_table != scenario.robot_table:
        raise ScenarioError(f"{scenario.robot_table.prefix.split('.')[0]}: not the one of the motion that is executed")
    if not 0.0 <= at_time <= trajectory.duration:
        raise InvalidProblem("at_time", f"{at_time:g} s is not within the motion, 0 to {trajectory.duration:g} s")
    replanner = Replanner(scenario, every, fail_safe_rate, within=within)
    obstacles = replanner.task.obstacles if isinstance(scene, Scenario) else scene
    return replanner.replan(remaining(trajectory, at_time, every), obstacles)

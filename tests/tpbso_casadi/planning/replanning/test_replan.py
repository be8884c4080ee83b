"""Planning again from a plan, for users: times, scenes, misuse; and searches that begin with a plan."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.replanning import GOAL, START, crossing, scenario

from problems import InvalidProblem, Trajectory
from tpbso_casadi import Replanner, parse_scenario, replan
from tpbso_casadi.planning import SearchedMotion, plan
from tpbso_casadi.planning.plan import candidates_of
from tpbso_casadi.scenario import Scenario, ScenarioError

FAR = (2.6, 1.9)


def small_plan(
    of: Scenario | None = None, evaluations: int = 200, warm_start: SearchedMotion | None = None
) -> SearchedMotion:
    """A short search along a spline over time."""
    content = (of or scenario()).model_dump(exclude_none=True, exclude_defaults=True)
    content["model"] = {"motion": "time-spline"}
    content["solver"] = {"name": "lshade", "evaluations": evaluations}
    found = plan(parse_scenario(content), warm_start=warm_start).searched
    assert found is not None
    return found


@pytest.fixture(scope="module")
def planned() -> SearchedMotion:
    return small_plan(evaluations=1000)


def test_a_plan_goes_on_where_nothing_has_changed_for_the_worse(planned: SearchedMotion) -> None:
    step = replan(planned, 0.3, [crossing(FAR)])
    assert step.certified
    assert step.trajectory.value_at_end() == pytest.approx(GOAL, abs=1e-8)
    assert step.trajectory.at(np.zeros(1))[0] == pytest.approx(planned.trajectory.at(np.array([0.3]))[0])
    again = replan(step, 0.1, [crossing(FAR)])
    assert (again.kind, again.certified) == ("old", True)
    assert again.trajectory.duration == pytest.approx(step.trajectory.duration - 0.1)


def test_a_scenario_states_the_scene_and_the_goal_anew(planned: SearchedMotion) -> None:
    other = scenario(goal=[0.9, 0.4, 0.2])
    step = replan(planned.trajectory, 0.3, other, every=0.05)
    assert (step.kind, step.certified) == ("new", True)
    assert step.trajectory.value_at_end() == pytest.approx([0.9, 0.4, 0.2], abs=1e-9)


def test_at_the_end_it_stands(planned: SearchedMotion) -> None:
    step = replan(planned, planned.trajectory.duration, [crossing(FAR)])
    assert (step.kind, step.certified, step.trajectory.moves) == ("old", True, False)
    assert np.abs(step.trajectory.at(np.linspace(0.0, 0.1, 5), 1)).max() < 1e-9


def test_what_is_no_obstacle_is_refused() -> None:
    """Such as the sections of a scenario, which are not yet obstacles."""
    content = scenario().model_dump(exclude_none=True, exclude_defaults=True)
    section = parse_scenario({**content, "obstacles": [{"center": [2.6, 1.9], "semi_axes": [0.1, 0.1]}]}).obstacles[0]
    with pytest.raises(InvalidProblem, match=r"^obstacles: obstacle 2: EllipseSection is not an Obstacle; "):
        Replanner(scenario()).first(obstacles=[crossing(FAR), section])  # type: ignore[list-item]


@pytest.mark.parametrize("time", [-0.1, 100.0, float("nan")])
def test_times_outside_the_motion_are_refused(planned: SearchedMotion, time: float) -> None:
    with pytest.raises(InvalidProblem, match=r"^at_time: .* s is not within the motion, 0 to .* s$"):
        replan(planned, time, [])


def test_what_does_not_fit_is_refused(planned: SearchedMotion) -> None:
    with pytest.raises(ScenarioError, match=r"^scene: for a motion alone a scenario is needed"):
        replan(planned.trajectory, 0.1, [])
    longer = scenario().model_dump(exclude_none=True, exclude_defaults=True)
    longer["arm"]["link_lengths"] = [0.8, 0.7, 0.6]
    with pytest.raises(ScenarioError, match=r"^arm: not the one of the motion that is executed$"):
        replan(planned, 0.1, parse_scenario(longer))
    with pytest.raises(InvalidProblem, match=r"^executed: a motion of 2 joints for a robot of 3$"):
        replan(Trajectory.standing(np.zeros(2), 1.0), 0.1, scenario())
    with pytest.raises(InvalidProblem, match=r"^within: -1 is not within"):
        replan(planned, 0.1, [], within=-1.0)


def test_a_search_begins_with_the_plan_before(planned: SearchedMotion) -> None:
    """So few evaluations find nothing as good by themselves; and what a plan begins with is all that it depends on."""
    cold, warm, again = (small_plan(evaluations=30, warm_start=first) for first in (None, planned, planned))
    assert warm.search.cost <= planned.search.cost < cold.search.cost
    assert warm.search.x.tolist() == again.search.x.tolist()


def test_a_motion_is_fitted_where_the_search_had_other_variables(planned: SearchedMotion) -> None:
    content = scenario().model_dump(exclude_none=True, exclude_defaults=True)
    content["solver"] = {"name": "lshade", "evaluations": 300}
    other = plan(parse_scenario(content))
    known = candidates_of(planned.problem, other)
    assert known is not None
    assert known.shape == (1, len(planned.problem.variables))
    fitted = planned.problem.trajectory(known[0])
    times = np.linspace(0.0, 1.0, 11)
    apart = fitted.at(times * fitted.duration) - other.trajectory.at(times * other.trajectory.duration)
    assert np.abs(apart).max() < 0.1
    from_motion = candidates_of(planned.problem, planned.motion)
    assert from_motion is not None
    assert len(from_motion) == 1
    both = candidates_of(planned.problem, planned)
    assert both is not None
    assert len(both) == 2


def test_plans_from_which_nothing_can_begin_are_refused(planned: SearchedMotion) -> None:
    with pytest.raises(ScenarioError, match=r"^warm_start: its search had other variables"):
        plan(scenario(), warm_start=planned)
    two = {"arm": {"link_lengths": [1.0, 1.0], "max_speed": 3.0, "max_acceleration": 15.0}}
    two["task"] = {"kind": "point-to-point", "start": {"joints": [0.0, 0.5]}, "goal": {"joints": [1.0, 0.5]}}
    with pytest.raises(ScenarioError, match=r"^warm_start: a motion of 3 joints for a robot of 2$"):
        plan(parse_scenario(two), warm_start=planned)


def test_a_planner_goes_on_from_a_plan(planned: SearchedMotion) -> None:
    step = Replanner(scenario()).first(planned.trajectory, [crossing(FAR)])
    assert step.certified
    assert step.trajectory.at(np.zeros(1))[0] == pytest.approx(START)

"""Moves that leave from any state: what is kept, what a candidate costs, and problems restated with other numbers."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.cases import equal_links
from helpers.searching import sampled
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Ellipse, InvalidProblem, Joints, Move, Position, Trajectory, move, time_move
from problems.assembly import Criteria
from problems.evaluation import EvaluationOptions
from problems.scene import Obstacle
from problems.scene.moving import ConstantVelocity, MovingObstacle
from solvers import LSHADE, Budget, SearchBox, minimize

ARM = equal_links(2)
HOME, AWAY, OTHER = Joints((-0.4, 0.3)), Joints((0.9, 0.6)), Joints((1.1, 0.1))
STATE = {"start_velocity": (0.8, -0.3), "start_acceleration": (3.0, 1.0)}
ENDS = ("start", "goal", "start velocity", "goal velocity")


def crossing(x: float, speed: float, size: float = 0.15) -> MovingObstacle:
    return MovingObstacle(Ellipse((x, 1.5), (size, size)), ConstantVelocity((0.0, -speed), (0.0, 0.0)))


def stated(*obstacles: Obstacle, **changes: Any) -> Move:
    return Move(**({"robot": ARM, "start": HOME, "goals": (AWAY,), "obstacles": obstacles, **STATE} | changes))


FREE = time_move(stated(), samples=24)
CROSSED = time_move(stated(crossing(1.5, 1.0)), samples=24)
PASSING = {"goal_velocity": (0.0, 0.7), "goal_acceleration": (2.0, -1.0)}


def named(criteria: Criteria, trajectory: Trajectory, name: str) -> Any:
    return next(verdict for verdict in criteria.verify(trajectory) if verdict.name == name)


@given(seed=st.integers(0, 2**32 - 1), arriving=st.sampled_from([{}, PASSING]))
@settings(deadline=None, max_examples=25)
def test_every_candidate_leaves_and_arrives_as_it_has_to(seed: int, arriving: dict[str, Any]) -> None:
    problem = CROSSED.same_structure_with(stated(crossing(1.5, 1.0), **arriving))
    trajectory = problem.trajectory(sampled(problem, 1, seed)[0])
    conditions = [constraint for constraint, _ in problem.criteria.task.conditions(trajectory)]
    stated_rates = {"start acceleration", *(["goal acceleration"] if arriving else [])}
    assert {each.name for each in conditions} == {*ENDS, *stated_rates}
    assert all(each.slack >= 0.0 for each in conditions)
    shortest, longest = problem.encoding.durations
    assert shortest <= trajectory.duration <= longest


@pytest.mark.parametrize("end", ["start", "goal"])
def test_another_acceleration_at_an_end_is_found_out(end: str) -> None:
    task = stated(crossing(1.5, 1.0), **PASSING)
    problem = CROSSED.same_structure_with(task)
    trajectory, key = problem.trajectory(sampled(problem, 1, 4)[0]), f"{end}_acceleration"
    off = getattr(task, key)[0], getattr(task, key)[1] + 1e-6
    other = replace(problem.criteria, task=replace(task, **{key: off}))
    verdict = named(other, trajectory, f"{end} acceleration")
    assert not verdict.satisfied
    assert verdict.worst == pytest.approx(1e-6)


def test_a_jerk_limit_does_not_mind_the_acceleration_at_the_start() -> None:
    smooth = replace(ARM, max_jerk=(4000.0, 4000.0))
    problem = time_move(stated(robot=smooth), samples=24)
    trajectory = problem.trajectory(problem.quintics(3)[1])
    assert named(problem.criteria, trajectory, "jerk").satisfied
    still = replace(problem.criteria, task=stated(robot=smooth, start_acceleration=()))
    assert "accelerations jump, t = 0 s" in named(still, trajectory, "jerk").where


def test_a_feasible_candidate_costs_its_duration_and_keeps_its_limits_at_the_samples() -> None:
    x = sampled(FREE, 200, 4)
    costs, bound = FREE.cost(x), FREE.objective_upper_bound
    feasible = np.flatnonzero(costs <= bound)
    assert 2 < feasible.size < 198
    for i in range(len(x)):
        trajectory = FREE.trajectory(x[i])
        times = np.linspace(0.0, trajectory.duration, 25)
        peaks = [float(np.abs(trajectory.at(times, order)).max()) for order in (1, 2)]
        if i in feasible:
            assert costs[i] == pytest.approx(trajectory.duration)
            assert peaks[0] <= 4.0
            assert peaks[1] <= 20.0
        else:
            assert peaks[0] > 0.97 * 4.0 or peaks[1] > 0.97 * 20.0


def test_a_search_finds_a_certified_way_past_what_crosses() -> None:
    problem = time_move(stated(crossing(1.8, 1.0, 0.1)))
    straight = problem.quintics(8)
    assert (problem.cost(straight)[:2] > problem.objective_upper_bound).all()
    found = minimize(problem.cost, SearchBox(*problem.bounds), LSHADE(), Budget(800), 1, known=straight)
    assert found.cost < 1.0
    assert all(verdict.satisfied for verdict in problem.criteria.verify(problem.trajectory(found.x)))


def test_any_of_several_goals() -> None:
    problem = time_move(stated(goals=(AWAY, OTHER)), samples=24)
    assert problem.variables[0].name == "which_goal"
    for x in (*sampled(problem, 6, 4), *problem.quintics(2)):
        goal = (AWAY, OTHER)[int(x[0])]
        assert problem.trajectory(x).at(np.array([1e9]))[0].size == 2
        assert problem.quantities(x)["theta_goal"] == pytest.approx(goal.values)
        assert problem.quantities(x)["T"] == pytest.approx(problem.trajectory(x).duration)


@given(st.integers(0, 2**32 - 1))
@settings(deadline=None, max_examples=15)
def test_a_vector_is_found_back_from_its_motion(seed: int) -> None:
    problem = time_move(stated(goals=(AWAY, OTHER)), samples=24)
    x = sampled(problem, 1, seed)[0]
    found = problem.nearest_candidate(problem.trajectory(x))
    assert int(found[0]) == int(x[0])
    assert problem.trajectory(found).duration == pytest.approx(problem.trajectory(x).duration)
    again, first = (problem.trajectory(one).at(np.linspace(0.0, 0.2, 9)) for one in (found, x))
    assert again == pytest.approx(first, abs=1e-8)


def test_a_motion_that_is_too_long_is_clipped_into_the_box() -> None:
    lower, upper = FREE.bounds
    x = FREE.nearest_candidate(FREE.trajectory(sampled(FREE, 1, 4)[0]).time_scaled(50.0))
    assert ((x >= lower) & (x <= upper)).all()
    assert FREE.trajectory(x).duration == pytest.approx(FREE.encoding.durations[1])


AT_REST = stated(crossing(1.5, 1.0), start_velocity=(), start_acceleration=())
RESTATED = {
    "another state and goal": stated(
        crossing(1.5, 1.0), start=Joints((0.0, 0.1)), start_velocity=(0.0, 1.0), goals=(OTHER,), **PASSING
    ),
    "at rest": AT_REST,
    "another place and speed": stated(crossing(0.9, 0.4, 0.1)),
}


@pytest.mark.parametrize(
    ("backend", "task"),
    [*(("vm", task) for task in RESTATED.values()), ("native", RESTATED["another place and speed"])],
    ids=[*RESTATED, "native"],
)
@pytest.mark.usefixtures("cache_folder")
def test_a_restated_problem_has_the_bits_of_a_new_one(backend: str, task: Move) -> None:
    options = EvaluationOptions(backend)
    CROSSED.evaluator(options)(sampled(CROSSED, 3, 4))
    restated, anew = CROSSED.same_structure_with(task), time_move(task, samples=24)
    x = sampled(anew, 60, 4)
    assert (restated.evaluator(options)(x) == anew.evaluator(options)(x)).all()
    assert restated.first is restated.same_structure_with(AT_REST).first is CROSSED
    assert restated.criteria.verify(restated.trajectory(x[0])) == anew.criteria.verify(anew.trajectory(x[0]))


def test_another_make_is_built_anew() -> None:
    for task in (
        stated(),
        stated(crossing(1.5, 1.0), crossing(1.2, 1.0)),
        stated(Ellipse((1.5, 1.2), (0.1, 0.1))),
        stated(crossing(1.5, 1.0), goals=(AWAY, OTHER)),
        stated(crossing(1.5, 1.0), total_time=(0.5, 3.0), robot=equal_links(2)),
    ):
        assert CROSSED.same_structure_with(task).first is None
    restated, anew = CROSSED.same_structure_with(stated()), time_move(stated(), samples=24)
    x = sampled(anew, 20, 4)
    assert (restated.cost(x) == anew.cost(x)).all()


def test_what_is_observed_is_not_checked() -> None:
    there = np.array([0.9, 0.6]), np.array([9.0, 0.0]), np.zeros(2)
    observed = stated().observed(there, (crossing(1.0, 2.0),), (OTHER,))
    assert observed.start == Joints((0.9, 0.6))
    assert observed.end_velocities[0].tolist() == [9.0, 0.0]
    assert (observed.goals, len(observed.obstacles)) == ((OTHER,), 1)
    assert stated().observed(there, ()).goals == (AWAY,)


def test_the_duration_keeps_what_the_task_says() -> None:
    problem = time_move(stated(total_time=(1.5, 2.0)), samples=24)
    shortest, longest = problem.encoding.durations
    assert 1.5 <= shortest < longest <= 2.0
    trajectory = problem.trajectory(problem.quintics(2)[1])
    assert named(problem.criteria, trajectory, "total time").satisfied


def test_only_motions_that_leave_at_rest_may_be_slowed_down() -> None:
    still = time_move(stated(start_velocity=(), start_acceleration=()), samples=24)
    hasty = still.trajectory(still.quintics(2)[0])
    assert still.criteria.safe_time_scale(hasty) > 1.0
    assert FREE.criteria.safe_time_scale(FREE.trajectory(FREE.quintics(2)[0])) == 1.0


def test_what_these_motions_do_not_do() -> None:
    there = Position((1.0, 0.5))
    for changes, expected in (
        ({"vias": (AWAY,)}, "via: motion 'time-spline' passes none"),
        ({"goals": (there,)}, "goal: motion 'time-spline' needs joint angles there"),
        ({"start": there}, "start: motion 'time-spline' needs joint angles there"),
    ):
        with pytest.raises(InvalidProblem, match=expected):
            time_move(stated(**changes))
    for number in ("samples", "pieces"):
        with pytest.raises(InvalidProblem, match=f"{number}: 1 is fewer than 2"):
            time_move(stated(), **{number: 1})
    with pytest.raises(InvalidProblem, match="has no nonlinear program"):
        FREE.nlp()
    for key in ("start_acceleration", "goal_acceleration"):  # a path that is timed keeps none
        with pytest.raises(InvalidProblem, match=rf"{key}: .* needs motion = 'time-spline'"):
            move(Move(ARM, HOME, (AWAY,), **{key: (0.1, 0.0)}))

"""Where a simulation starts, what it visits, what the planner is shown and when, what is executed."""

from __future__ import annotations

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
import pytest
from helpers.quintic_planner import QuinticPlanner
from helpers.simulations import EVERY, MOVE, content, setting, simulated
from helpers.space_scenarios import space_scenario
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import Trajectory
from problems.scene import Obstacle
from problems.tasks import Place
from solvers.budget import Interruption
from tpbso_casadi import ScenarioError, parse_scenario
from tpbso_casadi.replanning import Step
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.simulation import Simulation, SimulationSetting, stands
from tpbso_casadi.simulation.record import joined, jumps_between, part, rest_time

CART = {"shape": "box", "center": [3.0, 0.0], "size": [0.4, 0.2], "velocity": [0.0, 0.5]}


def test_a_motion_starts_one_period_after_the_planner_looked() -> None:
    record = simulated()
    before = record.executed.at(np.linspace(0.0, EVERY, 20))
    assert not before.any()
    assert record.executed.at(np.array([EVERY + 0.1]))[0, 0] > 0.01


def test_goals_are_visited_in_turn_each_from_the_time_of_rest() -> None:
    record = simulated()
    # moves of MOVE seconds, the first of which begins after a period; the next goal is known when one is nearly reached
    assert [visit.goal for visit in record.visits] == [0, 1, 0, 1, 0]
    assert [visit.time for visit in record.visits] == pytest.approx([0.75, 1.25, 1.75, 2.25, 2.75])
    times = np.array([visit.time for visit in record.visits])
    assert record.executed.at(times)[:, 0] == pytest.approx([1.5, 0.0, 1.5, 0.0, 1.5], abs=1e-9)
    assert record.executed.at(times, 1) == pytest.approx(np.zeros((5, 2)), abs=1e-9)


def test_the_executed_motion_is_smooth_and_as_long_as_said() -> None:
    record = simulated()
    assert record.duration == pytest.approx(3.0)
    assert len(record.replans) == 12
    assert record.executed.followed_by(record.following).largest_jump() < 1e-9
    assert record.largest_jumps.max() < 1e-9


def test_the_planner_sees_the_scene_of_the_moment_and_its_own_motion() -> None:
    made = setting(obstacles=[CART])
    planner = QuinticPlanner(made.scenario, MOVE)
    Simulation(made, planner).run(Interruption())
    places = [seen.place for [seen] in planner.seen]
    assert np.array(places) == pytest.approx(np.column_stack([np.full(12, 3.0), 0.5 * EVERY * np.arange(12)]))
    first, second = made.goals
    assert planner.goals[:4] == [first, first, second, second]


def test_a_goal_that_is_the_start_is_reached_at_once_and_once() -> None:
    record = simulated(simulation={"goals": [{"joints": [0.0, 0.0]}]})
    assert [(visit.goal, visit.time) for visit in record.visits] == [(0, 0.0)]
    assert not record.executed.at(np.linspace(0.0, 3.0, 50)).any()


class Jumping(QuinticPlanner):
    """Joins its motions with a jump of the first joint."""

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        step = super().replan(executed, obstacles, goal)
        late = step.trajectory.breakpoints[:-1] >= self.every - 1e-12
        step.trajectory.coefficients[-1, late, 0] += 1e-6
        return step


def test_a_jump_is_noticed() -> None:
    made = setting()
    record = Simulation(made, Jumping(made.scenario, MOVE)).run(Interruption())
    assert record.largest_jumps[0] == pytest.approx(1e-6)
    assert record.replans[0].jumps[0] == pytest.approx(1e-6)


class Interrupting(QuinticPlanner):
    """Asks for an end while it is asked."""

    def __init__(self, scenario: Scenario, interruption: Interruption, after: int) -> None:
        super().__init__(scenario, MOVE)
        self.interruption, self.after = interruption, after

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        if len(self.seen) == self.after:
            self.interruption.requested = True
        return super().replan(executed, obstacles, goal)


def test_after_an_interruption_there_is_what_was_simulated_before() -> None:
    made, interruption = setting(), Interruption()
    record = Simulation(made, Interrupting(made.scenario, interruption, 5)).run(interruption)
    whole = simulated()
    assert record.interrupted
    assert len(record.replans) == 5
    assert record.duration == pytest.approx(5 * EVERY)
    times = np.linspace(0.0, 5 * EVERY, 50)
    assert record.executed.at(times) == pytest.approx(whole.executed.at(times), abs=1e-12)
    interruption = Interruption()
    with pytest.raises(KeyboardInterrupt):  # before the first answer
        Simulation(made, Interrupting(made.scenario, interruption, 0)).run(interruption)


def test_goal_and_start_are_visited_where_no_goals_are_stated() -> None:
    made = setting()
    assert made.start.values == (0.0, 0.0)
    assert [goal.values for goal in made.goals] == [(1.5, 0.0), (0.0, 0.0)]


def test_goals_are_visited_as_stated_and_in_degrees() -> None:
    stated = content(simulation={"goals": [{"joints": [90.0, 0.0]}, {"joints": [45.0, -90.0]}]})
    stated["task"] |= {"goal": {"joints": [30.0, 0.0]}}
    made = SimulationSetting.of(parse_scenario({"unit": "deg"} | stated))
    assert made.goals[0].values == pytest.approx((pi / 2, 0.0))
    assert made.goals[1].values == pytest.approx((pi / 4, -pi / 2))


def test_points_become_the_nearest_postures_there() -> None:
    made = setting(task={"start": {"joints": [0.0, 0.5]}}, simulation={"goals": [[1.0, 1.0]]})
    [goal] = made.goals
    q = np.array(goal.values)
    tip = np.array([np.cos(q[0]) + np.cos(q.sum()), np.sin(q[0]) + np.sin(q.sum())])
    assert tip == pytest.approx([1.0, 1.0])
    assert q == pytest.approx([0.0, pi / 2])  # the other elbow is at [pi / 2, -pi / 2]


def test_a_posture_that_is_blocked_is_not_taken() -> None:
    blocked = {"shape": "box", "center": [1.0, 0.5], "size": [0.2, 0.2]}
    made = setting(task={"start": {"joints": [0.0, -0.5]}}, obstacles=[blocked], simulation={"goals": [[1.0, 1.0]]})
    assert made.goals[0].values == pytest.approx((pi / 2, -pi / 2))


def test_redundant_links_are_turned_until_they_are_clear_and_poses_become_postures() -> None:
    stated = content(obstacles=[{"shape": "box", "center": [1.7, 0.6], "size": [0.8, 0.2]}])
    stated["arm"] |= {"link_lengths": [0.7, 0.7, 0.7]}
    stated["task"] |= {"start": {"joints": [-0.5, 0.0, 0.0]}, "goal": {"joints": [1.5, 0.0, 0.0]}}
    stated["simulation"] |= {"goals": [[1.7, 0.75]]}
    [goal] = SimulationSetting.of(parse_scenario(stated)).goals
    psi = np.cumsum(goal.values)
    assert 0.7 * np.array([np.cos(psi).sum(), np.sin(psi).sum()]) == pytest.approx([1.7, 0.75])
    goals = {"goals": [{"position": [0.3, 0.45, 0.6]}, {"joints": [-0.5, 0.8, 0.6]}]}
    made = SimulationSetting.of(parse_scenario(space_scenario() | {"simulation": goals}))
    assert made.goals[0].position(made.robot) == pytest.approx([0.3, 0.45, 0.6])


def test_the_scenario_of_a_simulation_is_complete() -> None:
    made = setting(task={"goal": [1.0, 1.0]})
    again = SimulationSetting.of(parse_scenario(made.scenario.table()))
    assert again.scenario == made.scenario
    assert again.goals == made.goals


PATH = {"kind": "path", "accuracy": 0.05, "points": [[1.0, 1.0], [1.0, 0.5]]}


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        (content(task={"via": [[1.0, 1.0]]}), "task.via: is for a move from rest to rest"),
        (content(task={"start_velocity": [0.1, 0.0]}), "task.start_velocity: is for a move from rest to rest"),
        (content(task={"start_acceleration": [0.1, 0.0]}), "task.start_acceleration: "),
        (content(task={"goal": [[1.0, 1.0], [0.5, 1.0]]}), "task.goal: is a list; state in simulation.goals"),
        (content(task={"goal": [1.0, 9.0]}), "task.goal: (1.0, 9.0) is 9.05539 m from the base"),
        (content() | {"task": PATH}, "task.kind: 'path' is no move from one place to another"),
    ],
)
def test_other_tasks_are_refused(stated: dict[str, Any], message: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        SimulationSetting.of(parse_scenario(stated))
    assert str(caught.value).startswith(message)


def test_without_a_table_a_scenario_has_none() -> None:
    stated = content()
    del stated["simulation"]
    scenario = parse_scenario(stated)
    assert "simulation" not in scenario.table()
    assert SimulationSetting.of(scenario).settings.ticks == 100


@pytest.mark.parametrize(("seconds", "every", "ticks"), [(1.0, 0.1, 10), (0.3, 0.1, 3), (1.0, 0.3, 3), (0.1, 0.1, 1)])
def test_whole_periods_are_simulated(seconds: float, every: float, ticks: int) -> None:
    assert setting(simulation={"seconds": seconds, "every": every}).settings.ticks == ticks


BREAKS = np.array([0.0, 0.5, 0.75, 2.0])


def motion(seed: int = 1, order: int = 6) -> Trajectory:
    """Polynomials that have nothing to do with each other: they jump at the breakpoints."""
    return Trajectory(BREAKS, np.random.default_rng(seed).normal(size=(order, 3, 2)))


@settings(max_examples=40, deadline=None)
@given(first=st.floats(0.0, 2.5), length=st.floats(0.01, 2.0), seed=st.integers(0, 50))
def test_a_part_is_the_same_motion_later_and_stands_at_its_end(first: float, length: float, seed: int) -> None:
    whole = motion(seed)
    cut = part(whole, first, first + length)
    assert cut.duration == pytest.approx(length)
    times = np.linspace(0.0, length, 41)[1:-1]
    times = times[np.abs((first + times)[:, None] - BREAKS).min(axis=1) > 1e-9]
    before = first + times < whole.duration
    for order in range(4):
        expected = whole.at(first + times[before], order)
        assert cut.at(times[before], order) == pytest.approx(expected, rel=1e-9, abs=1e-9)
        still = cut.at(times[~before], order)
        end = whole.at(np.array([2.0]))[0] if order == 0 else np.zeros(2)
        assert still == pytest.approx(np.tile(end, (len(still), 1)))


def test_parts_make_up_the_whole() -> None:
    whole = motion()
    again = joined([part(whole, first, last) for first, last in ((0.0, 0.2), (0.2, 0.75), (0.75, 2.0))])
    assert again.breakpoints == pytest.approx([0.0, 0.2, 0.5, 0.75, 2.0])
    times = np.linspace(0.01, 1.99, 200)
    assert again.at(times, 2) == pytest.approx(whole.at(times, 2))
    both = joined([Trajectory.standing(np.array([1.0, 2.0]), 0.5), whole])  # of different orders
    assert both.at(np.array([0.2]))[0] == pytest.approx([1.0, 2.0])
    assert both.at(np.array([0.7]))[0] == pytest.approx(whole.at(np.array([0.2]))[0])
    # a breakpoint that is meant makes no tiny piece
    assert part(whole, 0.5 - 1e-13, 2.0).breakpoints == pytest.approx([0.0, 0.25, 1.5], abs=1e-12)
    assert part(whole, 0.0, 0.5 + 1e-13).breakpoints.size == 2


def test_jumps_are_those_of_angle_speed_and_acceleration() -> None:
    before = Trajectory(np.array([0.0, 1.0]), np.array([[[1.0, 0.0]], [[0.0, 2.0]], [[0.0, 0.0]]]))  # t^2 and 2 t
    after = Trajectory(np.array([0.0, 1.0, 2.0]), np.zeros((3, 2, 2)))
    after.coefficients[:, 1] = [[1.5, 0.0], [2.0, 1.75], [1.125, 2.0]]  # from t = 1 on
    assert jumps_between(before, after, 1.0) == pytest.approx((0.125, 0.25, 1.0))


def test_when_a_motion_has_come_to_rest() -> None:
    moving = Trajectory(np.array([0.0, 1.0]), np.ones((2, 1, 2)))
    still = Trajectory.standing(np.zeros(2), 0.5)
    assert stands(joined([still, moving, still])).tolist() == [True, False, True]
    assert rest_time(joined([still, moving, still, still])) == 1.5
    assert rest_time(joined([still, still])) == 0.0
    assert rest_time(moving) == 1.0

"""The loop: what the planner is shown and when, what is executed, which goals are reached."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from problems import Trajectory
from problems.scene import Obstacle
from problems.tasks import Place
from solvers.budget import Interruption
from tests.helpers.quintic_planner import QuinticPlanner
from tests.helpers.simulations import EVERY, MOVE, setting, simulated
from tpbso_casadi.replanning import Step
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.simulation import Simulation

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


def test_an_interruption_before_the_first_answer_leaves_nothing() -> None:
    made, interruption = setting(), Interruption()
    with pytest.raises(KeyboardInterrupt):
        Simulation(made, Interrupting(made.scenario, interruption, 0)).run(interruption)

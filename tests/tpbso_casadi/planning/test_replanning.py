"""Steps of planning while an arm moves: what goes on, what replaces it, when it stops; what users may say."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.replanning import AXES, EVERY, GOAL, START, Erratic, Simulation, crossing, scenario
from helpers.slow import slow_except

from problems import CertificateStatus, Ellipse, InvalidProblem, Joints, Trajectory
from problems.certify import ClearanceProof, prove_clearance
from problems.limits import proximity_limits
from problems.timing.from_motion import MotionState, fastest_move
from tpbso_casadi import replan
from tpbso_casadi.planning import EarlierMotion, PlannedMotion, plan
from tpbso_casadi.planning.plan import candidates_of
from tpbso_casadi.replanning import Replanner, Step
from tpbso_casadi.replanning.candidates import remaining
from tpbso_casadi.replanning.proofs import KeptClear
from tpbso_casadi.scenario import Scenario, ScenarioError, parse_scenario

FAR = crossing((3.0, 3.0))
IN_THE_WAY = crossing((1.55, 0.75))
AT_REST = MotionState.at_rest(np.array(START))
STANDING = Trajectory.standing(np.array(START), EVERY)
CONTENT = scenario().table()


def replanner(rate: float = 0.0, evaluations: int = 400, within: float | None = None) -> Replanner:
    """Of the planar arm."""
    return Replanner(scenario(), EVERY, rate, evaluations, within)


def on(step: Step, seconds: float = EVERY) -> Trajectory:
    """What is left of a step's motion so many seconds later."""
    return remaining(step.trajectory, seconds, EVERY)


def assert_continues(step: Step, executed: Trajectory) -> None:
    """It begins as what is executed goes on, leaves that smoothly, and ends at rest."""
    until_then = np.linspace(0.0, min(EVERY, executed.duration), 11)
    for order in range(3):
        assert step.trajectory.at(until_then, order) == pytest.approx(executed.at(until_then, order), abs=1e-9)
        assert not step.trajectory.jumps_inside(order)
        before, after = step.trajectory._sides(order)
        assert np.abs(after[1:] - before[:-1]).max(initial=0.0) < 1e-9
    for order in (1, 2):
        assert step.trajectory.value_at_end(order) == pytest.approx(0.0, abs=1e-9)


def test_from_rest_it_takes_the_least_time_and_what_it_does_then_goes_on() -> None:
    planner = replanner()
    step = planner.first(obstacles=[])
    least = fastest_move(AT_REST, MotionState.at_rest(np.array(GOAL)), planner.robot.limits).duration
    assert (step.kind, step.certified, step.fail_safe, step.closest, step.x) == ("new", True, True, None, None)
    assert step.trajectory.duration == pytest.approx(EVERY + least)
    assert step.trajectory.value_at_end() == pytest.approx(GOAL, abs=1e-9)
    assert_continues(step, STANDING)
    for _ in range(3):
        executed = on(step)
        step = planner.replan(executed, [])
        assert (step.kind, step.certified, step.fail_safe) == ("old", True, True)
        assert step.trajectory == executed


def test_at_the_goal_it_stays() -> None:
    step = replanner().replan(Trajectory.standing(np.array(GOAL), 1.0), [FAR])
    assert (step.kind, step.certified, step.fail_safe) == ("old", True, True)
    assert not step.trajectory.moves


def test_another_goal_is_gone_to() -> None:
    planner = replanner()
    executed = on(planner.first(obstacles=[]), 0.4)
    step = planner.replan(executed, [], Joints((0.0, 0.5, 0.5)))
    assert (step.kind, step.certified) == ("new", True)
    assert step.trajectory.value_at_end() == pytest.approx([0.0, 0.5, 0.5], abs=1e-9)
    assert_continues(step, executed)


@pytest.mark.slow
def test_a_way_round_is_searched_for_where_the_direct_one_is_closed_and_a_seed_decides_which() -> None:
    step, again = (replanner().replan(STANDING, [IN_THE_WAY]) for _ in range(2))
    assert (step.kind, step.certified, step.fail_safe) == ("new", True, True)
    assert step.closest is not None
    assert step.closest.distance > 0.0
    assert step.closest.pair.endswith("obstacle 1")
    assert_continues(step, STANDING)
    assert step.x is not None and again.x is not None
    assert step.x.tolist() == again.x.tolist()


def test_where_nothing_is_found_it_stops() -> None:
    """Something stands between the arm and its goal all of a sudden, and there is no time for a search."""
    planner = replanner(within=0.0)
    executed = on(planner.first(obstacles=[]), 0.2)
    step = planner.replan(executed, [IN_THE_WAY])
    assert (step.kind, step.certified, step.fail_safe, step.x) == ("stop", True, True, None)
    assert_continues(step, executed)
    again = planner.replan(on(step), [IN_THE_WAY])
    assert (again.kind, again.certified) == ("stop", True)
    assert again.trajectory.value_at_end() == pytest.approx(step.trajectory.value_at_end(), abs=1e-9)
    freed = planner.replan(on(again), [])
    assert (freed.kind, freed.certified) == ("new", True)


def test_what_cannot_be_avoided_is_said() -> None:
    planner = replanner(evaluations=100)
    executed = on(planner.first(obstacles=[]), 0.4)
    hand = planner.robot.skeleton(executed.at(np.array([0.05])))[0, -1]
    step = planner.replan(executed, [crossing((float(hand[0]), float(hand[1])))])
    assert (step.kind, step.certified, step.fail_safe) == ("stop", False, False)
    assert step.closest is not None
    assert step.closest.distance < 0.0


def test_a_motion_that_breaks_a_limit_or_jumps_is_not_certified() -> None:
    planner, goal = replanner(evaluations=100), np.array(GOAL)
    fast = planner.first(obstacles=[]).trajectory.part(EVERY, 0.9).time_scaled(0.5)
    jumping = Trajectory(np.array([0.0, 0.05, 0.1]), np.array([[goal - 0.1, goal]]))
    assert not any(planner.replan(executed, [FAR]).certified for executed in (fast, jumping))


def test_the_margin_of_a_prediction_counts() -> None:
    """Clear where the prediction holds; where it may be left at 2 m/s the arm could not stop in time."""
    executed = on(replanner().first(obstacles=[]), 0.3)
    place = crossing((-0.2, 0.8))
    certain, uncertain = (replanner(rate, within=0.0).replan(executed, [place]) for rate in (0.0, 2.0))
    assert (certain.kind, certain.fail_safe) == ("old", True)
    assert (uncertain.kind, uncertain.certified) == ("stop", True)


@pytest.mark.parametrize(("seed", "within"), slow_except([(38, 0.0), (33, 0.0), (6, None)], 1))
def test_while_it_moves_nothing_touches_it(seed: int, within: float | None) -> None:
    """Whatever course an obstacle takes, as long as it changes its velocity by no more than has been said."""
    planner = Replanner(scenario(), EVERY, fail_safe_rate=0.8, evaluations=150, within=within)
    simulation = Simulation().run(planner, Erratic(np.random.default_rng(seed), 0.4), 12)
    assert len(simulation.moved) > 50
    assert simulation.touched == []
    assert all(step.certified and step.fail_safe for step in simulation.steps)


def test_without_the_rule_it_is_touched() -> None:
    """By the same obstacle, if predictions are taken for the truth."""
    planner = Replanner(scenario(), EVERY, fail_safe_rate=0.0, within=0.0)
    simulation = Simulation().run(planner, Erratic(np.random.default_rng(38), 0.4), 12)
    assert simulation.touched
    assert not all(step.certified for step in simulation.steps)


def test_what_is_known_is_not_proven_again(monkeypatch: pytest.MonkeyPatch) -> None:
    rate = 0.05
    planner = replanner(rate)
    obstacle = crossing((2.4, 1.6), (-0.3, 0.0))
    standing = Ellipse((-1.0, -1.0), (0.2, 0.2))
    step = planner.first(obstacles=[obstacle, standing])
    proofs: list[int] = []

    def counted(kept: KeptClear, trajectory: Trajectory) -> ClearanceProof | None:
        if any(each.moves and each.growth_rate < rate for each in kept.obstacles.values()):
            proofs.append(1)
        return prove(kept, trajectory)

    prove = KeptClear.proof
    monkeypatch.setattr(KeptClear, "proof", counted)
    executed = on(step)
    as_predicted = planner.replan(executed, [obstacle.later(EVERY), standing])
    assert as_predicted.kind == "old"
    assert not proofs
    other = replace(obstacle.later(2 * EVERY), margin_rate=0.01)
    assert planner.replan(on(as_predicted), [other, standing]).kind == "old"
    assert proofs


def test_it_stands_no_longer_than_has_been_proven() -> None:
    """What comes after the end of a motion that is shorter than a step is looked at."""
    planner, goal = replanner(), np.array(GOAL)
    x, y = planner.robot.skeleton(goal[None])[0, -1].tolist()
    falling = crossing((x, y + AXES[1] + 0.22), (0.0, -1.0))  # it is there after 0.22 s
    first = planner.replan(Trajectory.standing(goal, 0.2), [falling])
    assert (first.kind, first.certified) == ("old", True)
    then = planner.replan(Trajectory.standing(goal, 0.05), [falling.later(0.15)])
    assert not then.certified


@pytest.mark.parametrize("every", [0.1, 0.05])
def test_a_motion_that_does_not_end_at_rest_does_not_go_on(every: float) -> None:
    turn = np.array([0.1, 0.0, 0.0])
    executed = Trajectory(np.array([0.0, 0.1]), np.array([[turn / 0.1], [np.array(GOAL) - turn]]))
    step = Replanner(scenario(), every, evaluations=50).replan(executed, [FAR])
    assert step.kind != "old"
    assert step.trajectory.value_at_end(1) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("seconds", [0.0, EVERY, 0.3])
def test_a_stop_is_fail_safe_where_that_is_proven(seconds: float) -> None:
    """Not where another stop has been proven, nor among other obstacles than those that are there now."""
    rate, stops = 0.5, 0
    planner = replanner(rate, within=0.0)
    for y in np.linspace(0.6, 1.4, 9):
        step = planner.first(obstacles=[FAR])
        for _ in range(2):
            step = planner.replan(on(step), [FAR])
        obstacle = crossing((1.75, float(y)))
        step = planner.replan(on(step, seconds), [obstacle])
        if step.kind == "stop" and step.fail_safe and step.trajectory.moves:
            (limit,) = proximity_limits(planner.robot, [obstacle.less_certain(rate)])
            proof = prove_clearance(limit, step.trajectory)
            assert proof is not None
            assert proof.status is CertificateStatus.CERTIFIED
            stops += 1
    assert stops or seconds > EVERY  # later than a step, the stop that was proven has not begun


def test_small_changes_of_course_add_up() -> None:
    """A stop that goes on is fail-safe by what is seen now or by what proved it, never by a chain of both."""
    rate, older = 0.4, 0
    planner = replanner(rate, within=0.0)
    for x, y in ((2.0, 0.6), (2.2, 0.2), (2.2, 0.6)):
        place, velocity = np.array([x, y]), np.zeros(2)
        seen = [crossing((x, y))]
        step = planner.first(obstacles=seen)
        for change in (0.0, *(0.9 * rate,) * 4):
            place, velocity = place + EVERY * velocity, velocity - np.array([change, 0.0])
            seen.append(crossing((float(place[0]), float(place[1])), (float(velocity[0]), 0.0)))
            step = planner.replan(on(step), seen[-1:])
            if not step.fail_safe or not step.trajectory.moves:
                continue
            assert step.proof_age is not None
            first = seen[-1 - round(step.proof_age / EVERY)]
            assert np.linalg.norm(np.subtract(seen[-1].motion.velocity, first.motion.velocity)) <= rate
            if step.kind == "stop":
                (limit,) = proximity_limits(planner.robot, [first.less_certain(rate).later(step.proof_age)])
                proof = prove_clearance(limit, step.trajectory)
                assert proof is not None and proof.status is CertificateStatus.CERTIFIED
                older += step.proof_age > 0.0
    assert older


def small_plan(evaluations: int, warm_start: PlannedMotion | None = None) -> PlannedMotion:
    """A short search along a spline over time."""
    tables = {"model": {"motion": "time-spline"}, "solver": {"name": "lshade", "evaluations": evaluations}}
    return plan(parse_scenario(CONTENT | tables), warm_start=warm_start)


@pytest.fixture(scope="module")
def planned() -> PlannedMotion:
    return small_plan(evaluations=1000)


def test_a_plan_goes_on_where_nothing_has_changed_for_the_worse(planned: PlannedMotion) -> None:
    step = replan(planned, 0.3, [FAR])
    assert step.certified
    assert step.trajectory.value_at_end() == pytest.approx(GOAL, abs=1e-8)
    assert step.trajectory.at(np.zeros(1))[0] == pytest.approx(planned.trajectory.at(np.array([0.3]))[0])
    again = replan(step, 0.1, [FAR])
    assert (again.kind, again.certified) == ("old", True)
    assert again.trajectory.duration == pytest.approx(step.trajectory.duration - 0.1)


def test_a_scenario_states_the_scene_and_the_goal_anew(planned: PlannedMotion) -> None:
    other = scenario(goal=[0.9, 0.4, 0.2])
    step = replan(planned.trajectory, 0.3, other, every=0.05)
    assert (step.kind, step.certified) == ("new", True)
    assert step.trajectory.value_at_end() == pytest.approx([0.9, 0.4, 0.2], abs=1e-9)


def test_it_goes_on_from_a_plan_and_stands_at_its_end(planned: PlannedMotion) -> None:
    step = Replanner(scenario()).first(planned.trajectory, [FAR])
    assert step.certified
    assert step.trajectory.at(np.zeros(1))[0] == pytest.approx(START)
    step = replan(planned, planned.trajectory.duration, [FAR])
    assert (step.kind, step.certified, step.trajectory.moves) == ("old", True, False)
    assert np.abs(step.trajectory.at(np.linspace(0.0, 0.1, 5), 1)).max() < 1e-9


def test_a_search_begins_with_the_plan_before(planned: PlannedMotion) -> None:
    """So few evaluations find nothing as good by themselves; and what a plan begins with is all that it depends on."""
    cold, warm, again = (small_plan(evaluations=30, warm_start=first) for first in (None, planned, planned))
    assert warm.search.cost <= planned.search.cost < cold.search.cost
    assert warm.search.x.tolist() == again.search.x.tolist()


def test_a_motion_is_fitted_where_the_search_had_other_variables(planned: PlannedMotion) -> None:
    other = plan(parse_scenario(CONTENT | {"solver": {"name": "lshade", "evaluations": 300}}))
    known = candidates_of(planned.problem, other)
    assert known is not None
    assert known.shape == (1, len(planned.problem.variables))
    fitted = planned.problem.trajectory(known[0])
    times = np.linspace(0.0, 1.0, 11)
    apart = fitted.at(times * fitted.duration) - other.trajectory.at(times * other.trajectory.duration)
    assert np.abs(apart).max() < 0.1
    from_motion = candidates_of(planned.problem, EarlierMotion.of(planned))
    assert from_motion is not None
    assert len(from_motion) == 1
    both = candidates_of(planned.problem, planned)
    assert both is not None
    assert len(both) == 2


def fits(**changes: Any) -> Scenario:
    return parse_scenario(CONTENT | {name: CONTENT.get(name, {}) | table for name, table in changes.items()})


def still(*joints: float) -> Trajectory:
    return Trajectory.standing(np.array(joints), 1.0)


LONGER, POINTS = {"link_lengths": [0.8, 0.7, 0.6]}, {"start": [1.0, -0.5], "goal": [0.5, 1.2]}
ENDS = {"start": {"joints": [0.0, 0.5]}, "goal": {"joints": [1.0, 0.5]}}
OF_TWO = fits(arm={"link_lengths": [1.0, 1.0]}, task=ENDS)
SECTION: Any = parse_scenario(CONTENT | {"obstacles": [{"center": [2.6, 1.9], "semi_axes": [0.1, 0.1]}]}).obstacles[0]
MISTAKES: list[tuple[Callable[[PlannedMotion], object], str]] = [
    (lambda plan: Replanner(scenario(), every=0.0), "every: 0 is not within"),
    (lambda plan: Replanner(scenario(), every=float("nan")), "every: nan is not within"),
    (lambda plan: Replanner(scenario(), fail_safe_rate=-0.1), "fail_safe_rate: -0.1 is not within"),
    (lambda plan: Replanner(scenario(), evaluations=0), "evaluations: 0 is fewer than 1"),
    (lambda plan: Replanner(scenario(), seed=-1), "seed: -1 is fewer than 0"),
    (lambda plan: Replanner(scenario(), within=-1.0), "within: -1 is not within"),
    (lambda plan: Replanner(fits(task={"via": [{"joints": [0.0, 0.2, 0.2]}]})), "task: only a move to a goal at rest"),
    (lambda plan: Replanner(fits(task=POINTS)).first(), "task.start: joints at rest are needed"),
    (lambda plan: replanner().first(obstacles=[FAR, SECTION]), "obstacles: obstacle 2: ShapeSection is not an Obs"),
    (lambda plan: replanner().replan(still(0.0, 0.0), []), "executed: a motion of 2 joints for a robot of 3"),
    (lambda plan: replanner().replan(still(0.0, np.nan, 0.0), []), "executed: it is no motion"),
    (lambda plan: replanner().replan(STANDING, [], Joints((0.0, 0.0))), "goal: 2 joints for a robot of 3"),
    *(
        (lambda plan, time=time: replan(plan, time, []), "at_time: .* s is not within the motion, 0 to .* s$")
        for time in (-0.1, 100.0, float("nan"))
    ),
    (lambda plan: replan(plan.trajectory, 0.1, []), "scene: for a motion alone a scenario is needed"),
    (lambda plan: replan(plan, 0.1, fits(arm=LONGER)), "arm: not the one of the motion that is executed$"),
    (lambda plan: replan(still(0.0, 0.0), 0.1, scenario()), "executed: a motion of 2 joints for a robot of 3$"),
    (lambda plan: replan(plan, 0.1, [], within=-1.0), "within: -1 is not within"),
    (lambda found: plan(scenario(), warm_start=found), "warm_start: its search had other variables"),
    (lambda found: plan(OF_TWO, warm_start=found), "warm_start: a motion of 3 joints for a robot of 2$"),
]


@pytest.mark.parametrize(("call", "message"), MISTAKES, ids=[message[:30] for _, message in MISTAKES])
def test_mistakes_take_one_line(call: Callable[[PlannedMotion], object], message: str, planned: PlannedMotion) -> None:
    with pytest.raises((InvalidProblem, ScenarioError), match=f"^{message}") as caught:
        call(planned)
    assert "\n" not in str(caught.value)

"""Moves: the path of a search vector, its cost against the model, its exact motion; and what is searched well."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import OVAL, equal_links
from helpers.evaluation import needs_compiler, same_bits
from helpers.moving_scenes import CROSSED
from helpers.own_limits import TipSpeed
from helpers.searching import VM, sampled, source
from helpers.slow import slow_except

from problems import Ellipse, InvalidProblem, Joints, Move, MoveProblem, Position, move
from problems.base import FloatArray, as_array
from problems.evaluation import EvaluationOptions
from problems.limits import Constraint
from problems.timing.free_space import least_durations
from solvers import LSHADE, Budget, SearchBox, minimize

THREE, FOUR, TWO = equal_links(3), equal_links(4), equal_links(2)
RANGED = equal_links(3, joint_limits=((-2.5, 3.0), (-2.0, 2.5), (-1.0, 5.0)))
HOME, AWAY = Joints((0.1, 0.2, 0.3)), Joints((1.0, -1.0, 2.0))
FAST = {"start_velocity": (1.0, 0.0, -1.0), "goal_velocity": (0.0, 2.0, 0.0)}
ALL_KINDS = {
    "start": Joints((0.1, 0.2, 0.3, 0.4)),
    "goals": (Position((0.5, 1.5)), Joints((1.0, -1.0, 2.0, 0.3)), Position((-0.5, 1.0))),
    "vias": (Position((0.9, 0.9)), Joints((0.5,) * 4)),
}


STRETCH = Move(TWO, Joints((0.1, 0.2)), (Joints((1.0, -1.0)),))
MOVES: dict[str, tuple[Move, dict[str, Any]]] = {
    "a limit that slows down": (
        Move(THREE, HOME, (AWAY,)), {"objective": "rotation", "samples": 30, "limits": (TipSpeed,)}
    ),
    "points, obstacle": (Move(THREE, Position((1.0, 0.0)), (Position((0.5, 1.5)),), obstacles=(OVAL,)), {}),
    "joints": (Move(THREE, HOME, (AWAY,)), {"objective": "rotation", "samples": 20}),
    "vias, several goals": (Move(FOUR, **ALL_KINDS, elbow="up"), {"objective": "length", "pieces": 2}),
    "moving ends, joint ranges": (Move(RANGED, HOME, (AWAY,), **FAST), {}),
    "moving start": (replace(STRETCH, start_velocity=(0.0, 2.0)), {"objective": "rotation"}),
    "moving goal": (replace(STRETCH, goal_velocity=(-1.0, 0.0)), {}),
    "moving obstacle": (CROSSED, {"samples": 30}),
    "moving obstacle, moving ends": (replace(CROSSED, start_velocity=(0.5, 0.0), goal_velocity=(0.0, -0.5)), {}),
    "moving obstacle, bounded time": (replace(CROSSED, total_time=(1.0, 6.0)), {"objective": "rotation"}),
    "bounded time": (Move(THREE, HOME, (AWAY,), total_time=(2.0, 3.0)), {"objective": "rotation"}),
    "bounded time, moving ends": (Move(THREE, HOME, (AWAY,), total_time=(0.5, 1.5), **FAST), {}),
}  # fmt: skip


@cache
def problem_of(name: str) -> MoveProblem:
    task, options = MOVES[name]
    return move(task, **options)


def moves(*quick: str) -> pytest.MarkDecorator:
    """All of them; but those that are not named here later."""
    return pytest.mark.parametrize("name", slow_except(MOVES, quick))


def stops_of(problem: MoveProblem, x: FloatArray) -> FloatArray:
    """The postures at the stops, (stops, k)."""
    quantities = problem.quantities(x)
    return np.array([row for name, row in quantities.items() if name.startswith("theta_")])


# Paths


@pytest.mark.parametrize("name", MOVES)
def test_paths_pass_all_stops_exactly(name: str) -> None:
    problem = problem_of(name)
    task = problem.criteria.task
    for x in sampled(problem, 3):
        at_stops = stops_of(problem, x)
        places = [task.start, *task.vias, task.reached_goal(at_stops[-1])]
        for place, theta in zip(places, at_stops, strict=True):
            assert np.abs(as_array(place.miss(task.robot, ca.DM(theta).T))).max() < 1e-12
        path = problem.path(x)
        assert path.at(problem.quantities(x)["u_stops"]) == pytest.approx(at_stops, abs=1e-12)
        for order in range(3):
            inner = path.breakpoints[1:-1]
            before = path.at(np.nextafter(inner, 0.0), order)
            assert before == pytest.approx(path.at(inner, order), abs=1e-9 * max(1.0, np.abs(before).max()))


def test_nothing_off_means_straight_lines() -> None:
    problem = problem_of("joints")
    middle = np.zeros(len(problem.variables))
    u = np.linspace(0.0, 1.0, 9)
    line = np.array(HOME.values) + u[:, None] * (np.array(AWAY.values) - np.array(HOME.values))
    assert problem.path(middle).at(u) == pytest.approx(line, abs=1e-14)


@pytest.mark.parametrize(
    ("changes", "field"),
    [({"objective": "speed"}, "objective"), ({"samples": 1}, "samples"), ({"pieces": 1}, "pieces")],
)
def test_options_that_cannot_be_are_refused(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{field}: "):
        move(Move(THREE, HOME, (AWAY,)), **changes)


def test_small_obstacles_take_more_samples() -> None:
    task = problem_of("points, obstacle").criteria.task
    thin = move(replace(task, obstacles=(Ellipse((0.8, 0.8), (0.15, 0.01)),)))
    assert thin.motion.steps > problem_of("points, obstacle").motion.steps
    (limit,) = thin.encoding.step_limits
    assert limit.width == pytest.approx(0.02)


# Costs

KEPT = {"speed", "acceleration", "jerk", "tip speed"}  # by the timing


def excess(constraint: Constraint, values: FloatArray) -> float:
    lower, upper = constraint.bounds
    return float((np.maximum(0.0, np.maximum(lower - values, values - upper)) / constraint.scales).sum())


def expected_costs(problem: MoveProblem, x: FloatArray) -> FloatArray:
    """From the model of all samples at once; what the timing keeps is left out."""
    model, bound = problem.model, problem.objective_upper_bound
    rows = [c for c in model.constraints if c.name not in KEPT]
    expressions = [model.objective, *(c.expression for c in rows)]
    evaluate = ca.Function("model", [model.x], [ca.densify(ca.SX(part)) for part in expressions], {"cse": True})
    costs = []
    for candidate in x:
        objective, *values = (as_array(part) for part in evaluate.call([ca.DM(candidate)]))
        broken = sum(excess(c, value) for c, value in zip(rows, values, strict=True))
        costs.append(bound + broken if broken > 0.0 else min(float(objective[0, 0]), bound))
    return np.array(costs)


@moves("vias, several goals", "moving obstacle")
def test_steps_over_samples_cost_what_the_model_costs(name: str) -> None:
    problem = problem_of(name)
    evaluate, box = problem.evaluator(VM), SearchBox(*problem.bounds)
    best = minimize(evaluate, box, LSHADE(), Budget(200), 0).x
    x = np.vstack([sampled(problem, 12), [best, box.lower, box.upper, (box.lower + box.upper) / 2.0]])
    costs = evaluate(x)
    assert len(np.unique(costs)) >= 12
    np.testing.assert_allclose(costs, expected_costs(problem, x), rtol=1e-9)


@needs_compiler
@pytest.mark.parametrize("name", slow_except(["moving goal", "points, obstacle", "bounded time"], 1))
@pytest.mark.usefixtures("cache_folder")
def test_backends_agree_to_the_bit(name: str) -> None:
    problem = problem_of(name)
    rng, x = np.random.default_rng(0), sampled(problem, 600)
    x[:100] *= rng.normal(0.0, 3.0, (100, 1))
    places = rng.integers(100, 200, 100), rng.integers(0, x.shape[1], 100)
    x[places] = rng.choice([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e300], 100)
    costs = problem.evaluator(VM).of_any(x)
    assert same_bits(costs, problem.evaluator(EvaluationOptions("native")).of_any(x))
    assert np.isfinite(costs[200:]).all()


def test_a_duration_that_is_too_short_is_made_longer_and_one_too_long_is_penalised() -> None:
    problem = problem_of("bounded time")
    x = sampled(problem, 100)
    durations = np.array([float(problem.parameters_of(row).duration) for row in x[:12]])
    assert durations.min() == 2.0
    assert (problem.cost(x) < problem.objective_upper_bound).all()
    slow = move(replace(problem.criteria.task, total_time=(1e-3, 0.9)))
    costs = slow.cost(x)
    scanned = np.array([float(slow.parameters_of(row).duration) for row in x[:12]])
    assert ((costs[:12] > slow.objective_upper_bound) == (scanned > 0.9 * (1.0 - 1e-3))).all()
    assert (costs > slow.objective_upper_bound).any()


# Motions


@moves("joints", "bounded time, moving ends")
def test_motions_keep_every_limit_for_all_t(name: str) -> None:
    problem = problem_of(name)
    box = SearchBox(*problem.bounds)
    best = minimize(problem.evaluator(VM), box, LSHADE(), Budget(1500), 0)
    assert best.cost < problem.objective_upper_bound
    trajectory = problem.trajectory(best.x)
    scale = max(1.0, problem.criteria.safe_time_scale(trajectory))
    verdicts = problem.criteria.verify(trajectory.time_scaled(scale))
    assert all(verdict.satisfied for verdict in verdicts), [v.name for v in verdicts if not v.satisfied]
    assert trajectory.duration <= float(problem.parameters_of(best.x).duration) * 1.01


def test_ends_that_cannot_be_attained_cost_more_than_any_motion() -> None:
    """From 3.9 rad/s to rest in 0.1 rad takes 76 rad/s^2: the path has to go around, and a short one will not do."""
    task = Move(TWO, Joints((0.0, 0.0)), (Joints((0.1, 0.0)),), start_velocity=(3.9, 0.0))
    problem = move(task)
    names = [variable.name for variable in problem.variables]
    x = np.zeros(len(names))
    x[names.index("time_scale_start")] = 0.3
    assert problem.cost(x[None])[0] > problem.objective_upper_bound
    assert float(problem.parameters_of(x).gap) > 0.0
    assert problem.trajectory(x).duration > 0.0
    best = minimize(problem.evaluator(VM), SearchBox(*problem.bounds), LSHADE(), Budget(1500), 0)
    assert best.cost < problem.objective_upper_bound
    found = problem.trajectory(best.x)
    assert problem.criteria.safe_time_scale(found) == 1.0


def test_a_move_to_where_it_stands() -> None:
    problem = move(Move(TWO, Joints((0.3, 0.2)), (Joints((0.3, 0.2)),)))
    still = np.zeros(len(problem.variables))
    assert 0.0 < problem.cost(still[None])[0] < 1e-3
    trajectory = problem.trajectory(still)
    assert trajectory.duration > 0.0
    assert np.ptp(trajectory.at(trajectory.breakpoints), axis=0).max() < 1e-12


@pytest.mark.slow
def test_in_free_space_the_search_finds_the_least_time_there_is() -> None:
    robot = THREE
    problem = move(Move(robot, HOME, (AWAY,)))
    best = minimize(problem.evaluator(), SearchBox(*problem.bounds), LSHADE(), Budget(5000), 0)
    ways = np.array(AWAY.values) - np.array(HOME.values)
    least = least_durations(ways, robot.limits).max()
    assert problem.trajectory(best.x).duration == pytest.approx(least, rel=0.01)
    assert problem.trajectory(best.x).duration >= least * (1.0 - 1e-9)


def test_milestones_are_the_vias() -> None:
    problem = problem_of("vias, several goals")
    x = sampled(problem, 1)[0]
    trajectory = problem.trajectory(x)
    found = problem.criteria.milestones(trajectory)
    assert [milestone.label for milestone in found] == ["via 1", "via 2"]
    assert all(a.time < b.time for a, b in pairwise(found))
    at_vias = trajectory.at(np.array([milestone.time for milestone in found]))
    assert at_vias == pytest.approx(stops_of(problem, x)[1:-1], abs=1e-6)


def test_the_program_starts_from_a_motion_of_the_search() -> None:
    problem = problem_of("vias, several goals")
    x, program = sampled(problem, 1)[0], problem.nlp()
    start = program.from_search(x)
    lower, upper = program.bounds_near(start)
    assert start.shape == lower.shape == upper.shape
    at_stops = stops_of(problem, x)
    motion = program.trajectory(start)
    times = np.concatenate([[0.0], problem.criteria.task.via_times(motion), [motion.duration]])
    assert motion.at(times) == pytest.approx(at_stops, abs=1e-5)


# What has to be compiled


CLEAR = Joints((2.5, 0.5, 0.5))
GOALS = (Position((0.5, 1.5)), CLEAR)
BY_WAY = Move(THREE, Position((1.0, 0.0)), GOALS, vias=(Position((0.9, 0.5)),), obstacles=(OVAL,))
OTHER_WAY: dict[str, Any] = {
    "start": Position((0.9, -0.1)), "goals": (Position((0.4, 1.4)), HOME), "vias": (Position((0.3, 0.9)),),
    "robot": equal_links(3, max_jerk=(500.0,) * 3), "obstacles": (Ellipse((0.7, 0.8), (0.2, 0.25)),),
}  # fmt: skip
MOVING = Move(THREE, HOME, (AWAY,), total_time=(0.5, 5.0), **FAST)
OTHER_STATE = {"start": Joints((0.0, 0.1, 0.2)), "start_velocity": (0.5, 0.1, -1.0), "total_time": (0.6, 4.0)}


@pytest.mark.parametrize(("task", "changes"), [(BY_WAY, OTHER_WAY), (MOVING, OTHER_STATE)], ids=["by way", "moving"])
def test_another_scene_of_the_same_structure_has_the_same_source(task: Move, changes: dict[str, Any]) -> None:
    """Every number is another one at once: whatever was built in would be seen in the source or in a cost."""
    problem, other = (move(stated, samples=60, pieces=2) for stated in (task, replace(task, **changes)))
    assert source(problem) == source(other)
    x = sampled(other, 20)
    np.testing.assert_allclose(other.evaluator(VM)(x), expected_costs(other, x), rtol=1e-9)


def test_another_structure_has_another_source() -> None:
    by_way = source(move(BY_WAY))
    others: tuple[dict[str, Any], ...] = (
        {"elbow": "up"}, {"goals": (CLEAR,)}, {"vias": ()}, {"obstacles": ()}, {"start_velocity": (1.0, 0.0, 0.0)},
    )  # fmt: skip
    assert by_way not in [source(move(replace(BY_WAY, **changes))) for changes in others]

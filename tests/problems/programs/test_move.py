"""The program of a move: known least times, waypoints, limits for all t, motions in and out."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice
from math import sqrt
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.moving_scenes import WAITING, WAITING_BOUND
from scipy.optimize import lsq_linear

from problems import OBJECTIVES, Ellipse, PlanarArm, Trajectory
from problems.certify import limit_verdicts, verdict
from problems.families.splines import MoveNlp
from problems.limits import limits_of
from problems.programs import optimality
from problems.programs.optimality import least_squares_multipliers
from problems.scene.moving import ConstantVelocity, MovingObstacle
from problems.tasks import Joints, Move, Position
from problems.timing.free_space import least_time_move, rest_to_rest
from solvers import IPOPT, Descent, StopReason

ARM = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3)
SMOOTH = replace(ARM, max_jerk=(200.0,) * 3)
RANGED = replace(ARM, joint_limits=((-1.0, 2.0), (-2.0, 2.0), (-2.0, 2.0)))
HOME = Joints((0.1, 0.2, 0.3))
GOAL = Position((0.5, 1.5))
OVAL = Ellipse((0.8, 0.8), (0.15, 0.25))
TIMES = 20_000


def nlp(task: Move, pieces: int = 8, objective: str = "time") -> MoveNlp:
    """The program; no search vector is ever decoded."""
    limits = limits_of(task.robot, task.obstacles)
    return MoveNlp(task, OBJECTIVES[objective], limits, pieces, lambda x: Trajectory(x, x))


def solved(program: MoveNlp, starts: int = 1, seed: int = 0) -> Trajectory:
    """The best motion of a few descents, each with a larger margin where it is not clear between its samples."""
    descent = Descent(program, IPOPT())
    found = []
    for start in islice(program.starts(np.random.default_rng(seed)), starts):
        x = start
        for margin in (None, 3e-3, 1e-2):
            end = descent(x, margin)
            x, motion = end.x, program.trajectory(end.x)
            if end.stop_reason is StopReason.CONVERGED and all(
                v.satisfied for v in limit_verdicts(program.limits, motion)
            ):
                found.append((end.objective, motion))
                break
    return min(found, key=lambda pair: pair[0])[1]


def joints(k: int, speed: float, acceleration: float, jerk: float | None) -> PlanarArm:
    return PlanarArm((1.0,) * k, (speed,) * k, (acceleration,) * k, max_jerk=None if jerk is None else (jerk,) * k)


@pytest.mark.parametrize(
    ("robot", "way", "duration"),
    [
        (joints(2, 10.0, 8.0, None), 0.1, 2.0 * sqrt(0.1 / 8.0)),  # bang-bang
        (joints(2, 2.0, 8.0, None), 3.0, 3.0 / 2.0 + 2.0 / 8.0),  # at full speed in between
        (joints(2, 10.0, 80.0, 60.0), 0.01, 4.0 * (0.01 / 120.0) ** (1.0 / 3.0)),  # jerk alone
        (joints(2, 2.0, 8.0, 60.0), 3.0, 3.0 / 2.0 + 2.0 / 8.0 + 8.0 / 60.0),
    ],
)
def test_known_durations(robot: PlanarArm, way: float, duration: float) -> None:
    task = Move(robot, Joints((0.0, 0.5)), (Joints((way, 0.5)),))
    assert solved(nlp(task)).duration == pytest.approx(duration, rel=2e-6)


def test_free_ends_are_as_fast_as_the_optimum() -> None:
    velocities = {"start_velocity": (1.0, -2.0, 0.5), "goal_velocity": (-0.5, 1.0, 3.0)}
    start, goal = (0.1, 0.2, 0.3), (0.5, 1.1, -0.6)
    for robot in (ARM, SMOOTH):
        least = least_time_move(*(np.array(part) for part in (start, goal, *velocities.values())), robot.limits)
        motion = solved(nlp(Move(robot, Joints(start), (Joints(goal),), **velocities), pieces=12), starts=2)
        assert 1.0 - 1e-9 <= motion.duration / least.duration <= 1.001


CASES: dict[str, Move] = {
    "points": Move(ARM, Position((1.0, 0.0)), (GOAL,), elbow="up"),
    "via points": Move(ARM, HOME, (GOAL,), vias=(Joints((0.5, 0.5, 0.5)), Position((1.0, 1.0))), elbow="down"),
    "via points, jerk": Move(SMOOTH, HOME, (GOAL,), vias=(Joints((0.5, 0.5, 0.5)), Position((1.0, 1.0)))),
    "goals": Move(SMOOTH, HOME, (Position((-1.0, -0.5)), GOAL, Joints((2.0, 0.5, 0.5)))),
    "moving": Move(ARM, HOME, (GOAL,), start_velocity=(4.0, 1.0, -1.0), goal_velocity=(-1.0, 0.5, 0.0)),
    "moving, jerk": Move(SMOOTH, HOME, (GOAL,), start_velocity=(4.0, 1.0, -1.0), goal_velocity=(-1.0, 0.5, 0.0)),
    "ranges": Move(RANGED, Joints((-1.0, 0.0, 0.0)), (Joints((2.0, 2.0, 0.0)),), vias=(Position((1.4, 0.9)),)),
    "long": Move(ARM, HOME, (GOAL,), total_time=(1.5, 2.0)),
}


SLOW = {"points", "via points", "moving"}  # much like the others
each_task = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in CASES]
)


@cache
def planned(name: str) -> tuple[MoveNlp, Trajectory]:
    """The program of a case and the motion that a descent finds."""
    program = nlp(CASES[name], 5 if CASES[name].vias else 8)
    return program, solved(program)


def kept(task: Move, motion: Trajectory) -> None:
    """Limits, by plain NumPy, and everything else by the certificates."""
    times, limits = np.linspace(0.0, motion.duration, TIMES), task.robot.limits
    for order, bound in ((1, limits.speed), (2, limits.acceleration), (3, limits.jerk)):
        if bound is not None:
            assert (np.abs(motion.at(times, order)) <= np.array(bound) * (1.0 + 1e-9)).all()
    if limits.position is not None:
        lowest, highest = np.array(limits.position).T
        theta = motion.at(times)
        assert (theta >= lowest - 1e-9).all()
        assert (theta <= highest + 1e-9).all()
    assert all(each.satisfied for each in limit_verdicts(limits_of(task.robot, task.obstacles), motion))
    assert all(verdict(constraint, at).satisfied for constraint, at in task.conditions(motion))
    assert motion.largest_jump(task.end_velocities, 2 if limits.jerk is None else 3) < 1e-9
    if task.total_time is not None:
        assert task.total_time[0] <= motion.duration <= task.total_time[1]


@each_task
def test_everything_is_kept(name: str) -> None:
    kept(CASES[name], planned(name)[1])


def links_clear(motion: Trajectory, arm: PlanarArm, oval: Ellipse) -> bool:
    """Whether no point of many on each link is in an upright ellipse, at many times."""
    theta = np.cumsum(motion.at(np.linspace(0.0, motion.duration, 2000)), axis=1)
    ends = np.cumsum(np.array(arm.link_lengths)[:, None] * np.stack([np.cos(theta), np.sin(theta)], axis=2), axis=1)
    begins = np.concatenate([np.zeros_like(ends[:, :1]), ends[:, :-1]], axis=1)
    shares = np.linspace(0.0, 1.0, 60)[:, None, None, None]
    points = (begins + shares * (ends - begins) - oval.center) / oval.semi_axes
    return bool((np.square(points).sum(axis=-1) > 1.0).all())


@pytest.mark.parametrize(
    ("robot", "objective"),
    [
        (ARM, "time"),
        *(
            pytest.param(robot, name, marks=pytest.mark.slow)
            for robot, name in ((SMOOTH, "time"), (SMOOTH, "length"), (ARM, "rotation"))
        ),
    ],
)
def test_around_an_obstacle(robot: PlanarArm, objective: str) -> None:
    task = Move(robot, Position((1.0, 0.0)), (GOAL,), elbow="up", obstacles=(OVAL,))
    motion = solved(nlp(task, 12, objective), starts=2)
    assert links_clear(motion, robot, OVAL)
    kept(task, motion)


@pytest.mark.slow
def test_it_waits_for_an_obstacle_that_moves_away() -> None:
    """Random starts differ in how slowly they are run; those that are clear at their times are descended from."""
    program = nlp(WAITING, 12)
    durations = [sum(x[program.variables.slices[-1]]) for x in islice(program.starts(np.random.default_rng(0)), 4)]
    assert max(durations) > 1.2 * min(durations)
    motion = solved(program)
    kept(WAITING, motion)
    assert WAITING_BOUND <= motion.duration <= 1.05 * WAITING_BOUND


def test_shapes_alone_are_as_short_as_they_can_be() -> None:
    straight = solved(nlp(Move(ARM, Position((1.0, 0.0)), (GOAL,), elbow="up"), 8, "length"))
    length = OBJECTIVES["length"].of_motion(straight, ARM, straight.times(100))
    assert length == pytest.approx(np.hypot(0.5, 1.5), rel=1e-3)


@each_task
def test_a_motion_of_the_same_form_comes_back(name: str) -> None:
    program, motion = planned(name)
    x = program.from_trajectory(motion)
    lower, upper = program.row_bounds()
    g = np.asarray(ca.Function("g", [program.x], [program.g])(x)).ravel()
    assert np.maximum(lower - g, g - upper).max() < 1e-5
    again = program.trajectory(x)
    shares = np.linspace(0.0, 1.0, 200)
    assert again.duration == pytest.approx(motion.duration, rel=1e-5)
    assert again.at(shares * again.duration) == pytest.approx(motion.at(shares * motion.duration), abs=1e-5)


@each_task
def test_names_and_bounds_are_of_the_variables_and_the_same_seed_starts_alike(name: str) -> None:
    task = CASES[name]
    program = nlp(task, 3)
    first, second = (list(islice(each.starts(np.random.default_rng(1)), 3)) for each in (program, nlp(task, 3)))
    np.testing.assert_array_equal(first, second)
    for x in first:
        assert len(program.names) == len(set(program.names)) == x.size == program.x.shape[0]
        lower, upper = program.bounds_near(x)
        assert (lower <= upper).all()
        assert np.isfinite(x).all()
    quantities = program.quantities(x)
    assert quantities["t_stops"][[0, -1]] == pytest.approx([0.0, program.trajectory(x).duration])
    assert quantities["t_stops"].size == len(task.vias) + 2 == len(quantities) - 1


def test_a_descent_keeps_to_the_goal_that_its_start_misses_least() -> None:
    goals: tuple[Any, ...] = (Joints((1.0, 1.0, 1.0)), Joints((-0.1, 0.3, 0.3)), GOAL)
    program = nlp(Move(ARM, HOME, goals))
    descent = Descent(program, IPOPT())
    for goal in goals[:2]:
        start = rest_to_rest(np.array(HOME.values), np.array(goal.values), ARM.limits)
        end = program.trajectory(descent(program.from_trajectory(start)).x)
        assert end.at(end.breakpoints[-1:])[0] == pytest.approx(goal.values, abs=1e-9)


@pytest.mark.slow
def test_derivatives_around_obstacles_are_those_of_casadi() -> None:
    obstacle = MovingObstacle(OVAL, ConstantVelocity((-0.3, 0.1)))
    robot = joints(2, 4.0, 20.0, None)
    program = nlp(Move(robot, Joints((0.1, 0.2)), (GOAL,), obstacles=(obstacle,)), 1)
    x = next(program.starts(np.random.default_rng(3)))
    assert program.hessian is not None
    weights = np.random.default_rng(4).normal(size=program.g.shape[0])
    lam = ca.DM(weights)
    plain = ca.triu(ca.hessian(program.f + ca.dot(lam, program.g), program.x)[0])
    expected = ca.Function("plain", [program.x], [plain])(x)
    assert float(ca.norm_inf(program.hessian(x, [], 1.0, lam) - expected)) < 1e-8 * float(ca.norm_inf(expected))


def test_the_fastest_turn_meets_the_conditions_of_an_optimum() -> None:
    robot = joints(2, 2.0, 8.0, 60.0)
    program = nlp(Move(robot, Joints((0.0, 0.5)), (Joints((3.0, 0.5)),)))
    fastest = program.from_trajectory(solved(program))
    slow = program.from_trajectory(solved(program).time_scaled(1.5))
    assert optimality(program, fastest).stationarity < 1e-5
    assert optimality(program, slow).stationarity > 0.1


def test_multipliers_are_those_of_bounded_least_squares() -> None:
    rng, number = np.random.default_rng(0), np.arange(40)
    rows = rng.normal(size=(40, 60)) * (rng.random((40, 60)) < 0.2)
    equal, at_upper = number < 20, number < 30
    bounds = np.where(equal | ~at_upper, -np.inf, 0.0), np.where(at_upper, np.inf, 0.0)
    gradient = rng.normal(size=60)
    expected = lsq_linear(rows.T, -gradient, bounds, method="bvls").x
    multipliers = least_squares_multipliers(rows, gradient, equal, at_upper)
    assert (multipliers[20:] == 0.0).any()
    np.testing.assert_allclose(multipliers, expected, atol=1e-9)

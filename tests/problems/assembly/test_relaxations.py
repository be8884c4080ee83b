"""Numbers of a problem that hold a motion back, and the same problem with one of them looser."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links, following, moving
from helpers.space import small_arm

from problems import Ellipse, Problem, closed_curve
from problems.base import Relaxation
from problems.families.splines import move
from problems.families.traced import tracing
from problems.limits import ExpressionLimit, Limit
from problems.limits.hand import ToolSpeed
from problems.motions import Samples
from problems.robots import Payload
from problems.tasks import Joints, Move, PathTracing

RANGES = ((-2.0, 2.0),) * 3
MASSES: dict[str, Any] = {"link_masses": (1.0,) * 3, "max_torque": (50.0, 30.0, 10.0), "payload": Payload(mass=2.0)}
PLANAR = moving(
    equal_links(3, joint_limits=RANGES, max_jerk=(300.0,) * 3, margin=0.05, self_collision=True, **MASSES),
    (1.0, 0.5), (-0.5, 1.2), obstacles=(Ellipse((0.3, 0.6), (0.1, 0.1)),), segment_time=(0.1, 2.0),
    limits=[ToolSpeed(max=3.0)],
)  # fmt: skip
PATH = following(equal_links(3), closed_curve((0.1, 0.0), 1.0, 0.0, 3, 0.1, 20), 0.05, total_time=(0.5, 9.0))
SPACE = move(Move(small_arm(3), Joints((0.0, 0.3, 0.2)), (Joints((1.0, 0.5, 0.1)),)), "time", samples=20, pieces=3)
TRACED = tracing(PathTracing(equal_links(3), PATH.criteria.task.path, 0.05))
PROBLEMS: dict[str, Problem[Any]] = {"planar": PLANAR, "path": PATH, "traced": TRACED, "space": SPACE}


def relaxations_of(problem: Problem[Any]) -> list[Relaxation]:
    of_limits = [relaxation for limit in problem.criteria.limits for relaxation in limit.relaxations]
    return [*of_limits, *problem.criteria.task.relaxations, *problem.criteria.robot.relaxations]


def of(problem: Problem[Any], limit: str, column: str = "") -> Relaxation:
    return next(each for each in relaxations_of(problem) if each.limit == limit and column in (each.of, ""))


def test_every_stated_limit_is_there_once() -> None:
    named = [(each.limit, each.of) for each in relaxations_of(PLANAR)]
    per_joint = ("joint range", "speed", "acceleration", "jerk", "torque")
    expected = {(limit, f"joint {joint}") for limit in per_joint for joint in (1, 2, 3)}
    expected |= {("clearance", "margin"), ("self clearance", "margin"), ("tool speed", "value")}
    expected |= {("segment time", "shortest"), ("segment time", "longest"), ("payload", "mass")}
    assert set(named) == expected and len(named) == len(expected)
    assert {("accuracy", "tip"), ("total time", "longest")} <= {(each.limit, each.of) for each in relaxations_of(PATH)}
    assert of(TRACED, "accuracy", "tip").values(0.01) == {"accuracy": pytest.approx(0.06)}


@pytest.mark.parametrize(
    ("limit", "column", "size", "unit"),
    [
        ("speed", "joint 2", 4.0, "rad/s"),
        ("torque", "joint 3", 10.0, "N m"),
        ("joint range", "joint 1", 4.0, "rad"),
        ("clearance", "margin", 0.05, "m"),
        ("tool speed", "value", 3.0, "m/s"),
        ("segment time", "longest", 2.0, "s"),
        ("payload", "mass", 2.0, "kg"),
    ],
)
def test_sizes_and_units(limit: str, column: str, size: float, unit: str) -> None:
    relaxation = of(PLANAR, limit, column)
    assert (relaxation.size, relaxation.unit) == (pytest.approx(size), unit)
    least = 3.0 * 1e-3 * 2.0 if limit == "clearance" else 0.0  # of the reach, beyond what programs keep
    assert relaxation.step == pytest.approx(max(0.01 * size, least))


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_looser_problem_differs_in_that_number_alone(name: str) -> None:
    problem = PROBLEMS[name]
    for relaxation in relaxations_of(problem):
        looser = problem.relaxed(relaxation, 0.5 * relaxation.step)
        back = looser.relaxed(of(looser, relaxation.limit, relaxation.of), -0.5 * relaxation.step)
        assert looser.criteria.task != problem.criteria.task or looser.criteria.limits != problem.criteria.limits
        assert type(looser) is type(problem) and len(looser.criteria.limits) == len(problem.criteria.limits)
        assert len(relaxations_of(looser)) == len(relaxations_of(problem))
        same = of(back, relaxation.limit, relaxation.of)
        assert same.size == pytest.approx(relaxation.size, rel=1e-12)


def rooms(limit: Limit, samples: Samples) -> np.ndarray:
    return np.array([row.slack for row in limit.constraints(samples)])


def test_every_motion_has_more_room_in_a_looser_problem() -> None:
    rng = np.random.default_rng(3)
    robot = PLANAR.criteria.robot
    states = [ca.DM(rng.normal(size=(4, 3))) for _ in range(4)]
    for number, limit in enumerate(PLANAR.criteria.limits):
        for relaxation in limit.relaxations:
            looser = PLANAR.relaxed(relaxation, relaxation.step)
            here = Samples(robot=robot, derivatives=tuple(states), duration=ca.DM(1.0), times=ca.DM(range(4)) / 3.0)
            there = Samples(
                robot=looser.criteria.robot, derivatives=tuple(states), duration=ca.DM(1.0), times=ca.DM(range(4)) / 3.0
            )
            assert (rooms(looser.criteria.limits[number], there) >= rooms(limit, here) - 1e-12).all(), relaxation.limit


def test_what_is_nothing_can_only_be_tighter() -> None:
    bare = moving(equal_links(2), (1.0, 0.5), (-0.5, 1.2), obstacles=(Ellipse((0.3, 0.6), (0.1, 0.1)),))
    margin = of(bare, "clearance")
    assert margin.size == 0.0 and margin.step == pytest.approx(-3.0 * 1e-3 * 2.0)
    assert bare.relaxed(margin, margin.step).criteria.robot.margin == pytest.approx(0.006)


def test_expressions_are_as_wide_as_their_bounds_are_apart() -> None:
    robot, [limit] = equal_links(3), [each for each in PLANAR.criteria.limits if isinstance(each, ExpressionLimit)]
    assert limit.robot.dof == robot.dof

    def relaxation(lower: tuple[float, ...] | None, upper: tuple[float, ...] | None, scale: float) -> Relaxation:
        own = ExpressionLimit("own", robot, limit.function, "m", lower, upper, (scale,))
        return own.relaxations[0]

    assert relaxation((-2.0,), (2.0,), 2.0).size == 2.0  # the same on both sides
    assert relaxation((0.2,), (0.5,), 0.2).size == pytest.approx(0.3)
    assert relaxation((-0.4,), None, 0.4).size == 0.4
    at_zero = relaxation((0.0,), None, 1.0)
    assert (at_zero.size, at_zero.step) == (0.0, pytest.approx(-0.01))
    assert relaxation((0.2,), (0.5,), 0.2).values(0.01) == {"lower": (0.19,), "upper": (0.51,)}

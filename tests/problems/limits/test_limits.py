"""Limits by hand, torques too: one row or many, between samples, with margins; and the time scales that they allow."""

from __future__ import annotations

import itertools
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from helpers.space import small_arm
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, ConstantVelocity, InvalidProblem, MovingObstacle, PlanarArm, Trajectory
from problems.base import FloatArray, as_array
from problems.certify import exact_time_scale, limit_verdicts, safe_time_scale
from problems.families.two_segments import Quantities
from problems.limits import (
    LIMITS,
    MAX_STEP_SHARE,
    SAMPLING_MARGIN,
    Clearance,
    Constraint,
    Limit,
    PenaltyKind,
    StepLimit,
    TorqueLimit,
    can_hold,
    holding_torques,
    limits_of,
    reachable_pairs,
    scaling,
)
from problems.limits.joint_limits import (
    AccelerationLimit,
    JerkLimit,
    JointRange,
    SpeedLimit,
    StaticTorque,
)
from problems.motions import LEAST_TORQUE_SHARE, Samples
from problems.scene import Ellipse
from problems.scene.solids import Ball

RANGES = ((-2.0, 3.0), (-1.0, 1.0), (-3.0, 2.0))
ARM = PlanarArm((0.8, 0.7, 0.5), (4.0, 3.0, 2.0), (20.0, 10.0, 30.0), RANGES)
DISC, BESIDE = Ellipse((0.0, 1.0), (0.3, 0.3)), Ellipse((0.9, 0.5), (0.1, 0.2), 0.4)
ROWS = 9


SMOOTH = replace(ARM, max_jerk=(200.0,) * 3)
EVERY: dict[str, Limit] = {
    "speed": SpeedLimit(ARM),
    "acceleration": AccelerationLimit(ARM),
    "jerk": JerkLimit(SMOOTH),
    "joint range": JointRange(ARM),
    "clearance": Clearance(ARM, reachable_pairs(ARM, [DISC, BESIDE])),
    "step": StepLimit(ARM, 0.2),
}


def some_samples(rows: int = ROWS, seed: int = 0) -> Samples:
    rng = np.random.default_rng(seed)
    derivatives = tuple(ca.DM(rng.normal(size=(rows, 3)) * size) for size in (2.0, 4.0, 20.0, 200.0))
    times = ca.DM(np.linspace(0.0, 1.0, rows))
    return Samples(robot=ARM, derivatives=derivatives, duration=ca.DM(1.0), times=times)


def straight() -> Samples:
    """The arm stretched along x, then along y, half-way lifted, and bent."""
    theta = ca.DM([[0.0, 0.0, 0.0], [np.pi / 2, 0.0, 0.0], [np.pi / 4, 0.0, 0.0], [0.0, np.pi / 2, 0.0]])
    zeros = ca.DM.zeros(4, 3)
    return Samples(robot=ARM, derivatives=(theta, zeros, zeros), duration=ca.DM(1.0))


def rows_of(constraint: Constraint) -> FloatArray:
    return as_array(constraint.expression)


# One row or many


@pytest.mark.parametrize("limit", EVERY.values(), ids=EVERY)
@pytest.mark.parametrize("margin", [0.0, 0.01])
def test_one_row_says_what_many_say(limit: Limit, margin: float) -> None:
    samples = some_samples()
    rows = [samples.rows(slice(i, i + 1)) for i in range(ROWS)]
    every = limit.constraints(samples, margin)
    alone = [limit.constraints_at(row, margin) for row in rows]
    steps = [limit.between(before, after, margin) for before, after in itertools.pairwise(rows)]
    assert len(every) == len(alone[0]) + len(steps[0])
    for index, constraint in enumerate(every):
        single = [row[index] for row in alone] if index < len(alone[0]) else [s[index - len(alone[0])] for s in steps]
        assert (np.vstack([rows_of(c) for c in single]) == rows_of(constraint)).all()
        assert constraint.rows == len(single)
        assert len(constraint.columns) == rows_of(constraint).shape[1]
        for one in single:
            assert (one.name, one.unit) == (constraint.name, constraint.unit)
            assert (one.columns, one.formula) == (constraint.columns, constraint.formula)
            assert all((a == b).all() for a, b in zip(one.bounds, constraint.bounds, strict=True))
        for penalty in ("paper_penalty", "graded_penalty"):
            summed = sum(float(getattr(one, penalty)()) for one in single)
            assert float(getattr(constraint, penalty)()) == pytest.approx(summed)


def test_a_single_sample_has_no_steps() -> None:
    single = some_samples(1)
    assert [c.name for c in EVERY["clearance"].constraints(single)] == ["clearance"]
    assert EVERY["step"].constraints(single) == []


# Each by hand


def test_joint_range_keeps_a_share_of_each_range() -> None:
    [constraint] = JointRange(ARM).constraints(some_samples(), 0.1)
    assert constraint.bounds[0] == pytest.approx([-1.5, -0.8, -2.5])
    assert constraint.bounds[1] == pytest.approx([2.5, 0.8, 1.5])
    assert constraint.penalty is PenaltyKind.COUNT


def test_clearance_by_hand() -> None:
    limit = Clearance(ARM, reachable_pairs(ARM, [DISC]))
    assert [str(pair) for pair in limit.pairs] == [f"link {i}, obstacle 1" for i in (1, 2, 3)]
    links, swept = limit.constraints(straight(), 0.01)
    assert rows_of(links)[0] == pytest.approx([0.7, np.hypot(0.8, 1.0) - 0.3, np.hypot(1.5, 1.0) - 0.3])
    assert rows_of(links)[1] == pytest.approx([-0.1, -0.3, 0.2])
    assert rows_of(links)[3] == pytest.approx([0.7, np.hypot(0.8, 0.3) - 0.3, 0.5])
    # The tip goes straight from (2, 0) to (0, 2), sqrt(1/2) from the centre; joint 2 from (0.8, 0) to (0, 0.8).
    assert rows_of(swept)[0] == pytest.approx([-0.1, np.hypot(0.25, 0.25) * 1.0 - 0.3, np.sqrt(0.5) - 0.3])
    assert links.bounds[0] == pytest.approx(0.01 * 2.0)
    assert (links.bounds[1] == np.inf).all()
    assert swept.columns == tuple(f"end of link {i}, obstacle 1" for i in (1, 2, 3))


def test_steps_by_hand() -> None:
    limit = StepLimit.for_robot(ARM, [DISC, BESIDE])
    assert limit is not None
    assert limit.width == 0.2
    [step] = limit.constraints(straight())
    assert rows_of(step)[0] == pytest.approx([2 * 0.8**2, 2 * 1.5**2, 2 * 2.0**2])
    assert step.bounds[1] == pytest.approx((MAX_STEP_SHARE * 0.2) ** 2)
    assert StepLimit.for_robot(ARM, []) is None


def test_a_robot_without_bodies_may_make_any_step() -> None:
    assert not small_arm().bodies.each
    assert StepLimit.for_robot(small_arm(), [Ball(center=(1.0, 0.0, 0.5), radius=0.1)]) is None


@pytest.mark.parametrize(("beside", "left"), [(1.1, 0.9), (0.5, 0.3)])
def test_steps_as_a_moving_obstacle_sees_them_by_hand(beside: float, left: float) -> None:
    """The arm stands along x while a disc of 0.2 m comes 1 m nearer: a step may be as long as what is left then."""
    disc = MovingObstacle(Ellipse((0.4, beside + 1.0), (0.2, 0.2)), ConstantVelocity((0.0, -1.0)))
    step, longest = StepLimit.for_robot(ARM, [disc]), MAX_STEP_SHARE * 0.4
    assert step is not None
    (found,) = step.constraints(replace(some_samples(2), derivatives=(ca.DM.zeros(2, 3),)))
    assert as_array(ca.DM(found.upper)) == pytest.approx(np.full((1, 3), longest**2))
    assert rows_of(found)[0, 0] == pytest.approx((longest / max(longest, left)) ** 2, rel=1e-9)


# Which of them hold


def test_limits_of_a_robot_among_obstacles() -> None:
    assert list(LIMITS) == ["speed", "acceleration", "jerk", "joint range", "torque", "clearance", "self clearance"]
    strong = {"link_masses": (1.0,) * SMOOTH.links, "max_torque": (50.0,) * SMOOTH.links}
    everything = replace(SMOOTH, self_collision=True, **strong)
    assert [limit.name for limit in limits_of(everything, [DISC])] == list(LIMITS)
    assert [limit.name for limit in limits_of(replace(SMOOTH, **strong), [DISC])] == list(LIMITS)[:-1]
    assert "torque" not in [limit.name for limit in limits_of(SMOOTH, [DISC])]
    assert [limit.name for limit in limits_of(equal_links(3), [])] == ["speed", "acceleration"]
    far = Ellipse((9.0, 0.0), (0.1, 0.1))
    assert [limit.name for limit in limits_of(ARM, [far])] == ["speed", "acceleration", "joint range"]
    with pytest.raises(InvalidProblem, match="'speed' is there twice"):
        limits_of(ARM, [], [SpeedLimit])
    assert [limit.name for limit in scaling(EVERY.values())] == ["speed", "acceleration", "jerk"]
    with pytest.raises(NotImplementedError):
        Limit.for_robot(ARM, [])


# How slowly a shape has to be run


def a_motion(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    parts = [ca.DM(rng.uniform(-2.0, 2.0, (1, 3))) for _ in range(4)]
    return Quantities(*parts, ca.DM(rng.uniform(0.3, 1.0)), ca.DM(rng.uniform(0.3, 1.0))).trajectory()


@pytest.mark.parametrize("names", [("jerk",), ("speed", "acceleration", "jerk")], ids=str)
@pytest.mark.parametrize("seed", range(2))
def test_the_least_time_just_keeps_the_limits_and_is_certified(names: tuple[str, ...], seed: int) -> None:
    limits, motion = [EVERY[name] for name in names], a_motion(seed)
    scale = exact_time_scale(limits, motion)
    verdicts = limit_verdicts(limits, motion.time_scaled(safe_time_scale(limits, motion)))
    assert [verdict.status for verdict in verdicts] == [CertificateStatus.CERTIFIED] * len(names)
    faster = limit_verdicts(limits, motion.time_scaled(scale * (1.0 - 1e-6)))
    assert CertificateStatus.VIOLATED in {verdict.status for verdict in faster}
    dense = motion.time_scaled(scale).samples(np.linspace(0.0, scale * motion.duration, 20_001))
    for limit in limits:
        assert float(limit.constraints(dense)[0].graded_penalty()) < 1e-6


MASS, LENGTH, GRAVITY = 2.0, 0.5, 9.81
WEIGHT = MASS * GRAVITY * LENGTH  # N m: of a rod at its far end
MOTORS = (3.0 * WEIGHT, 0.75 * WEIGHT)
RODS = PlanarArm((LENGTH,) * 2, (4.0,) * 2, (40.0,) * 2, link_masses=(MASS,) * 2, max_torque=MOTORS)
RUBBING = PlanarArm(
    (0.5, 0.4, 0.3),
    (4.0,) * 3,
    (40.0,) * 3,
    link_masses=(2.0, 1.5, 1.0),
    viscous_friction=(2.0, 1.0, 0.5),
    coulomb_friction=(3.0, 2.0, 1.0),
    max_torque=(40.0, 20.0, 8.0),
)


def samples_of(robot: PlanarArm, theta: FloatArray, speed: FloatArray, acceleration: FloatArray) -> Samples:
    return Samples(robot=robot, derivatives=tuple(map(ca.DM, (theta, speed, acceleration))), duration=ca.DM(1.0))


def at_rest(robot: PlanarArm, theta: list[float], acceleration: list[float]) -> Samples:
    return samples_of(robot, np.array([theta]), np.zeros((1, robot.dof)), np.array([acceleration]))


def test_rods_stretched_out_by_hand() -> None:
    """Held: m g l/2 about the second joint, m g l/2 + m g 3l/2 about the first."""
    assert holding_torques(RODS, np.zeros((1, 2))) == pytest.approx(np.array([[2.0 * WEIGHT, 0.5 * WEIGHT]]))
    [constraint] = TorqueLimit(RODS).constraints(at_rest(RODS, [0.0, 0.0], [0.0, 0.0]))
    assert as_array(constraint.expression) == pytest.approx(np.array([[2.0 * WEIGHT, 0.5 * WEIGHT]]))
    assert constraint.unit == "N m"
    assert float(constraint.graded_penalty()) == 0.0


def test_a_posture_that_cannot_be_held_breaks_the_static_limit_by_how_much() -> None:
    weak = PlanarArm(RODS.link_lengths, (4.0,) * 2, (40.0,) * 2, link_masses=(MASS,) * 2, max_torque=(WEIGHT, WEIGHT))
    assert can_hold(weak, np.array([[0.0, 0.0], [np.pi / 2, 0.0], [-np.pi / 2, 0.0]])).tolist() == [False, True, True]
    [static] = TorqueLimit(weak).static_limits
    excess = [
        float(c.graded_penalty())
        for a in (0.0, 0.5, 1.5)
        for c in static.constraints(at_rest(weak, [a, 0.0], [0.0, 0.0]))
    ]
    room = 1.0 - SAMPLING_MARGIN
    assert excess == pytest.approx([2.0 / room - 1.0, 2.0 * np.cos(0.5) / room - 1.0, 0.0])
    assert can_hold(PlanarArm((1.0, 1.0), (4.0,) * 2, (40.0,) * 2), np.zeros((3, 2))).all()


def test_torques_of_unknown_masses_are_refused() -> None:
    with pytest.raises(InvalidProblem, match="masses"):
        TorqueLimit.for_robot(PlanarArm((1.0, 1.0), (4.0,) * 2, (40.0,) * 2, max_torque=(1.0, 1.0)), ())


SIZES = (st.floats(-3.0, 3.0), st.floats(-4.0, 4.0), st.floats(-60.0, 60.0))


@settings(max_examples=30, deadline=None)
@given(*(st.lists(size, min_size=9, max_size=9) for size in SIZES))
def test_slowed_down_the_torques_are_kept_and_one_is_used_up(
    theta: list[float], speed: list[float], acceleration: list[float]
) -> None:
    """Where motors can hold the arm; a factor of 0 says that any speed will do."""
    q, v, a = (np.array(values).reshape(3, 3) for values in (theta, speed, acceleration))
    static, limit = StaticTorque(RUBBING), TorqueLimit(RUBBING)
    [constraint] = static.constraints_at(samples_of(RUBBING, q, v, a))
    holds = (np.abs(as_array(constraint.expression)) <= constraint.bounds[1]).all(axis=1)
    q, v, a = q[holds], v[holds], a[holds]
    if not holds.any():
        return
    samples = samples_of(RUBBING, q, v, a)
    s = float(limit.time_scale(limit.magnitudes(samples)))
    for factor in (s, 1.5 * s, 40.0 * s, 1.0 / LEAST_TORQUE_SHARE):
        if factor < max(s, 1e-3):
            continue
        torques = as_array(samples_of(RUBBING, q, v / factor, a / factor**2).torque)
        used = (np.abs(torques) / np.array(limit.bounds)).max()
        assert used <= 1.0 + 1e-9
        if factor == s:
            assert used == pytest.approx(1.0, abs=1e-6)

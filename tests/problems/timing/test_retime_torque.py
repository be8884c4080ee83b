"""Least time under torque limits: by hand for one joint, against TOPP-RA for arms, and kept at 20,000 times."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from problems import InvalidProblem, PlanarArm, Robot, Trajectory
from problems.base import as_array
from problems.motions import JointPath
from problems.robots import JointLimits, Payload, RigidChain, Transform, built_in
from problems.robots.dynamics import RigidJoint
from problems.robots.inertia import Inertia
from problems.timing import retime
from problems.timing.settings import TorqueCurveSettings

MASS, CENTER, G = 1.5, 0.4, 9.81
HOLD = MASS * CENTER * G  # N m, with the rod level
INERTIA = 0.1 + MASS * CENTER**2
FAST = JointLimits(speed=(1e3,), acceleration=(1e4,))
TIMES = 20_000
ARM = PlanarArm(
    link_lengths=(0.5, 0.4, 0.3),
    max_speed=(4.0,) * 3,
    max_acceleration=(30.0,) * 3,
    max_torque=(45.0, 20.0, 5.0),
    link_masses=(3.0, 2.0, 1.0),
    coulomb_friction=(0.5, 0.3, 0.1),
    viscous_friction=(1.0, 0.5, 0.2),
)


def pendulum(damping: float = 0.0, friction: float = 0.0, gravity: float = G) -> RigidChain:
    """A rod on one joint, level where the angle is zero."""
    matrix = ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1))
    moments = Inertia(mass=MASS, center=(CENTER, 0.0, 0.0), matrix=matrix).moments()
    joint = RigidJoint(pose=Transform(), axis=(0.0, 0.0, 1.0), moments=moments, damping=damping, friction=friction)
    return RigidChain(joints=(joint,), gravity=(0.0, -gravity, 0.0))


def turned(angle: float) -> JointPath:
    return JointPath(np.array([0.0, 1.0]), np.array([[[angle]], [[0.0]]]))


def panda(mass: float) -> Robot:
    return built_in("panda").arm(payload=Payload(mass=mass))


def random_path(robot: Robot, seed: int) -> JointPath:
    rng = np.random.default_rng(seed)
    if robot.limits.position is None:
        return JointPath.through(rng.uniform(-1.5, 1.5, (5, robot.dof)))
    low, high = np.array(robot.limits.position).T
    return JointPath.through((low + high) / 2.0 + rng.uniform(-0.4, 0.4, (5, robot.dof)) * (high - low))


def peak(trajectory: Trajectory, chain: RigidChain, limits: JointLimits) -> float:
    """The largest torque at many times, as a share of its limit."""
    times = np.linspace(0.0, trajectory.duration, TIMES)
    torques = as_array(chain.torques(*(ca.DM(trajectory.at(times, order)) for order in range(3))))
    return float((np.abs(torques) / np.array(limits.torque)).max())


def lifting_time(most: float, angle: float) -> float:
    """Full torque up, then full torque against the motion, by energy; the rod starts level and ends at an angle."""

    def energy(q: float) -> float:
        return min(most * q - HOLD * np.sin(q), most * (angle - q) + HOLD * (np.sin(angle) - np.sin(q)))

    middle = brentq(
        lambda q: most * q - HOLD * np.sin(q) - most * (angle - q) - HOLD * (np.sin(angle) - np.sin(q)), 0.0, angle
    )
    speed = quad(lambda x: 2.0 * x / np.sqrt(2.0 * energy(x * x) / INERTIA), 1e-9, np.sqrt(middle), limit=200)[0]
    brake = quad(
        lambda x: 2.0 * x / np.sqrt(2.0 * energy(angle - x * x) / INERTIA), 1e-9, np.sqrt(angle - middle), limit=200
    )[0]
    return float(speed + brake)


@pytest.mark.parametrize("share", [1.02, 1.5, 4.0])
def test_a_pendulum_is_lifted_with_full_torque(share: float) -> None:
    limits = replace(FAST, torque=(share * HOLD,))
    trajectory = retime(turned(np.pi / 2.0), limits, chain=pendulum())
    best = lifting_time(share * HOLD * (1.0 - TorqueCurveSettings.margin), np.pi / 2.0)
    assert best * (1.0 - 1e-6) < trajectory.duration < best * 1.002
    assert 1.0 - 2.0 * TorqueCurveSettings.margin < peak(trajectory, pendulum(), limits) <= 1.0


def test_what_the_motors_cannot_hold_is_named() -> None:
    limits = replace(FAST, torque=(0.5 * HOLD,))
    with pytest.raises(InvalidProblem, match=r"joint 1 has to give 5\.886 N m to hold the arm 0% along .* 2\.943 N m"):
        retime(turned(1.0), limits, chain=pendulum())
    with pytest.raises(InvalidProblem, match="joint 1 has to give"):
        retime(turned(1.0), replace(limits, jerk=(1e5,)), chain=pendulum())
    assert retime(turned(1.0), limits).duration > 0.0  # where masses do not count


def test_coulomb_friction_is_paid_for_and_brakes() -> None:
    most, friction, angle = 5.0, 1.5, 2.0
    limits = replace(FAST, torque=(most,))
    trajectory = retime(turned(angle), limits, chain=pendulum(friction=friction, gravity=0.0))
    up, down = ((most * (1.0 - TorqueCurveSettings.margin) - sign * friction) / INERTIA for sign in (1.0, -1.0))
    best = np.sqrt(2.0 * angle * (1.0 / up + 1.0 / down))
    assert best * (1.0 - 1e-6) < trajectory.duration < best * 1.003
    assert peak(trajectory, pendulum(friction=friction, gravity=0.0), limits) <= 1.0


def test_viscous_friction_grows_with_speed() -> None:
    most, damping, angle = 5.0, 2.0, 6.0
    chain, limits = pendulum(damping=damping, gravity=0.0), replace(FAST, torque=(most,))
    trajectory = retime(turned(angle), limits, chain=chain)
    most *= 1.0 - TorqueCurveSettings.margin
    rate, top = damping / INERTIA, most / damping

    def way(time: float) -> float:  # full torque so long, then full torque backwards until it stands still
        speed = top * (1.0 - np.exp(-rate * time))
        braking = np.log1p(speed / top) / rate
        return float(top * time - speed / rate + (speed - most / damping * rate * braking) / rate - angle)

    time = brentq(way, 0.0, 100.0)
    best = time + np.log1p(1.0 - np.exp(-rate * time)) / rate
    assert best * (1.0 - 1e-6) < trajectory.duration < best * 1.004
    assert peak(trajectory, chain, limits) <= 1.0


@pytest.mark.parametrize(("name", "jerk"), [("planar", True), ("panda", False)])
def test_torques_are_kept_between_samples(name: str, jerk: bool) -> None:
    robot = ARM if name == "planar" else panda(3.0)
    limits = replace(robot.limits, jerk=tuple(20.0 * a for a in robot.limits.acceleration) if jerk else None)
    path, chain = random_path(robot, 2), robot.dynamics
    trajectory = retime(path, limits, chain=chain)
    assert 0.98 < peak(trajectory, chain, limits) <= 1.0
    free = retime(path, limits)
    assert peak(free, chain, limits) > 1.05
    assert free.duration < trajectory.duration
    if jerk:
        assert trajectory.duration < 1.1 * retime(path, robot.limits, chain=chain).duration


def test_a_line_keeps_its_closed_form_where_motors_allow_it() -> None:
    robot, way = panda(0.0), np.array([0.0, 0.3, 0.0, -1.0, 0.0, 1.0, 0.0]) + np.outer([0.0, 1.0], [0.5] * 7)
    path, limits = JointPath.through(way), robot.limits
    assert retime(path, limits, chain=robot.dynamics).duration == retime(path, limits).duration
    weak = replace(limits, torque=tuple(0.6 * most for most in robot.limits.torque or ()))
    slower = retime(path, weak, chain=robot.dynamics)
    assert slower.duration > retime(path, limits).duration
    assert peak(slower, robot.dynamics, weak) <= 1.0


def test_a_line_may_be_stored_with_more_orders_than_a_line_needs() -> None:
    robot = panda(0.0)
    way = np.array([0.0, 0.3, 0.0, -1.0, 0.0, 1.0, 0.0]) + np.outer([0.0, 1.0], [0.5] * 7)
    path = JointPath.through(way)
    longer = JointPath(path.breakpoints, np.pad(path.coefficients, ((3, 0), (0, 0), (0, 0))))
    moves = [retime(each, robot.limits, chain=robot.dynamics) for each in (path, longer)]
    assert moves[0].duration == moves[1].duration
    np.testing.assert_array_equal(*(move.at(np.linspace(0.0, move.duration, 50)) for move in moves))


def test_moving_ends_keep_their_speed() -> None:
    path, limits = random_path(ARM, 1), ARM.limits
    trajectory = retime(path, limits, (0.2, 0.1), chain=ARM.dynamics)
    ends = trajectory.at(trajectory.breakpoints[[0, -1]], 1)
    expected = path.at(path.breakpoints[[0, -1]], 1) * np.array([[0.2], [0.1]])
    np.testing.assert_allclose(ends, expected, atol=1e-9)
    assert peak(trajectory, ARM.dynamics, limits) <= 1.0


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_a_path_is_as_fast_as_toppras_under_torque_limits(seed: int) -> None:
    pytest.importorskip("toppra")
    from benchmarks.peers.torque_limited import by_toppra  # noqa: PLC0415 - an extra

    robot = panda(3.0)
    path, limits = random_path(robot, seed), replace(robot.limits, jerk=None)
    ours = retime(path, limits, chain=robot.dynamics)
    peer = by_toppra(path, robot, 800)
    assert peer is not None
    assert ours.duration == pytest.approx(peer.duration, rel=3e-3)

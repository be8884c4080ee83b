"""The polish with torque limits: what a payload slows down is made fast again, and proven."""

import casadi as ca
import numpy as np
import pytest

from problems import Move
from problems.certify import CertificateStatus
from problems.families.splines import MoveProblem, move
from problems.motions import Trajectory
from problems.robots import Payload, built_in
from problems.tasks import Joints
from problems.timing.free_space import rest_to_rest

START = (0.0, -0.4, 0.0, -2.2, 0.0, 1.9, 0.8)
GOAL = (1.2, 0.9, 0.3, -0.7, 0.2, 1.6, 0.8)


def lifting(mass: float) -> MoveProblem:
    """A Panda that puts something down far out, in free space."""
    arm = built_in("panda", None).arm(payload=Payload(mass=mass, center=(0.0, 0.0, 0.1)))
    return move(Move(arm, Joints(START), (Joints(GOAL),)), pieces=4)


def free(problem: MoveProblem) -> Trajectory:
    return rest_to_rest(np.array(START), np.array(GOAL), problem.robot.limits)


def test_a_payload_costs_far_less_than_running_more_slowly() -> None:
    problem = lifting(3.0)
    fastest = free(problem)
    slowed = fastest.duration * problem.safe_time_scale(fastest)
    made = next(problem.polished(fastest))
    made = made.time_scaled(max(1.0, problem.safe_time_scale(made)))
    assert all(verdict.status is CertificateStatus.CERTIFIED for verdict in problem.verify(made))
    assert fastest.duration <= made.duration < 1.02 * fastest.duration
    assert slowed > 1.3 * fastest.duration
    assert made.at(made.breakpoints[[0, -1]]) == pytest.approx(np.array([START, GOAL]), abs=1e-9)
    torques = problem.robot.massive
    times = np.linspace(0.0, made.duration, 2000)
    largest = np.abs(np.asarray(torques.torques(*(ca.DM(made.at(times, order)) for order in range(3)))))
    shares = largest / np.array(problem.robot.limits.torque)
    assert 0.95 < shares.max() <= 1.0

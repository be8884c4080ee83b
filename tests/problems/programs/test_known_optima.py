"""Textbook problems: a rotor and a pendulum of least energy, a two-link arm as fast as its motors allow.

References are computed here by other means: a closed form, Pontryagin's conditions as a boundary-value problem (SciPy),
direct collocation by Hermite and Simpson of state and torque (CasADi).
"""

from __future__ import annotations

from itertools import islice

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import simpson, solve_bvp

from problems import OBJECTIVES, PlanarArm, Robot, Trajectory
from problems.base import FloatArray
from problems.certify import limit_verdicts
from problems.families.splines import MoveNlp
from problems.limits import limits_of
from problems.robots import read_urdf
from problems.tasks import Joints, Move
from solvers import IPOPT, Descent

MASS, LENGTH, MIDDLE = 1.2, 0.4, 0.03  # kg, m, kg m^2
INERTIA = MIDDLE + MASS * LENGTH**2
PENDULUM = f"""<robot name="pendulum"><link name="base"/><link name="tip"/>
<link name="rod"><inertial><origin xyz="0 0 {-LENGTH}"/><mass value="{MASS}"/>
<inertia ixx="{MIDDLE}" iyy="{MIDDLE}" izz="{MIDDLE}" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/>
<limit lower="-6" upper="6" velocity="20" effort="1000"/></joint>
<joint name="end" type="fixed"><parent link="rod"/><child link="tip"/><origin xyz="0 0 {-LENGTH}"/></joint></robot>"""
FIXED = 1.0 + 1e-7  # a duration that is given is one within a narrow range


def least(task: Move, objective: str, pieces: int, starts: int = 1) -> Trajectory:
    """The best of a few descents: the finished motion, which keeps its limits for all t."""
    limits = limits_of(task.robot, task.obstacles)
    program = MoveNlp(task, OBJECTIVES[objective], limits, pieces, lambda x: Trajectory(x, x))
    descent = Descent(program, IPOPT())
    found = [program.trajectory(descent(x).x) for x in islice(program.starts(np.random.default_rng(0)), starts)]
    assert all(v.satisfied for motion in found for v in limit_verdicts(limits, motion))
    return min(found, key=lambda motion: OBJECTIVES[objective].of_motion(motion, task.robot, motion.times(2)))


def swing(gravity: float, angle: float, duration: float, pieces: int) -> float:
    """The energy of our motion of the pendulum from hanging at rest to rest."""
    arm = read_urdf(PENDULUM).arm(max_acceleration=60.0, gravity=(0.0, 0.0, -gravity))
    ends = Joints((0.0,)), (Joints((angle,)),)
    motion = least(Move(arm, *ends, total_time=(duration, duration * FIXED)), "energy", pieces)
    assert motion.duration == pytest.approx(duration, rel=2e-7)
    return OBJECTIVES["energy"].of_motion(motion, arm, motion.times(2))


def test_a_rotor_of_least_energy() -> None:
    """Without gravity: the cubic, whatever the number of pieces."""
    expected = 12.0 * INERTIA**2 * 1.3**2 / 0.8**3
    assert [swing(0.0, 1.3, 0.8, pieces) for pieces in (2, 12)] == pytest.approx([expected] * 2, rel=2e-6)


def by_pontryagin(angle: float, duration: float) -> float:
    """H = tau^2 + p_1 w + p_2 (tau - m g l sin q) / I: tau = -p_2 / (2 I), p_1' = p_2 m g l cos q / I, p_2' = -p_1."""
    weight, times = MASS * 9.81 * LENGTH, np.linspace(0.0, duration, 200)

    def slopes(_: FloatArray, y: FloatArray) -> FloatArray:
        torque = -y[3] / (2.0 * INERTIA)
        fall = weight * np.sin(y[0])
        return np.vstack([y[1], (torque - fall) / INERTIA, y[3] * weight * np.cos(y[0]) / INERTIA, -y[2]])

    def ends(first: FloatArray, last: FloatArray) -> FloatArray:
        return np.array([first[0], first[1], last[0] - angle, last[1]])

    s = times / duration
    q, w = angle * (3.0 * s**2 - 2.0 * s**3), angle * 6.0 * (s - s * s) / duration
    costate = -2.0 * INERTIA * (INERTIA * angle * (6.0 - 12.0 * s) / duration**2 + weight * np.sin(q))
    guess = np.vstack([q, w, -np.gradient(costate, times), costate])
    solution = solve_bvp(slopes, ends, times, guess, tol=1e-9, max_nodes=50_000)
    assert solution.status == 0
    fine = np.linspace(0.0, duration, 20_001)
    return float(simpson((solution.sol(fine)[3] / (2.0 * INERTIA)) ** 2, x=fine))


@pytest.mark.parametrize(("angle", "duration", "pieces", "within"), [(2.0, 0.9, 8, 1e-4), (3.0, 2.0, 16, 1e-3)])
def test_a_pendulum_of_least_energy(angle: float, duration: float, pieces: int, within: float) -> None:
    expected = by_pontryagin(angle, duration)
    found = swing(9.81, angle, duration, pieces)
    assert expected * (1.0 - 1e-6) <= found <= expected * (1.0 + within)


def test_holding_a_pendulum_costs_so_that_there_is_a_best_duration() -> None:
    """From upright hold to hold, gravity makes long motions dear: the duration found is no bound, others are worse."""
    arm = read_urdf(PENDULUM).arm(max_acceleration=60.0)
    ends = Joints((0.8,)), (Joints((2.0,)),)
    free = least(Move(arm, *ends), "energy", 8)
    energy = OBJECTIVES["energy"].of_motion(free, arm, free.times(2))
    for factor in (0.8, 1.25):
        duration = free.duration * factor
        other = least(Move(arm, *ends, total_time=(duration, duration * FIXED)), "energy", 8)
        assert OBJECTIVES["energy"].of_motion(other, arm, other.times(2)) > 1.01 * energy


ARM = PlanarArm((0.5, 0.5), (40.0, 40.0), (1000.0, 1000.0), link_masses=(2.0, 2.0), max_torque=(35.0, 12.0))
START, GOAL = (-0.5, 0.3), (0.9, -0.6)


def by_collocation(robot: Robot, intervals: int) -> float:
    """The least time with torques linear or so in each interval, bounded at its ends and in its middle."""
    chain, bound = robot.dynamics, ca.DM([35.0, 12.0])
    q, v, a, u = (ca.SX.sym(name, 2) for name in "qvau")
    torque = chain.torques(q.T, v.T, a.T).T
    rest = ca.substitute(torque, a, ca.SX.zeros(2))
    f = ca.Function("f", [ca.vertcat(q, v), u], [ca.vertcat(v, ca.solve(ca.jacobian(torque, a), u - rest))])
    problem = ca.Opti()
    duration, x = problem.variable(), problem.variable(4, intervals + 1)
    at_nodes, between = problem.variable(2, intervals + 1), problem.variable(2, intervals)
    step = duration / intervals
    problem.minimize(duration)
    problem.subject_to(duration >= 0.05)
    for k in range(intervals):
        first, last = f(x[:, k], at_nodes[:, k]), f(x[:, k + 1], at_nodes[:, k + 1])
        middle = f((x[:, k] + x[:, k + 1]) / 2.0 + step / 8.0 * (first - last), between[:, k])
        problem.subject_to(x[:, k + 1] == x[:, k] + step / 6.0 * (first + 4.0 * middle + last))
        problem.subject_to(problem.bounded(-bound, between[:, k], bound))
    for k in range(intervals + 1):
        problem.subject_to(problem.bounded(-bound, at_nodes[:, k], bound))
    problem.subject_to(x[:, 0] == ca.DM([*START, 0.0, 0.0]))
    problem.subject_to(x[:, -1] == ca.DM([*GOAL, 0.0, 0.0]))
    s, way = np.linspace(0.0, 1.0, intervals + 1), np.subtract(GOAL, START)[:, None]
    problem.set_initial(x[:2, :], np.array(START)[:, None] + way * (3.0 * s**2 - 2.0 * s**3))
    problem.set_initial(x[2:, :], way * 6.0 * (s - s * s) / 0.6)
    problem.set_initial(duration, 0.6)
    problem.solver("ipopt", {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0})
    return float(problem.solve().value(duration))


@pytest.mark.slow
def test_an_arm_of_two_links_as_fast_as_its_motors_allow() -> None:
    """Bang-bang torques that switch anywhere: cubic pieces in time need 40 of them to come within 1 %."""
    expected = by_collocation(ARM, 50)
    found = least(Move(ARM, Joints(START), (Joints(GOAL),)), "time", 40, starts=2)
    assert expected * (1.0 - 1e-3) <= found.duration <= 1.01 * expected

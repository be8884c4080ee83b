"""Timing under a largest speed of the tool: the length of its way is one more joint, of which only speed is limited."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.motions import JointPath, Trajectory
from problems.robots import Robot
from problems.timing.bound import least_along, with_tool
from problems.timing.retime import retime
from problems.timing.settings import STEADY_RETIMING

GAUSS_POINTS = 6  # in each piece of a path, to integrate the length of the tool's way
ORDER = 6  # of the polynomials of that length: its value and two derivatives at both ends of a piece


def retime_below(path: JointPath, robot: Robot, tool_speed: float) -> Trajectory:
    """The least-time motion along a path whose tool is nowhere faster than stated, to 1e-6 of that speed.

    Args:
        path: of the robot's joints, along which its tool never stands.
        robot: whose limits are kept.
        tool_speed: the largest, m/s.

    Raises:
        InvalidProblem: as :func:`retime`.
    """
    limits = with_tool(robot.limits, tool_speed)
    motion = retime(_with_length(path, robot), limits, chain=robot.rigid_chain, settings=STEADY_RETIMING)
    return Trajectory(motion.breakpoints, motion.coefficients[..., : robot.dof])


def least_below(path: JointPath, robot: Robot, tool_speed: float) -> float:
    """A lower bound of the duration of every motion along a path from rest to rest with such a tool, s."""
    return least_along(_with_length(path, robot), with_tool(robot.limits, tool_speed))


def _with_length(path: JointPath, robot: Robot) -> JointPath:
    """The path with the length of the tool's way as its last joint, m, twice continuously differentiable."""
    extents = np.diff(path.breakpoints)
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    inner = path.breakpoints[:-1, None] + extents[:, None] * (nodes + 1.0) / 2.0
    slopes = _length_slopes(path, robot, inner.ravel())[0].reshape(inner.shape)
    lengths = slopes @ weights / 2.0 * extents
    first, second = _length_slopes(path, robot, path.breakpoints)
    at_start, at_end = ((one * extents, two * extents**2) for one, two in _at_ends(first, second))
    begun = np.stack([np.append(0.0, np.cumsum(lengths))[:-1], at_start[0], at_start[1] / 2.0])
    left = np.stack([lengths - begun[1] - begun[2], at_end[0] - begun[1] - at_start[1], at_end[1] - at_start[1]])
    rest = np.linalg.solve(np.array([[1.0, 1.0, 1.0], [3.0, 4.0, 5.0], [6.0, 12.0, 20.0]]), left)
    length = np.concatenate([begun, rest])[::-1] / extents ** np.arange(ORDER)[::-1, None]
    order = max(ORDER, len(path.coefficients))
    joints, tool = (
        np.pad(part, ((order - len(part), 0), (0, 0), (0, 0))) for part in (path.coefficients, length[..., None])
    )
    return JointPath(path.breakpoints, np.concatenate([joints, tool], axis=2))


def _at_ends(first: FloatArray, second: FloatArray) -> tuple[tuple[FloatArray, FloatArray], ...]:
    """Derivatives (p + 1,) at breakpoints as those at the starts of pieces and at their ends, (p,) each."""
    return (first[:-1], second[:-1]), (first[1:], second[1:])


def _length_slopes(path: JointPath, robot: Robot, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The first and second derivative of the length of the tool's way at parameters, (n,) each."""
    theta, slope, bend = (ca.SX.sym(name, robot.dof) for name in ("theta", "slope", "bend"))
    velocity = ca.jtimes(robot.tool.position(theta.T).T, theta, slope)
    change = ca.jtimes(velocity, theta, slope) + ca.jtimes(velocity, slope, bend)
    length = ca.norm_2(velocity)
    along = ca.Function("along", [theta, slope, bend], [length, ca.dot(velocity, change) / length])
    first, second = along.map(u.size)(*(path.at(u, order).T for order in range(3)))
    return np.asarray(first)[0], np.asarray(second)[0]

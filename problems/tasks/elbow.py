"""The branch of inverse kinematics: which way the elbow bends."""

from __future__ import annotations

from math import pi
from typing import Literal, TypeAlias

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix, Operand, as_array
from problems.robots.robot import Robot
from problems.tasks.checks import check_held

Elbow: TypeAlias = Literal["up", "down", "free"]


def check_elbow(robot: Robot, elbow: Elbow) -> None:
    """Raise InvalidProblem when the limits of joint 2 exclude the whole half turn of its elbow, or there is none."""
    if robot.dim != 2 and elbow != "free":
        raise InvalidProblem("elbow", f"{elbow!r} does not apply to a robot in space; leave it out")
    if robot.limits.position is not None and elbow != "free":
        low, high = robot.limits.position[1]
        if half_turn(elbow, (low + high) / 2.0, (low, high), robot.stretched) is None:
            raise InvalidProblem(
                "joint_limits", f"joint 2: with the elbow {elbow} it cannot be within {low} and {high}"
            )


def half_turn(
    elbow: Elbow, theta_2: float, within: tuple[float, float], stretched: float = 0.0
) -> tuple[float, float] | None:
    """Where theta_2 may be with the elbow up (sin theta_2 >= 0) or down, in rad.

    Args:
        elbow: ``up`` or ``down``.
        theta_2: of several half turns the nearest to this angle is taken.
        within: the limits of joint 2.
        stretched: theta_2 of the stretched arm, see :attr:`Robot.stretched`.

    Returns:
        The part of that half turn that lies within the limits; None when no half turn does.
    """
    low = stretched if elbow == "up" else stretched - pi
    nearest = int(np.rint((theta_2 - low - pi / 2.0) / (2.0 * pi)))
    for turn in sorted(range(nearest - 2, nearest + 3), key=lambda n: abs(n - nearest)):
        interval = max(low + 2.0 * pi * turn, within[0]), min(low + pi + 2.0 * pi * turn, within[1])
        if interval[0] < interval[1]:
            return interval
    return None


def narrow_elbow(
    elbow: Elbow, x: FloatArray, index: int, lower: FloatArray, upper: FloatArray, stretched: float = 0.0
) -> None:
    """Narrow, in place, the bounds of a theta_2 among the variables to the half turn of its elbow nearest to it."""
    if elbow == "free":
        return
    interval = half_turn(elbow, float(x[index]), (float(lower[index]), float(upper[index])), stretched)
    if interval is not None:
        lower[index], upper[index] = interval


def check_point_held(robot: Robot, elbow: Elbow, field: str, point: tuple[float, ...], name: str = "") -> None:
    """The motors can hold one of the arm's postures with the tool at a point; not asked where they are without number.

    Raises:
        InvalidProblem: they can hold none.
    """
    if robot.limits.torque is None or robot.redundancy or robot.dim != 2:
        return
    signs = [sign for sign, branch in ((1.0, "up"), (-1.0, "down")) if elbow in (branch, "free")]
    found = [robot.inverse(ca.DM(point), ca.DM(0, 1), sign)[0] for sign in signs]
    check_held(robot, field, as_array(ca.vertcat(*found)), name)


def elbow_signs(elbow: Elbow, branch: Matrix, ends: int) -> list[Operand]:
    """+1 (up) or -1 (down) for each end; from the signs of the search variables when the elbow is free."""
    if elbow == "free":
        return [ca.if_else(branch[i] < 0.0, -1.0, 1.0) for i in range(ends)]
    return [1.0 if elbow == "up" else -1.0] * ends

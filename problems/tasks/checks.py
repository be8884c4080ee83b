"""What the two tasks have in common: choices, checks of what a user states, the elbow of a search vector."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import pi
from typing import Literal, TypeAlias

import casadi as ca
import numpy as np

from problems.base.errors import InvalidProblem
from problems.base.matrix import FloatArray, Matrix
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse

Elbow: TypeAlias = Literal["up", "down", "free"]
Formulation: TypeAlias = Literal["paper", "reduced"]
KnotRedundancy: TypeAlias = Literal["free", "values"]


def check_choices(task: object, **choices: Collection[str]) -> None:
    """Raise InvalidProblem for a field of a task that is not one of its choices."""
    for field, known in choices.items():
        if getattr(task, field) not in known:
            raise InvalidProblem(field, f"{getattr(task, field)!r} is not one of {', '.join(known)}")


def check_range(field: str, bounds: tuple[float, float]) -> None:
    """Raise InvalidProblem unless 0 < lower < upper, both finite."""
    lower, upper = bounds
    if not (np.isfinite(upper) and 0.0 < lower < upper):
        raise InvalidProblem(field, f"0 < {lower} < {upper} does not hold, or is not finite")


def check_obstacles(obstacles: Sequence[Ellipse]) -> None:
    """Raise InvalidProblem when the base of the arm lies inside an obstacle."""
    for obstacle in obstacles:
        if obstacle.contains((0.0, 0.0)):
            raise InvalidProblem("obstacles", f"the base lies inside the obstacle at {obstacle.center}")


def check_point(
    arm: PlanarArm, obstacles: Sequence[Ellipse], field: str, point: tuple[float, float], name: str = ""
) -> None:
    """Raise InvalidProblem when the tip cannot be at a point: out of reach, too close, or inside an obstacle."""
    distance = float(np.hypot(*point))
    inner, outer = arm.reach()
    place = f"{name}{point} is {distance:.6g} m from the base"
    if not distance <= outer:
        raise InvalidProblem(field, f"{place}, out of reach: the arm reaches {outer:.6g} m")
    if distance < inner:
        raise InvalidProblem(field, f"{place}, too close: the arm reaches from {inner:.6g} m on")
    for obstacle in obstacles:
        if obstacle.contains(point):
            raise InvalidProblem(field, f"{name}{point} lies inside the obstacle at {obstacle.center}")


def check_elbow(arm: PlanarArm, elbow: Elbow) -> None:
    """Raise InvalidProblem when the limits of joint 2 leave nothing of the half turn that the elbow asks for."""
    if arm.joint_limits is not None and elbow != "free":
        low, high = arm.joint_limits[1]
        if half_turn(elbow, (low + high) / 2.0, (low, high)) is None:
            raise InvalidProblem(
                "joint_limits", f"joint 2: with the elbow {elbow} it cannot be within {low} and {high}"
            )


def half_turn(elbow: Elbow, theta_2: float, within: tuple[float, float]) -> tuple[float, float] | None:
    """Where theta_2 may be with the elbow up (sin theta_2 >= 0) or down, in rad.

    Args:
        elbow: ``up`` or ``down``.
        theta_2: of several half turns the nearest to this angle is taken.
        within: the limits of joint 2.

    Returns:
        The part of that half turn that lies within the limits; None when no half turn does.
    """
    low = 0.0 if elbow == "up" else -pi
    nearest = int(np.rint((theta_2 - low - pi / 2.0) / (2.0 * pi)))
    for turn in sorted(range(nearest - 2, nearest + 3), key=lambda n: abs(n - nearest)):
        found = max(low + 2.0 * pi * turn, within[0]), min(low + pi + 2.0 * pi * turn, within[1])
        if found[0] < found[1]:
            return found
    return None


def narrow_elbow(elbow: Elbow, x: FloatArray, index: int, lower: FloatArray, upper: FloatArray) -> None:
    """Narrow, in place, the bounds of a theta_2 among the variables to the half turn of its elbow nearest to it."""
    if elbow == "free":
        return
    found = half_turn(elbow, float(x[index]), (float(lower[index]), float(upper[index])))
    if found is not None:
        lower[index], upper[index] = found


def elbow_signs(elbow: Elbow, branch: Matrix, ends: int) -> list[Matrix]:
    """+1 (up) or -1 (down) for each end; from the signs of the search variables when the elbow is free."""
    if elbow == "free":
        return [ca.if_else(branch[i] < 0.0, -1.0, 1.0) for i in range(ends)]
    return [1.0 if elbow == "up" else -1.0] * ends

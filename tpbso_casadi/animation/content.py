"""What every player is told of a motion, as plain data: lengths in m, times in s, angles in rad."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.animation.closest import Closest, closest_of
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.style.colours import line_of
from tpbso_casadi.planning.joint_quantities import alternatives, shares_of_limits, torques_of

DIGITS = 4  # of metres
FINE = 6  # of seconds, joints, and directions
PER_TIME = {"speed": "/s", "acceleration": "/s²", "jerk": "/s³"}  # of a joint's unit


def shared_content(frames: Frames) -> dict[str, Any]:
    """The data that every stage needs."""
    robot = frames.problem.robot
    closest = closest_of(frames.problem, frames.theta, frames.times)
    return {
        "times": rounded(frames.times, FINE),
        "joints": rounded(frames.joints),
        "points": rounded(frames.task_points),
        "joint_names": list(robot.joint_names),
        "lines": [_line(joint) for joint in range(robot.dof)],
        "curves": _curves(frames),
        "closest": None if closest is None else _closest(closest),
        "notes": frames.notes,
        "seconds": frames.seconds,
    }


def rounded(values: FloatArray, digits: int = DIGITS) -> list[Any]:
    """Nested lists of numbers that are short to write."""
    return list(np.asarray(values, dtype=float).round(digits).tolist())


def _line(joint: int) -> dict[str, Any]:
    """Colour and dashes of a joint's curve, the latter in widths of the line."""
    style = line_of(joint)
    return {"colour": style["color"], "dashes": [] if style["linestyle"] == "-" else list(style["linestyle"][1])}


def _curves(frames: Frames) -> list[dict[str, Any]]:
    """Positions of the joints; what is limited as shares of the limits; torques that nothing limits as they are."""
    robot, trajectory, times = frames.problem.robot, frames.trajectory, frames.times
    curves = [_curve(f"joint position [{alternatives(robot.joint_units)}]", frames.theta, robot.joint_units)]
    curves[0]["bounds"] = robot.limits.position
    for name, shares in shares_of_limits(robot, trajectory, times):
        units = [unit + PER_TIME[name] for unit in robot.joint_units] if name in PER_TIME else robot.torque_units
        curves.append(_curve(f"joint {name} / limit", shares, units) | {"limits": list(getattr(robot.limits, name))})
    torques = torques_of(robot, trajectory, times) if robot.limits.torque is None else None
    if torques is not None:
        curves.append(_curve(f"joint torque [{alternatives(robot.torque_units)}]", torques, robot.torque_units))
    return curves


def _curve(label: str, values: FloatArray, units: Sequence[str]) -> dict[str, Any]:
    return {"label": label, "values": rounded(values, FINE), "units": list(units)}


def _closest(closest: Closest) -> dict[str, Any]:
    return {
        "names": [str(pair) for pair in closest.pairs],
        "numbers": closest.numbers.tolist(),
        "distances": rounded(closest.distances, FINE),
        "points": rounded(closest.points),
    }

"""What the player is given, in the plane and in space."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import Any

import numpy as np

from problems.base import FloatArray
from problems.scene import standing
from tpbso_casadi.animation.closest import Closest, closest_of
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.palette import line_of
from tpbso_casadi.figures.scene import Course
from tpbso_casadi.figures.space_scene import Polyhedron, ground
from tpbso_casadi.planning import alternatives, shares_of_limits, torques_of

DIGITS = 4  # of metres
FINE = 6  # of seconds, joints, and directions
PER_TIME = {"speed": "/s", "acceleration": "/s²", "jerk": "/s³"}  # of a joint's unit


def shared_data(frames: Frames) -> dict[str, Any]:
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


def plane_data(frames: Frames) -> dict[str, Any]:
    """What is seen of the arm and its surroundings: lengths in m."""
    problem = frames.problem
    return {
        "extent": rounded(np.array(frames.extent)),
        "bodies": [[body.start, body.end, float(body.radius)] for body in problem.robot.bodies if body.radius],
        "obstacles": [rounded(obstacle.outline()) for obstacle in standing(problem.obstacles)],
        "moving": [_moving_in_plane(course) for course in frames.courses],
    }


def _moving_in_plane(course: Course) -> dict[str, Any]:
    """An obstacle that moves: its outline as seen from its frame, and origin and first axis of that at each time."""
    return {
        "outline": rounded(course.obstacle.unmoved.outline()),
        "frames": rounded(course.frames[:, :2].reshape(-1, 4)),
        "way": rounded(course.middles),
    }


ROUND = 24  # faces: what has more is round
AXES = 0.15  # length of the axes at the base, of the picture's
LIGHT = np.array([-0.35, -0.45, 0.82])


def space_data(frames: Frames) -> dict[str, Any]:
    """What is seen of the robot and its surroundings, and from where: lengths in m, angles in rad."""
    scene, robot = frames.scene, frames.problem.robot
    bounds = scene.bounds(frames.theta)
    view = scene.view(frames.theta, bounds)
    x, y, z = view.axes[2]
    return {
        "centers": rounded(scene.centers(frames.theta)),
        "radii": rounded(scene.radii, FINE),
        "kinds": list(_kinds([body.name for body in scene.balls])),
        "solids": [_solid(solid) for solid in scene.solids],
        "planes": [[a, b, face] for (a, b), face in scene.planes.items()],
        "moving": [_moving_in_space(course) for course in scene.courses],
        "ground": rounded(ground(bounds)),
        "axes": _axes(np.array(robot.base), AXES * float(np.ptp(bounds, axis=0).max())),
        "camera": {
            "center": rounded(view.center),
            "distance": view.distance,
            "azimuth": float(np.arctan2(y, x)),
            "elevation": float(np.arcsin(z)),
        },
    }


def _kinds(names: list[str]) -> Iterator[int]:
    """The number of each body, where balls of one name in a row are one."""
    for number, (_, group) in enumerate(groupby(names)):
        yield from (number for _ in group)


def _solid(solid: Polyhedron) -> dict[str, Any]:
    """Its surface; of something round, of which only the outline is drawn, the sharp edges alone."""
    edges = [edge for edge in solid.edges if edge.sharp or len(solid.faces) <= ROUND]
    return {
        "vertices": rounded(solid.vertices, FINE),
        "faces": solid.faces,
        "normals": rounded(solid.normals, FINE),
        "offsets": rounded(solid.offsets, FINE),
        "center": rounded(solid.center),
        "shades": rounded(0.75 + 0.25 * np.abs(solid.normals @ LIGHT), 2),
        "edges": [[*edge.ends, edge.faces[0], edge.faces[-1], edge.sharp] for edge in edges],
    }


def _moving_in_space(course: Course) -> dict[str, Any]:
    """The number of an obstacle that moves, where its frame is at each time, and the way of its middle."""
    frames = course.frames.copy()
    frames[:, 0], frames[:, 1:] = frames[:, 0].round(DIGITS), frames[:, 1:].round(FINE)
    return {"number": course.number - 1, "frames": frames.tolist(), "way": rounded(course.middles)}


def _axes(base: FloatArray, length: float) -> list[Any]:
    """Name, start and end of the axes at the base."""
    return [[name, rounded(base), rounded(base + length * row)] for name, row in zip("xyz", np.eye(3), strict=True)]

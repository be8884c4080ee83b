"""What the player of motions in space shows, as plain data."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.animation.closest import Closest, closest_of
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.courses import Course
from tpbso_casadi.figures.space.polyhedron import Polyhedron
from tpbso_casadi.figures.space.scene import ground
from tpbso_casadi.figures.style.colours import SERIES
from tpbso_casadi.planning.joint_quantities import alternatives, shares_of_limits, torques_of

DIGITS = 4  # of metres
FINE = 6  # of seconds, joints, and directions
ROUND = 24  # faces: what has more is round
AXES = 0.15  # length of the axes at the base, of the picture's
LIGHT = np.array([-0.35, -0.45, 0.82])


def content_of(frames: Frames) -> dict[str, Any]:
    """The data of a motion: lengths in m, times in s, angles in rad."""
    scene, robot = frames.scene, frames.problem.robot
    bounds = scene.bounds(frames.theta)
    view = scene.view(frames.theta, bounds)
    x, y, z = view.axes[2]
    closest = closest_of(frames.problem, frames.theta, frames.times)
    return {
        "times": rounded(frames.times, FINE),
        "joints": rounded(frames.joints),
        "way": rounded(frames.joints[:, -1]),
        "centers": rounded(scene.centers(frames.theta)),
        "radii": rounded(scene.radii, FINE),
        "kinds": list(_kinds([body.name for body in scene.balls])),
        "points": rounded(frames.task_points),
        "solids": [_solid(solid) for solid in scene.solids],
        "planes": [[a, b, face] for (a, b), face in scene.planes.items()],
        "moving": [_moving(course) for course in scene.courses],
        "ground": rounded(ground(bounds)),
        "axes": _axes(np.array(robot.base), AXES * float(np.ptp(bounds, axis=0).max())),
        "camera": {
            "center": rounded(view.center),
            "distance": view.distance,
            "azimuth": float(np.arctan2(y, x)),
            "elevation": float(np.arcsin(z)),
        },
        "joint_names": list(robot.joint_names),
        "colours": SERIES,
        "curves": _curves(frames),
        "closest": None if closest is None else _closest(closest),
        "notes": frames.notes,
        "seconds": frames.seconds,
    }


def rounded(values: FloatArray, digits: int = DIGITS) -> list[Any]:
    """Nested lists of numbers that are short to write."""
    return list(np.asarray(values, dtype=float).round(digits).tolist())


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


def _moving(course: Course) -> dict[str, Any]:
    """The number of an obstacle that moves, where its frame is at each time, and the way of its middle."""
    frames = course.frames.copy()
    frames[:, 0], frames[:, 1:] = frames[:, 0].round(DIGITS), frames[:, 1:].round(FINE)
    return {"number": course.number - 1, "frames": frames.tolist(), "way": rounded(course.middles)}


def _axes(base: FloatArray, length: float) -> list[Any]:
    """Name, start and end of the axes at the base."""
    return [[name, rounded(base), rounded(base + length * row)] for name, row in zip("xyz", np.eye(3), strict=True)]


def _curves(frames: Frames) -> list[dict[str, Any]]:
    """Positions of the joints; what is limited as shares of the limits; torques that nothing limits as they are."""
    robot, units = frames.problem.robot, frames.problem.robot.joint_units
    label = f"joint position [{alternatives(units)}]"
    curves: list[dict[str, Any]] = [
        {"label": label, "values": rounded(frames.theta, FINE), "units": list(units), "bound": False}
    ]
    for name, shares in shares_of_limits(robot, frames.trajectory, frames.times):
        label = f"joint {name} / limit"
        curves.append({"label": label, "values": rounded(shares, FINE), "units": [""] * robot.dof, "bound": True})
    torques = torques_of(robot, frames.trajectory, frames.times) if robot.limits.torque is None else None
    if torques is not None:
        label = f"joint torque [{alternatives(robot.torque_units)}]"
        values = rounded(torques, FINE)
        curves.append({"label": label, "values": values, "units": list(robot.torque_units), "bound": False})
    return curves


def _closest(closest: Closest) -> dict[str, Any]:
    return {
        "names": [str(pair) for pair in closest.pairs],
        "numbers": closest.numbers.tolist(),
        "distances": rounded(closest.distances, FINE),
        "points": rounded(closest.points),
    }

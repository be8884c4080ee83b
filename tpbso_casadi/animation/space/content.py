"""What the player is told of a motion in space alone."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.animation.content import DIGITS, FINE, rounded
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.courses import Course
from tpbso_casadi.figures.space.polyhedron import Polyhedron
from tpbso_casadi.figures.space.scene import ground

ROUND = 24  # faces: what has more is round
AXES = 0.15  # length of the axes at the base, of the picture's
LIGHT = np.array([-0.35, -0.45, 0.82])


def content_of(frames: Frames) -> dict[str, Any]:
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
        "moving": [_moving(course) for course in scene.courses],
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


def _moving(course: Course) -> dict[str, Any]:
    """The number of an obstacle that moves, where its frame is at each time, and the way of its middle."""
    frames = course.frames.copy()
    frames[:, 0], frames[:, 1:] = frames[:, 0].round(DIGITS), frames[:, 1:].round(FINE)
    return {"number": course.number - 1, "frames": frames.tolist(), "way": rounded(course.middles)}


def _axes(base: FloatArray, length: float) -> list[Any]:
    """Name, start and end of the axes at the base."""
    return [[name, rounded(base), rounded(base + length * row)] for name, row in zip("xyz", np.eye(3), strict=True)]

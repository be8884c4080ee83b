"""Distances of the Panda's spheres by the library coal, where it is installed: a check of those in NumPy."""

from __future__ import annotations

import numpy as np

from benchmarks.moving_scenes.arms import Panda, Thing
from benchmarks.moving_scenes.shapes import Solid
from problems.base import FloatArray

try:
    import coal
except ImportError:
    coal = None

TOLERANCE = 1e-5  # m: what coal's iterations may lack


def check_with_coal(things: tuple[Thing, ...], theta: FloatArray, times: FloatArray, shift: float = 0.0) -> None:
    """Compare the nearest sphere and each thing that it does not touch, in postures (n, k) at times (n,).

    Args:
        things: of a scene.
        theta: postures of the Panda, rad.
        times: s.
        shift: of the times at which coal looks, s: to see that a difference is found.

    Raises:
        AssertionError: they are not the same.
    """
    if coal is None:
        return
    arm = Panda()
    points = arm.points(theta)
    for thing in things:
        rooms = thing.room(points, times) - arm.radii
        for k, sphere in enumerate(rooms.argmin(axis=1)):
            if rooms[k, sphere] > 0.0:  # how deep they are in each other is another matter
                found = _distance(thing, times[k] + shift, points[k, sphere], float(arm.radii[sphere]))
                assert abs(found - rooms[k, sphere]) < TOLERANCE, f"coal {found}, NumPy {rooms[k, sphere]}"


def _distance(thing: Thing, time: float, center: FloatArray, radius: float) -> float:
    assert isinstance(thing.shape, Solid)
    kind, sizes = thing.shape.in_coal
    (origin,), axes = thing.course.frames(np.array([time]))
    pose = coal.Transform3s(np.eye(3) if axes is None else axes[0], origin)
    ball, place = coal.Sphere(radius), coal.Transform3s(np.eye(3), center)
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(ball, place, getattr(coal, kind)(*sizes), pose, request, result))

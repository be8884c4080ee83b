"""The compiled collision check of sampling planners, so that Python does not decide how far they come."""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

import numpy as np

from benchmarks.motion_bench_maker.collision import Checker
from problems.base import FloatArray
from problems.evaluation.compiler import find_compiler

SOURCE = Path(__file__).with_name("fast_collision.cpp")


@cache
def _library() -> ctypes.CDLL:
    """Compiled once a process.

    Raises:
        NativeUnavailable: there is no C++ compiler.
    """
    with NamedTemporaryFile(suffix=".so") as file:
        file.write(find_compiler().library(SOURCE.read_text()))
        file.flush()
        return ctypes.CDLL(file.name)


class PlannerCollision:
    """Whether postures are free of collision.

    Args:
        checker: of the robot among its obstacles.
        margin: that has to be left, m.
    """

    def __init__(self, checker: Checker, margin: float = 0.0) -> None:
        kinematics, spheres = checker.kinematics, checker.spheres
        obstacles = np.array(
            [
                [*one.rotation.ravel(), *one.position, *np.array(one.size) / 2.0, float(one.shape == "cylinder")]
                for one in checker.obstacles
            ]
        )
        self._joints = len(kinematics.names)
        self._numbers = [
            np.ascontiguousarray(part, dtype=kind)
            for part, kind in (
                (kinematics.placements, float),
                (kinematics.axes, float),
                (spheres.bodies, np.int32),
                (spheres.centers, float),
                (spheres.radii, float),
                (obstacles, float),
                (checker.own, np.int32),
            )
        ]
        placements, axes, bodies, centers, radii, boxes, own = map(_pointer, self._numbers)
        self._arguments = [placements, axes, len(spheres.radii), bodies, centers, radii, len(obstacles), boxes]
        self._arguments += [len(checker.own), own, ctypes.c_double(margin)]
        self._all_free = _library().all_free

    def all_free(self, theta: FloatArray) -> bool:
        """Whether all of n postures (n, k), rad, keep the margin."""
        rows = np.ascontiguousarray(theta, dtype=float)
        return bool(self._all_free(len(rows), self._joints, _pointer(rows), *self._arguments))


def _pointer(array: np.ndarray[Any, Any]) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)

"""An arm without anything around it, in the compiled core: postures that reach a pose."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from problems.base import FloatArray
from problems.core.description import RobotNumbers, described
from problems.core.library import core_library, told
from problems.robots import Robot, SpatialArm, geometry_of

KEPT = 16  # arms


class Arm:
    """Where an arm's joints are and its tool is, in the compiled core.

    Args:
        geometry: an arm, of which nothing else counts.
    """

    def __init__(self, geometry: SpatialArm) -> None:
        self._library, self._arm = told(self, *described(geometry, RobotNumbers.of(geometry), ()))
        frame = geometry.tool_frame
        turned = [float(part) for row in frame.rotation for part in row]
        self._tool = np.array([*turned, *map(float, frame.translation)])

    @classmethod
    def of(cls, robot: Robot) -> Arm | None:
        """The arm, where the core is there and knows it."""
        return _known(geometry_of(robot)) if type(robot) is SpatialArm else None

    def led(
        self,
        theta: FloatArray,
        position: FloatArray,
        rotation: FloatArray | None,
        bounds: tuple[FloatArray, FloatArray],
        steps: int,
    ) -> tuple[FloatArray, FloatArray]:
        """Where damped Newton steps from postures lead.

        Args:
            theta: where they begin, (n, dof), rad or m.
            position: of the tool, (3,), m.
            rotation: of the tool, (3, 3); None where it does not matter.
            bounds: the least and the most of each joint, (dof,) each, infinite where there is none.
            steps: at most; one posture takes no further ones if they lead nowhere.

        Returns:
            Postures (n, dof), and what each then lacks, m and rad together, (n,).
        """
        found = np.array(theta, dtype=np.float64, order="C")
        missing = np.empty(len(found))
        target = [np.ascontiguousarray(part, dtype=np.float64) for part in (position, *bounds)]
        turn = np.zeros(9) if rotation is None else np.ascontiguousarray(rotation, dtype=np.float64)
        place, low, high = (part.ctypes.data for part in target)
        self._library.core_reach(
            self._arm, self._tool.ctypes.data, place, turn.ctypes.data, rotation is not None, low, high, steps,
            len(found), found.ctypes.data, missing.ctypes.data,
        )  # fmt: skip
        return found, missing


@lru_cache(maxsize=KEPT)
def _known(geometry: SpatialArm) -> Arm | None:
    return None if core_library() is None else Arm(geometry)

"""Robots as Python code states them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from problems import InvalidProblem, PlanarArm, Robot
from problems.base.matrix import FloatArray
from problems.robots.spatial.models import BUILT_IN
from problems.robots.spatial.spatial_arm import SpatialArm
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.facade.tables import arm_table, settings_table
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.section import ScenarioError, read_table
from tpbso_casadi.scenario.world.robots import ArmSection, RobotSection
from tpbso_casadi.scenario.world.spatial_robots import SpatialRobotSection


@dataclass(frozen=True, eq=False)
class StatedRobot:
    """A robot with everything that states it, so that a plan can be stored and planned again.

    Attributes:
        table: the [arm] or [robot] table of a scenario, with the texts of the files that it names.
    """

    table: ArmSection | RobotSection | SpatialRobotSection

    @cached_property
    def model(self) -> Robot:
        """The symbolic robot: kinematics, limits, bodies.

        Raises:
            ScenarioError: it cannot be.
        """
        try:
            return self.table.build()
        except InvalidProblem as error:
            raise ScenarioError(f"{self.table.prefix}{error.field}: {error.reason}") from error

    @property
    def dof(self) -> int:
        """The number of joints."""
        return self.model.dof

    @property
    def content(self) -> dict[str, Any]:
        """The table under its name in a scenario."""
        return {"arm" if isinstance(self.table, ArmSection) else "robot": self.table.model_dump()}

    def __repr__(self) -> str:
        return f"<robot with {self.dof} joints, {'in space' if self.model.dim == 3 else 'in the plane'}>"


AnyRobot: TypeAlias = StatedRobot | Robot | str | Path | Sequence[float] | FloatArray


def robot(model: AnyRobot, **keys: Any) -> StatedRobot:
    """A robot: built in, of a URDF, or in the plane.

    Args:
        model: ``"panda"``, ``"ur5e"`` or ``"iiwa14"``; the path of a URDF file; the link lengths of a planar arm in m;
            a :class:`PlanarArm`; or a robot that :func:`robot` made.
        keys: of the [robot] table, or of [arm] for link lengths, such as ``max_acceleration``, ``spheres``,
            ``payload``.

    Raises:
        ScenarioError: naming the first wrong key, or a file that cannot be read.
    """
    if isinstance(model, StatedRobot):
        return model
    if isinstance(model, Robot):
        return StatedRobot(_table_of(model))
    if isinstance(model, str | Path):
        table = {"model": model} if model in BUILT_IN else {"urdf": str(model)}
        section = read_table(SpatialRobotSection, "robot", plain(table | keys))
        return StatedRobot(section.with_files(InputFolder(Path(), outside_allowed=True)))
    return StatedRobot(read_table(ArmSection, "arm", plain({"link_lengths": np.asarray(model)} | keys)))


def _table_of(model: Robot) -> ArmSection | RobotSection:
    """The table that states a robot which is there already.

    Raises:
        ScenarioError: only a description can state it.
    """
    if isinstance(model, PlanarArm):
        return read_table(ArmSection, "arm", arm_table(model))
    if isinstance(model, SpatialArm):
        raise ScenarioError("robot: say tp.robot('panda') or tp.robot('arm.urdf'): a plan keeps the description")
    return read_table(RobotSection, "robot", settings_table(model))

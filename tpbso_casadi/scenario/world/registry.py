"""Which section reads a [robot] table: that of robots in space, or that of kinds of robots with settings."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import PlainValidator, SerializeAsAny

from problems.robots.spatial.models import BUILT_IN
from tpbso_casadi.scenario.section import read_section
from tpbso_casadi.scenario.validation import shown
from tpbso_casadi.scenario.world.robots import RobotSection
from tpbso_casadi.scenario.world.spatial_robots import SpatialRobotSection


def read_robot(table: Any) -> RobotSection | SpatialRobotSection:
    """The section of a [robot] table.

    Raises:
        ValueError: it is none.
    """
    if isinstance(table, (RobotSection, SpatialRobotSection)):
        return table
    if not isinstance(table, dict):
        raise ValueError(f"a table is needed, not {shown(table)}")
    in_space = "model" not in table or "urdf" in table or str(table["model"]) in BUILT_IN
    if in_space:
        return read_section(SpatialRobotSection, table, "model", "")
    return read_section(RobotSection, table, "model", str(table["model"]))


AnyRobot = Annotated[SerializeAsAny[RobotSection | SpatialRobotSection], PlainValidator(read_robot)]

"""The [arm], [robot] and [[obstacles]] tables of a scenario file."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field

from problems import Ellipse, InvalidProblem, PlanarArm, Robot
from tpbso_casadi.plugins import PluginError
from tpbso_casadi.scenario.catalogues import ROBOT_CATALOGUE
from tpbso_casadi.scenario.section import (
    ANGULAR,
    LARGEST,
    MOST_LINKS,
    SMALLEST,
    Angle,
    Interval,
    PlanarPoint,
    Positive,
    ScenarioError,
    Section,
    Word,
)
from tpbso_casadi.scenario.validation import shown


class ArmSection(Section):
    """[arm]: lengths in m, limits in rad/s and rad/s^2, as one number or one per joint; joint ranges in rad."""

    link_lengths: list[Positive] = Field(min_length=2, max_length=MOST_LINKS)
    max_speed: Annotated[Positive | list[Positive], ANGULAR]
    max_acceleration: Annotated[Positive | list[Positive], ANGULAR]
    joint_limits: Annotated[list[Interval] | None, ANGULAR] = None

    def with_links(self, links: int) -> Self:
        """The same reach and limits with another number of equal links."""
        return self.model_copy(update={"link_lengths": [sum(self.link_lengths) / links] * links})

    def build(self) -> PlanarArm:
        """The robot arm itself."""
        joints = len(self.link_lengths)
        limits = [
            tuple(value) if isinstance(value, list) else (value,) * joints
            for value in (self.max_speed, self.max_acceleration)
        ]
        ranges = None if self.joint_limits is None else tuple(self.joint_limits)
        return PlanarArm(tuple(self.link_lengths), limits[0], limits[1], ranges)


class RobotSection(Section):
    """[robot]: a robot by the name of its kind, and the values of its fields."""

    model: Word
    settings: dict[str, Any] = Field(default_factory=dict)

    def build(self) -> Robot:
        """The robot itself.

        Raises:
            InvalidProblem: it cannot be.
            ScenarioError: there is no such kind of robot, its settings are none, or it has too many joints.
        """
        try:
            kind = ROBOT_CATALOGUE.find(self.model)
        except PluginError as error:
            raise ScenarioError(f"robot.model: {error}") from error
        for key, value in self.settings.items():
            check_numbers(f"robot.settings.{key}", value)
        try:
            robot = kind.from_settings(self.settings)
        except InvalidProblem:
            raise
        except (TypeError, ValueError) as error:  # lists in place of numbers, or the like
            raise ScenarioError(f"robot.settings: {error}") from error
        if robot.dof > MOST_LINKS:
            raise ScenarioError(f"robot: {robot.dof} joints; at most {MOST_LINKS} are planned")
        return robot


class ObstacleSection(Section):
    """[[obstacles]]: an ellipse, m and rad."""

    center: PlanarPoint
    semi_axes: tuple[Positive, Positive]
    angle: Angle = 0.0

    def build(self) -> Ellipse:
        """The obstacle itself."""
        return Ellipse(self.center, self.semi_axes, self.angle)


def check_numbers(key: str, value: object) -> None:
    """Numbers in a free setting, lists and tables included, are of a size that can be computed with.

    Raises:
        ScenarioError: naming the key.
    """
    if isinstance(value, dict):
        for name, entry in value.items():
            check_numbers(f"{key}.{name}", entry)
    elif isinstance(value, (list, tuple)):
        for index, entry in enumerate(value):
            check_numbers(f"{key}.{index}", entry)
    elif isinstance(value, (int, float)) and not (value == 0 or SMALLEST <= abs(value) <= LARGEST):
        raise ScenarioError(f"{key}: {shown(value)} is not zero, nor between {SMALLEST:g} and {LARGEST:g} in magnitude")

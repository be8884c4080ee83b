"""Robots as tables: planar arms, robots by class; which of all tables one is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from math import radians
from typing import Annotated, Any, ClassVar, Self, TypeAlias

from problems import InvalidProblem, PlanarArm, Robot
from problems.base import Count, ReadBy, shown_value
from problems.robots import (
    BUILT_IN,
    PLANAR_GRAVITY,
    Payload,
    planar_payload,
)
from tpbso_casadi.scenario.catalogues import ROBOT_CATALOGUE, PluginError
from tpbso_casadi.scenario.cell_robots import CellSection
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.spatial_robots import SpatialRobotSection
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    LARGEST,
    MOST_LINKS,
    SMALLEST,
    Interval,
    NotNegative,
    Number,
    PlanarPoint,
    Positive,
    ScenarioError,
    Section,
    Word,
    in_radians,
    in_tuples,
    path_of,
    plain,
    stated_values,
)


class PlanarPayloadTable(Section):
    """A payload in the plane: kg, m along the last link and to its left, kg m^2 about the centre of mass."""

    mass: NotNegative
    center: PlanarPoint = (0.0, 0.0)
    inertia: NotNegative = 0.0

    def build(self) -> Payload:
        """The payload that the table states.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return planar_payload(self.mass, self.center, self.inertia)


ARM_KEYS = {"base_point": "base", "base_angle": "base", "tool_offset": "tool"}  # by the fields of the arm
PARTS = ("base", "tool", "payload")  # keys of [arm] that are no field of the arm as they are
OF_THE_MODEL = ("margin", "self_collision")  # fields of a robot that a scenario states in [model]
BESIDE = ("may_touch",)  # and beside its tables


class ArmSection(Section):
    """[arm]: lengths in m, limits of joints in rad/s, rad/s^2, rad/s^3, ranges and the base's own angle in rad.

    Limits are one number or one per joint, ``link_radius`` one or one per link; ``base`` is x, y and maybe an angle.
    """

    prefix: ClassVar[str] = "arm."
    avoids_itself: ClassVar[bool] = False
    usual_samples: ClassVar[int] = 50
    usual_descents: ClassVar[int] = 1
    usual_solver: ClassVar[str] = "abso"

    link_lengths: Annotated[list[Positive], Count(2, MOST_LINKS)]
    max_speed: Annotated[Positive | list[Positive], ANGULAR]
    max_acceleration: Annotated[Positive | list[Positive], ANGULAR]
    joint_limits: Annotated[list[Interval] | None, ANGULAR] = None
    max_jerk: Annotated[Positive | list[Positive] | None, ANGULAR] = None
    link_radius: NotNegative | list[NotNegative] = 0.0
    base: Annotated[list[Number], Count(2, 3)] = field(default_factory=lambda: [0.0, 0.0])
    tool: PlanarPoint = (0.0, 0.0)
    max_torque: Positive | list[Positive] | None = None
    link_masses: Positive | list[Positive] | None = None
    link_centers: Number | list[Number] | None = None
    link_inertias: NotNegative | list[NotNegative] | None = None
    viscous_friction: NotNegative | list[NotNegative] | None = None
    coulomb_friction: NotNegative | list[NotNegative] | None = None
    payload: PlanarPayloadTable | None = None
    gravity: PlanarPoint = PLANAR_GRAVITY

    @property
    def title(self) -> str:
        """The kind of robot in a few words."""
        return f"arm of {len(self.link_lengths)} links"

    def in_radians(self) -> Self:
        base = [*self.base[:2], *map(radians, self.base[2:])]
        return super().in_radians().replaced(base=base)

    def with_links(self, links: int) -> Self:
        """The table with the same reach and limits, and another number of equal links."""
        return self.replaced(link_lengths=[sum(self.link_lengths) / links] * links)

    def for_stage(self, arm: str | None, keys: Mapping[str, Any]) -> Self:
        """The robot of a stage that states some keys anew.

        Raises:
            InvalidProblem: an arm is named, where there is one alone.
        """
        if arm is not None:
            raise InvalidProblem("arm", "there is one arm alone, which has no name; leave it out")
        return self.replaced(**keys)

    def build(self) -> PlanarArm:
        """The robot arm itself.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        try:
            return PlanarArm(
                **{key: self._each(getattr(self, key)) for key in self.schema() if key not in PARTS},
                base_point=(self.base[0], self.base[1]),
                base_angle=sum(self.base[2:]),
                tool_offset=self.tool,
                payload=None if self.payload is None else self.payload.build(),
            )
        except InvalidProblem as error:
            raise InvalidProblem(ARM_KEYS.get(error.field, error.field), error.reason) from error

    def _each(self, value: Any) -> Any:
        """One value for each joint or link where one stands for all of them."""
        return (value,) * len(self.link_lengths) if isinstance(value, float) else in_tuples(value)


def arm_table(arm: PlanarArm) -> dict[str, Any]:
    """The [arm] table of a planar arm."""
    table = {ARM_KEYS.get(key, key): value for key, value in _stated(arm).items()}
    table["base"] = plain([*arm.base_point, arm.base_angle])
    if arm.payload is not None:
        payload = arm.payload
        stated = {"mass": payload.mass, "center": payload.center[:2], "inertia": payload.matrix[2][2]}
        table["payload"] = plain(stated)
    return table


def settings_table(robot: Robot) -> dict[str, Any]:
    """The [robot] table of a robot of any class, by its path."""
    return {"model": path_of(type(robot)), "settings": _stated(robot)}


def _stated(robot: Any) -> dict[str, Any]:
    """The fields of a robot that are keys of one name."""
    others = {"base_point", "base_angle", "payload", *OF_THE_MODEL, *BESIDE}
    return {key: value for key, value in stated_values(robot).items() if key not in others}


class RobotSection(Section):
    """[robot]: a robot by the name of its kind, and the values of its fields.

    Attributes:
        prefix: of the fields of the robot, in messages.
        avoids_itself: whether self-collision is looked after unless the scenario says otherwise.
        usual_samples: of a motion, unless the scenario says otherwise; in space a finger must not slip past a board.
        usual_descents: candidates that IPOPT refines where a scenario names no solver.
        usual_solver: that is taken there.
    """

    prefix: ClassVar[str] = "robot.settings."
    avoids_itself: ClassVar[bool] = False
    usual_samples: ClassVar[int] = 50
    usual_descents: ClassVar[int] = 1
    usual_solver: ClassVar[str] = "abso"

    model: Word
    settings: dict[str, Any] = field(default_factory=dict)

    @property
    def title(self) -> str:
        """The name of its kind."""
        return self.model

    def in_radians(self) -> Self:
        """The table read as one in degrees, in the fields that the robot's class calls angular."""
        try:
            angular = ROBOT_CATALOGUE.find(self.model).angular
        except PluginError:  # said when it is built
            return self
        settings = {key: in_radians(value, angular=key in angular) for key, value in self.settings.items()}
        return self.replaced(settings=settings)

    @property
    def plugins(self) -> list[str]:
        """The name of its kind, which may be a plug-in's."""
        return [self.model]

    def with_files(self, folder: InputFolder) -> Self:
        """The table itself: it names no files."""
        return self

    def for_stage(self, arm: str | None, keys: Mapping[str, Any]) -> Self:
        """The robot of a stage that states some keys anew.

        Raises:
            InvalidProblem: an arm is named, where there is one alone.
        """
        if arm is not None:
            raise InvalidProblem("arm", "there is one arm alone, which has no name; leave it out")
        return self.replaced(**keys)

    def build(self) -> Robot:
        """The robot that the table states.

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
        raise ScenarioError(
            f"{key}: {shown_value(value)} is not zero, nor between {SMALLEST:g} and {LARGEST:g} in magnitude"
        )


def read_robot(table: Any) -> RobotSection | SpatialRobotSection:
    """The section of a [robot] table.

    Raises:
        ValueError: it is none.
    """
    if isinstance(table, (RobotSection, SpatialRobotSection)):
        return table
    if not isinstance(table, dict):
        raise ValueError(f"a table is needed, not {shown_value(table)}")
    model = table.get("model")
    in_space = not isinstance(model, str) or "urdf" in table or model in BUILT_IN
    return (SpatialRobotSection if in_space else RobotSection).from_table(table)


AnyRobotTable: TypeAlias = ArmSection | RobotSection | SpatialRobotSection | CellSection
AnyRobot = Annotated[RobotSection | SpatialRobotSection, ReadBy(read_robot)]

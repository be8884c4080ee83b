"""Robots as tables: planar arms, robots by class, arms in space."""

from __future__ import annotations

import logging
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from math import radians
from typing import Annotated, Any, ClassVar, Self, TypeAlias

from pydantic import Field, PlainValidator, SerializeAsAny, model_validator

from problems import InvalidProblem, PlanarArm, Robot
from problems.robots import (
    BUILT_IN,
    GRAVITY,
    MASSLESS,
    PLANAR_GRAVITY,
    LinkCover,
    MeshNote,
    MeshShape,
    Payload,
    RobotDescription,
    SpatialArm,
    Transform,
    built_in,
    covers_text,
    matrix_of,
    planar_payload,
    read_covers,
    read_spheres,
    read_srdf,
    read_urdf,
    srdf_chain,
)
from tpbso_casadi.scenario.catalogues import ROBOT_CATALOGUE, PluginError
from tpbso_casadi.scenario.input_files import InputFolder, MeshPlace
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
    Quaternion,
    ScenarioError,
    Section,
    SpacePoint,
    Word,
    in_radians,
    in_tuples,
    path_of,
    plain,
    read_section,
    shown,
    stated_values,
)

LOG = logging.getLogger(__name__)
Rows: TypeAlias = tuple[SpacePoint, SpacePoint, SpacePoint]


class PayloadTable(Section):
    """In space: kg, m, kg m^2, in the tool's frame; the inertia is about the centre of mass, a matrix row by row."""

    mass: NotNegative
    center: SpacePoint = (0.0, 0.0, 0.0)
    inertia: Rows = MASSLESS

    def build(self) -> Payload:
        """The payload itself.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return Payload(mass=self.mass, center=self.center, matrix=self.inertia)


class PlanarPayloadTable(Section):
    """In the plane: kg, m along the last link and to its left, kg m^2 about the centre of mass."""

    mass: NotNegative
    center: PlanarPoint = (0.0, 0.0)
    inertia: NotNegative = 0.0

    def build(self) -> Payload:
        """The payload itself.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return planar_payload(self.mass, self.center, self.inertia)


ARM_KEYS = {"base_point": "base", "base_angle": "base", "tool_offset": "tool"}  # by the fields of the arm
PARTS = ("base", "tool", "payload")  # keys of [arm] that are no field of the arm as they are
OF_THE_MODEL = ("margin", "self_collision")  # fields of a robot that a scenario states in [model]


class ArmSection(Section):
    """[arm]: lengths in m, limits of joints in rad/s, rad/s^2, rad/s^3, ranges and the base's own angle in rad.

    Limits are one number or one per joint, ``link_radius`` one or one per link; ``base`` is x, y and maybe an angle.
    """

    prefix: ClassVar[str] = "arm."
    avoids_itself: ClassVar[bool] = False
    usual_samples: ClassVar[int] = 50
    usual_descents: ClassVar[int] = 1

    link_lengths: list[Positive] = Field(min_length=2, max_length=MOST_LINKS)
    max_speed: Annotated[Positive | list[Positive], ANGULAR]
    max_acceleration: Annotated[Positive | list[Positive], ANGULAR]
    joint_limits: Annotated[list[Interval] | None, ANGULAR] = None
    max_jerk: Annotated[Positive | list[Positive] | None, ANGULAR] = None
    link_radius: NotNegative | list[NotNegative] = 0.0
    base: list[Number] = Field(default=[0.0, 0.0], min_length=2, max_length=3)
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
        """What robot it is, in a few words."""
        return f"arm of {len(self.link_lengths)} links"

    def in_radians(self) -> Self:
        """The same, read as a table in degrees."""
        base = [*self.base[:2], *map(radians, self.base[2:])]
        return super().in_radians().model_copy(update={"base": base})

    def with_links(self, links: int) -> Self:
        """The same reach and limits with another number of equal links."""
        return self.model_copy(update={"link_lengths": [sum(self.link_lengths) / links] * links})

    def build(self) -> PlanarArm:
        """The robot arm itself.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        try:
            return PlanarArm(
                **{key: self._each(getattr(self, key)) for key in type(self).model_fields if key not in PARTS},
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
    others = {"base_point", "base_angle", "payload", *OF_THE_MODEL}
    return {key: value for key, value in stated_values(robot).items() if key not in others}


class RobotSection(Section):
    """[robot]: a robot by the name of its kind, and the values of its fields.

    Attributes:
        prefix: of the fields of the robot, in messages.
        avoids_itself: whether self-collision is looked after unless the scenario says otherwise.
        usual_samples: of a motion, unless the scenario says otherwise; in space a finger must not slip past a board.
        usual_descents: candidates that IPOPT refines where a scenario names no solver.
    """

    prefix: ClassVar[str] = "robot.settings."
    avoids_itself: ClassVar[bool] = False
    usual_samples: ClassVar[int] = 50
    usual_descents: ClassVar[int] = 1

    model: Word
    settings: dict[str, Any] = Field(default_factory=dict)

    @property
    def title(self) -> str:
        """The name of its kind."""
        return self.model

    def in_radians(self) -> Self:
        """The same, read as a table in degrees, of the fields that the robot's class calls angular."""
        try:
            angular = ROBOT_CATALOGUE.find(self.model).angular
        except PluginError:  # said when it is built
            return self
        settings = {key: in_radians(value, angular=key in angular) for key, value in self.settings.items()}
        return self.model_copy(update={"settings": settings})

    @property
    def plugins(self) -> list[str]:
        """The name of its kind, which may be a plug-in's."""
        return [self.model]

    def with_files(self, folder: InputFolder) -> Self:
        """The same; it names no files."""
        return self

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


LARGEST_TEXT = 2_000_000  # characters of a file that a result holds
FILES = ("urdf", "spheres", "srdf")  # keys that name files; their texts are in keys of the same names with TEXT
TEXT = "_text"
LARGEST_COVERS = 20_000_000  # characters
MOST_JOINTS = 20  # of a robot in space
KEYS = {"position_limits": "joint_limits"}  # by the fields of the robot
FileName = Annotated[str, Field(min_length=1, max_length=1000)]
FileText = Annotated[str, Field(max_length=LARGEST_TEXT)]
LinkPairs = Annotated[list[tuple[Word, Word]], Field(max_length=10_000)]
FrictionPerJoint = NotNegative | Annotated[list[NotNegative], Field(max_length=MOST_LINKS)]
PerJoint = Positive | Annotated[list[Positive], Field(max_length=MOST_LINKS)]


class PoseTable(Section):
    """Where something stands, and how it is turned: m, and a quaternion (x, y, z, w)."""

    position: SpacePoint = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def build(self) -> Transform:
        """The pose itself.

        Raises:
            InvalidProblem: the quaternion is none.
        """
        return Transform(matrix_of(self.quaternion), self.position)


class SpatialRobotSection(Section):
    """[robot] in space: a built-in model or a URDF, and what is to be different; m, rad, s.

    ``urdf``, ``spheres`` and ``srdf`` name files beside the scenario. Once they are read, their texts stand beside the
    names, so that a result is complete without them.
    """

    prefix: ClassVar[str] = "robot."
    avoids_itself: ClassVar[bool] = True
    usual_samples: ClassVar[int] = 100
    usual_descents: ClassVar[int] = 0

    model: Word | None = None
    urdf: FileName | None = None
    urdf_text: FileText | None = None
    base_link: Word | None = None
    tip_link: Word | None = None
    group: Word | None = None
    locked: dict[Word, Number] = Field(default_factory=dict)
    spheres: FileName | None = None
    spheres_text: FileText | None = None
    srdf: FileName | None = None
    srdf_text: FileText | None = None
    disabled_pairs: LinkPairs | None = None
    kept_pairs: LinkPairs | None = None
    ignore_geometry: list[Word] | None = None
    packages: dict[Word, FileName] = Field(default_factory=dict)
    cover_overhang: Annotated[float, Field(ge=0.003, le=0.1)] | None = None
    self_margin: NotNegative = 0.0
    covers_text: Annotated[str, Field(max_length=LARGEST_COVERS)] | None = None
    max_speed: Annotated[PerJoint | None, ANGULAR] = None
    max_acceleration: Annotated[PerJoint | None, ANGULAR] = None
    max_jerk: Annotated[PerJoint | None, ANGULAR] = None
    joint_limits: Annotated[list[Interval] | None, ANGULAR] = None
    max_torque: PerJoint | None = None
    viscous_friction: FrictionPerJoint | None = None
    coulomb_friction: FrictionPerJoint | None = None
    payload: PayloadTable | None = None
    gravity: SpacePoint = GRAVITY
    base: PoseTable = PoseTable()
    tool: PoseTable = PoseTable()

    @property
    def title(self) -> str:
        """The name of its model, or of its file."""
        return self.model or self.urdf or "robot"

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        described = self.urdf is not None or self.urdf_text is not None
        if described == (self.model is not None):
            raise ValueError("model: one of model and urdf is needed, not both")
        return self

    def with_files(self, folder: InputFolder) -> Self:
        """The same with the texts of the files that it names.

        Raises:
            ScenarioError: a file cannot be read.
        """
        texts: dict[str, str] = {}
        for key in FILES:
            name = getattr(self, key)
            if name is not None and getattr(self, key + TEXT) is None:
                texts[key + TEXT] = self._read(folder, key, name)
        return self.model_copy(update=texts)._with_covers(folder)

    def _with_covers(self, folder: InputFolder) -> Self:
        """The same with covers of the URDF's links, made of the meshes that it names, where no spheres are stated.

        Raises:
            ScenarioError: a mesh cannot be read or covered.
        """
        if self.urdf is None or self.urdf_text is None or self.spheres_text is not None or self.covers_text is not None:
            return self
        try:
            with self._named():
                ignored, overhang = self.ignore_geometry or (), self.cover_overhang
                covers, notes = new_covers(self.description(), self.urdf, folder, self.packages, overhang, ignored)
        except InvalidProblem as error:
            raise ScenarioError(f"robot.{error.field}: {error.reason}") from error
        for note in notes:
            LOG.warning("robot.urdf: link %r: mesh %s %s", note.link, note.file, note.note)
        return self.model_copy(update={"covers_text": covers_text(covers.values())}) if covers else self

    def _read(self, folder: InputFolder, key: str, name: str) -> str:
        try:
            text = folder.read_text(name)
        except ScenarioError as error:
            raise ScenarioError(f"robot.{key}: {error}") from error
        if len(text) > LARGEST_TEXT:
            raise ScenarioError(f"robot.{key}: {folder.path / name}: longer than {LARGEST_TEXT} characters")
        return text

    @property
    def plugins(self) -> list[str]:
        """None: it names no class."""
        return []

    def build(self) -> SpatialArm:
        """The robot itself.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        with self._named():
            description = self.description()
            if len(description.chain.joints) > MOST_JOINTS:
                raise InvalidProblem(
                    "urdf", f"{len(description.chain.joints)} joints; at most {MOST_JOINTS} are planned"
                )
            if self.spheres_text is not None:
                description = description.with_spheres(read_spheres(self.spheres_text, description.links))
            arm = description.arm(
                max_speed=self.max_speed,
                max_acceleration=self.max_acceleration,
                max_jerk=self.max_jerk,
                position_limits=self.joint_limits,
                max_torque=self.max_torque,
                viscous_friction=self.viscous_friction,
                coulomb_friction=self.coulomb_friction,
                payload=None if self.payload is None else self.payload.build(),
                gravity=self.gravity,
                self_margin=self.self_margin,
                base=self._pose("base"),
                tool=self._pose("tool"),
            )
            if self.srdf_text is not None:
                description = description.with_disabled(read_srdf(self.srdf_text))
            return description.complete(
                arm, self.disabled_pairs or (), self.kept_pairs or (), self.ignore_geometry or ()
            )

    def in_radians(self) -> Self:
        """The same, read as a table in degrees.

        Raises:
            ScenarioError: a joint slides, so that which numbers are angles depends on the joint.
        """
        try:
            joints = self.description().chain.joints
        except InvalidProblem:  # said when it is built
            return super().in_radians()
        sliding = [joint.name for joint in joints if not joint.turns]
        if sliding:
            raise ScenarioError(f"unit: 'deg' does not apply, joint {sliding[0]!r} slides: state rad and m")
        return super().in_radians()

    def _pose(self, key: str) -> Transform:
        table: PoseTable = getattr(self, key)
        try:
            return table.build()
        except InvalidProblem as error:
            raise InvalidProblem(f"{key}.{error.field}", error.reason) from error

    def description(self) -> RobotDescription:
        """What the model or the URDF says.

        Raises:
            InvalidProblem: it is none.
        """
        if self.model is not None:
            if self.base_link is not None:
                raise InvalidProblem("base_link", "a robot that is built in has its own")
            return built_in(self.model, self.tip_link)
        if self.urdf_text is None:
            raise InvalidProblem("urdf", f"{self.urdf!r} has not been read; only a scenario file can name one")
        base, tip = self._ends
        description = read_urdf(self.urdf_text, base, tip, self.locked)
        return description if self.covers_text is None else description.with_covers(read_covers(self.covers_text))

    @property
    def _ends(self) -> tuple[str | None, str | None]:
        """Base and tip, as far as they are stated here or in the SRDF.

        Raises:
            InvalidProblem: ``group`` has no chain there, or there is no SRDF.
        """
        if self.group is not None and self.srdf_text is None:
            raise InvalidProblem("group", "of what? a group is one of an srdf")
        chain = None if self.srdf_text is None or self.tip_link is not None else srdf_chain(self.srdf_text, self.group)
        return (self.base_link, self.tip_link) if chain is None else (self.base_link or chain[0], chain[1])

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors name keys of this table."""
        try:
            yield
        except InvalidProblem as error:
            raise InvalidProblem(KEYS.get(error.field, error.field), error.reason) from error


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


def new_covers(
    description: RobotDescription,
    urdf: str,
    folder: InputFolder,
    packages: Mapping[str, str],
    overhang: float | None = None,
    ignored: Collection[str] = (),
) -> tuple[dict[str, LinkCover], list[MeshNote]]:
    """Covers of the links of a URDF, by their names, and notes on its meshes.

    Args:
        description: that it makes.
        urdf: name of its file.
        folder: where that is.
        packages: folders of packages, by their names.
        overhang: of the spheres for searches, m; as usual where None.
        ignored: names of links that are left out.

    Raises:
        InvalidProblem: a mesh cannot be read or covered.
    """
    place = MeshPlace(urdf, packages)
    return description.new_covers(lambda shape: mesh_content(folder, place, shape), overhang, ignored)


def mesh_content(folder: InputFolder, place: MeshPlace, shape: MeshShape) -> bytes:
    """The content of the file of a mesh.

    Raises:
        InvalidProblem: ``mesh`` cannot be read.
    """
    try:
        return folder.read_mesh(place, shape.file)
    except ScenarioError as error:
        raise InvalidProblem("mesh", str(error)) from error


AnyRobot = Annotated[SerializeAsAny[RobotSection | SpatialRobotSection], PlainValidator(read_robot)]

"""Arms in space as tables: a built-in model, or a URDF with meshes, spheres and SRDF, and what is to be different."""

from __future__ import annotations

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias

from problems import InvalidProblem
from problems.base import CACHE_SIZE, Count, InvalidTable, Range, at
from problems.robots import (
    GRAVITY,
    MASSLESS,
    Carried,
    Payload,
    ReadFile,
    RobotDescription,
    SpatialArm,
    Transform,
    appearance_text,
    built_in,
    complete_arm,
    covers_text,
    matrix_of,
    payload_of,
    read_appearances,
    read_covers,
    read_spheres,
    read_srdf,
    read_urdf,
)
from tpbso_casadi.scenario.frames import FramedSection, KnownFrames, StandingFrame
from tpbso_casadi.scenario.input_files import InputFolder, read_text
from tpbso_casadi.scenario.joint_limits_file import JointLimitsFile
from tpbso_casadi.scenario.mjcf_includes import with_includes
from tpbso_casadi.scenario.moveit_config import ASSISTANT, moveit_keys
from tpbso_casadi.scenario.packages import RobotFiles
from tpbso_casadi.scenario.validation import (
    ANGULAR,
    MOST_LINKS,
    Interval,
    NotNegative,
    Number,
    Positive,
    Quaternion,
    ScenarioError,
    Section,
    SpacePoint,
    Word,
    named,
)
from tpbso_casadi.scenario.xacro_files import ENDING as XACRO
from tpbso_casadi.scenario.xacro_files import expanded

LOG = logging.getLogger(__name__)
Rows: TypeAlias = tuple[SpacePoint, SpacePoint, SpacePoint]


class PayloadTable(Section):
    """A payload in space: kg, m, kg m^2, in the tool's frame; inertia about the centre of mass, a matrix row by row."""

    mass: NotNegative
    center: SpacePoint = (0.0, 0.0, 0.0)
    inertia: Rows = MASSLESS

    def build(self) -> Payload:
        """The payload that the table states.

        Raises:
            InvalidProblem: a number is out of range, or no body has such an inertia.
        """
        return Payload(mass=self.mass, center=self.center, matrix=self.inertia)


LARGEST_TEXT = 2_000_000  # characters of a file that a result holds
FILES = ("urdf", "spheres", "srdf", "limits")  # keys that name files; with TEXT, those of their texts
TEXT = "_text"
LARGEST_COVERS, LARGEST_LOOKS = 20_000_000, 2_000_000  # characters
MOST_JOINTS = 20  # of a robot in space
KEYS = {"position_limits": "joint_limits"}  # by the fields of the robot
FileName = Annotated[str, Count(1, 1000)]
FileText = Annotated[str, Count(0, LARGEST_TEXT)]
LinkPairs = Annotated[list[tuple[Word, Word]], Count(0, 10_000)]
FrictionPerJoint = NotNegative | Annotated[list[NotNegative], Count(0, MOST_LINKS)]
PerJoint = Positive | Annotated[list[Positive], Count(0, MOST_LINKS)]
ErrorPerJoint = NotNegative | Annotated[list[NotNegative], Count(0, MOST_LINKS)]


class TrackingTable(Section):
    """How far joints may be from where they are planned: a constant, and shares of planned speed and acceleration."""

    constant: Annotated[ErrorPerJoint, ANGULAR] = 0.0
    speed: ErrorPerJoint = 0.0
    acceleration: ErrorPerJoint = 0.0


AnyTrackingError: TypeAlias = Annotated[ErrorPerJoint, ANGULAR] | TrackingTable


class PoseTable(Section):
    """A pose: a position in m, and a quaternion (x, y, z, w)."""

    position: SpacePoint = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def build(self) -> Transform:
        """The pose that the table states.

        Raises:
            InvalidProblem: the quaternion is none.
        """
        return Transform(matrix_of(self.quaternion), self.position)


class BaseTable(FramedSection, PoseTable):
    """The pose of a base, which may stand in a frame."""

    def in_world(self, frame: StandingFrame) -> Self:
        turned = frame.turned(self.quaternion)
        return self.replaced(position=frame.point(self.position), quaternion=turned)

    def build(self) -> Transform:
        self.check_in_world()
        return super().build()


class SpatialRobotSection(Section):
    """[robot] in space: a built-in model or a URDF, and what is to be different; m, rad, s.

    ``urdf``, ``spheres``, ``srdf`` and ``limits`` name files beside the scenario, or in packages of ROS;
    ``moveit_config`` names a folder that says which. Once they are read, their texts stand beside the names, so that a
    result is complete without them.
    """

    prefix: ClassVar[str] = "robot."
    avoids_itself: ClassVar[bool] = True
    usual_samples: ClassVar[int] = 100
    usual_descents: ClassVar[int] = 0
    usual_solver: ClassVar[str] = "direct"

    model: Word | None = None
    moveit_config: FileName | None = None
    urdf: FileName | None = None
    urdf_text: FileText | None = None
    xacro_arguments: dict[Word, bool | int | float | Word] = field(default_factory=dict)
    base_link: Word | None = None
    tip_link: Word | None = None
    tips: dict[Word, Word] = field(default_factory=dict)
    tip: Word | None = None
    group: Word | None = None
    locked: dict[Word, Number] | Word = field(default_factory=dict)
    spheres: FileName | None = None
    spheres_text: FileText | None = None
    srdf: FileName | None = None
    srdf_text: FileText | None = None
    limits: FileName | None = None
    limits_text: FileText | None = None
    disabled_pairs: LinkPairs | None = None
    kept_pairs: LinkPairs | None = None
    ignore_geometry: list[Word] | None = None
    geometry: Literal["collision", "visual"] | None = None
    packages: dict[Word, FileName] = field(default_factory=dict)
    cover_overhang: Annotated[float, Range(0.003, 0.1)] | None = None
    fine_overhang: Annotated[float, Range(0.001, 0.1)] | None = None
    self_margin: NotNegative = 0.0
    covers_text: Annotated[str, Count(0, LARGEST_COVERS)] | None = None
    looks_text: Annotated[str, Count(0, LARGEST_LOOKS)] | None = None
    max_speed: Annotated[PerJoint | None, ANGULAR] = None
    max_acceleration: Annotated[PerJoint | None, ANGULAR] = None
    max_jerk: Annotated[PerJoint | None, ANGULAR] = None
    joint_limits: Annotated[list[Interval] | None, ANGULAR] = None
    max_torque: PerJoint | None = None
    viscous_friction: FrictionPerJoint | None = None
    coulomb_friction: FrictionPerJoint | None = None
    payload: PayloadTable | None = None
    tracking_error: AnyTrackingError | None = None
    gravity: SpacePoint = GRAVITY
    base: BaseTable = BaseTable()
    tool: PoseTable = PoseTable()

    @property
    def title(self) -> str:
        """The name of its model, of its folder or of its file."""
        return self.model or self.moveit_config or self.urdf or "robot"

    def check(self) -> None:
        described = any(each is not None for each in (self.moveit_config, self.urdf, self.urdf_text))
        if described == (self.model is not None):
            raise InvalidTable("one of model, moveit_config and urdf is needed, and no model beside another", "model")

    def with_files(self, folder: InputFolder) -> Self:
        """The table with the texts of the files that it names.

        Raises:
            ScenarioError: a file cannot be read.
        """
        return self.with_texts(folder)._with_covers(folder)._with_looks(folder)

    def with_texts(self, folder: InputFolder) -> Self:
        """The table with the texts of the files that it names, without what is made of meshes.

        Raises:
            ScenarioError: a file cannot be read.
        """
        table = self._with_moveit_files(folder)
        unread = [key for key in FILES if getattr(table, key) is not None and getattr(table, key + TEXT) is None]
        return table.replaced(**{key + TEXT: table._read(folder, key) for key in unread})

    def _with_moveit_files(self, folder: InputFolder) -> Self:
        """The table with the keys that its configuration of MoveIt states, where it does not state them itself."""
        if self.moveit_config is None or self.urdf_text is not None:
            return self
        with named("robot.moveit_config"):
            table = self.replaced(**moveit_keys(folder, self.moveit_config, self.stated_keys))
            if table.urdf is None:
                raise ScenarioError(f'no URDF: {ASSISTANT} names none, nor is one in config; urdf = "FILE" says which')
        return table

    def _files(self, folder: InputFolder) -> RobotFiles:
        return RobotFiles(folder, self.packages, self.moveit_config or "")

    def meshes(self, folder: InputFolder) -> ReadFile:
        """The reader of the meshes that its URDF names.

        Raises:
            ScenarioError: there is no such URDF, or it may not be read.
        """
        assert self.urdf is not None
        return self._files(folder).meshes(self.urdf)

    def _with_covers(self, folder: InputFolder) -> Self:
        """The table with covers of the URDF's links, made of their meshes, where no spheres are stated.

        Raises:
            ScenarioError: a mesh cannot be read or covered.
        """
        if self.urdf is None or self.urdf_text is None or self.spheres_text is not None or self.covers_text is not None:
            return self
        try:
            with self._named():
                read, ignored = self.meshes(folder), self.ignore_geometry or ()
                overhangs = (self.cover_overhang, self.fine_overhang)
                covers, notes = self.description().new_covers(read, *overhangs, ignored)
        except InvalidProblem as error:
            raise ScenarioError(f"robot.{error.field}: {error.reason}") from error
        for note in notes:
            LOG.warning("robot.urdf: link %r: mesh %s %s", note.link, note.file, note.note)
        return self.replaced(covers_text=covers_text(covers.values())) if covers else self

    def _with_looks(self, folder: InputFolder) -> Self:
        """The table with the appearance of the URDF's links; a note says which cannot be shown."""
        if self.urdf is None or self.urdf_text is None or self.looks_text is not None:
            return self
        try:
            description = self.description()
        except InvalidProblem:  # said when it is built
            return self
        appearances, notes = description.new_appearances(self.meshes(folder))
        if notes:
            each = "; ".join(f"{note.link!r}: {note.file and f'mesh {note.file}: '}{note.note}" for note in notes)
            LOG.warning("robot.urdf: not all links are drawn as the URDF shows them: %s", each)
        return self.replaced(looks_text=appearance_text(appearances)) if appearances else self

    def _read(self, folder: InputFolder, key: str) -> str:
        """The text of the file that a key names."""
        with named(f"robot.{key}"):
            files = self._files(folder)
            path = files.path(getattr(self, key))
            is_xacro, arguments = path.suffix == XACRO, self.xacro_arguments
            if is_xacro:
                text = expanded(path, arguments, files, all_known=key == "urdf")
            else:
                text = with_includes(path, read_text(path), files)
            if len(text) > LARGEST_TEXT:
                raise ScenarioError(f"{path}: longer than {LARGEST_TEXT} characters")
        return text

    @property
    def plugins(self) -> list[str]:
        """None: it names no class."""
        return []

    def build(self, carried: Sequence[Carried] = (), disabled: Sequence[tuple[str, str]] = ()) -> SpatialArm:
        """The robot itself, the same object for the same statement.

        Args:
            carried: bodies on its tool.
            disabled: names of links that may touch, besides those of ``disabled_pairs``.

        Raises:
            InvalidProblem: it cannot be; with a key of this table.
        """
        return _built(Statement(json.dumps(self.table()), self), tuple(carried), tuple(map(tuple, disabled)))

    def _made(self, carried: Sequence[Carried], disabled: Sequence[tuple[str, str]]) -> SpatialArm:
        with self._named():
            description = self.description()
            if len(description.chain.joints) > MOST_JOINTS:
                raise InvalidProblem(
                    "urdf", f"{len(description.chain.joints)} joints; at most {MOST_JOINTS} are planned"
                )
            if self.spheres_text is not None:
                description = description.with_spheres(read_spheres(self.spheres_text, description.links))
            description = description.carrying(carried, self._pose("tool"))
            stated = None if self.payload is None else self.payload.build()
            first = {"", *(tip.name for tip in description.chain.tips if tip.link == description.chain.tip_link)}
            on_tool = [part for part in carried if part.tip in first]
            arm = description.arm(
                max_speed=self.max_speed,
                max_acceleration=self.max_acceleration,
                max_jerk=self.max_jerk,
                position_limits=self.joint_limits,
                max_torque=self.max_torque,
                viscous_friction=self.viscous_friction,
                coulomb_friction=self.coulomb_friction,
                payload=stated if description.chain.torque_gap else payload_of(on_tool, stated),
                gravity=self.gravity,
                self_margin=self.self_margin,
                tracking=self._tracking,
                base=self._pose("base"),
                tool=self._pose("tool"),
            )
            may_touch = (*(self.disabled_pairs or ()), *disabled)
            complete = complete_arm(description, arm, may_touch, self.kept_pairs or (), self.ignore_geometry or ())
            weightless = [part.name for part in carried if part.mass is None and arm.max_torque is not None]
            unknown = tuple(f"the weight of {name}: no mass is stated" for name in weightless)
            left_out = replace(complete.left_out, others=(*complete.left_out.others, *unknown))
            arm = replace(complete, left_out=left_out, statement=self)
            return arm if self.tip is None else arm.with_tool_at(self.tip)

    @property
    def _tracking(self) -> dict[str, float | list[float]] | None:
        """The parts of the tracking error; a constant alone may be stated without its name."""
        stated = self.tracking_error
        if stated is None:
            return None
        return stated.table() if isinstance(stated, TrackingTable) else {"constant": stated}

    def in_radians(self) -> Self:
        """The table read as one in degrees.

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

    def for_stage(self, arm: str | None, keys: Mapping[str, Any]) -> Self:
        """The robot of a stage that states some keys anew, and whose tool is that of an arm, if one is named."""
        return self.replaced(**keys, **({} if arm is None else {"tip": arm}))

    def based_in(self, frames: KnownFrames) -> Self:
        """The robot whose base is stated in the world.

        Raises:
            InvalidTable: there is no frame of the name that its base states.
        """
        with at("base"):
            base = frames.in_world(self.base)
        return self if base is self.base else self.replaced(base=base)

    def standing(self, postures: Mapping[str, tuple[float, ...]]) -> Self:
        """The robot some of whose arms stand still at joints, rad or m, by the names of their tips.

        Raises:
            InvalidTable: joints off the planned ones stand in a named posture.
        """
        if isinstance(self.locked, str):
            raise InvalidTable("a posture by its name, beside an arm that stays: state the joints", "locked")
        chain = self.description().chain
        held = {
            chain.joints[joint].name: value
            for name, values in postures.items()
            for joint, value in zip(chain.branches[name], values, strict=True)
        }
        tips = {tip.name: tip.link for tip in chain.tips if tip.name not in postures}
        return self.replaced(locked=self.locked | held, tips=tips, group=None)

    def description(self) -> RobotDescription:
        """The description of the model or of the URDF, with the limits of the file that states some.

        Raises:
            InvalidProblem: it is none.
        """
        described = self._described()
        return described if self.limits_text is None else JointLimitsFile.read(self.limits_text).of(described)

    def _described(self) -> RobotDescription:
        if self.model is not None:
            if self.base_link is not None:
                raise InvalidProblem("base_link", "a robot that is built in has its own")
            if self.geometry is not None:
                raise InvalidProblem("geometry", "a robot that is built in has its own")
            if self.tips:
                raise InvalidProblem("tips", "a robot that is built in has one")
            return built_in(self.model, self.tip_link)
        if self.urdf_text is None:
            name = self.urdf or self.moveit_config
            raise InvalidProblem("urdf", f"{name!r} has not been read; only a scenario file can name one")
        for key, other in (("tip_link", self.tip_link), ("group", self.group)):
            if self.tips and other is not None:
                raise InvalidProblem("tips", f"beside {key}; one of both says what is planned")
        if self.group is not None and self.srdf_text is None:
            raise InvalidProblem("group", "of what? a group is one of an srdf")
        locked = self.locked if isinstance(self.locked, str) else tuple(sorted((self.locked or {}).items()))
        ends, group = (self.base_link, self.tip_link), (self.srdf_text, self.group)
        texts, tips = (self.looks_text, self.covers_text), tuple(self.tips.items())
        return _described_between(self.urdf_text, ends, tips, locked, group, self.geometry == "visual", *texts)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors name keys of this table."""
        try:
            yield
        except InvalidProblem as error:
            raise InvalidProblem(KEYS.get(error.field, error.field), error.reason) from error


@dataclass(frozen=True)
class Statement:
    """A table with all that it states as a text, by which it is known again."""

    text: str
    table: Any = field(compare=False)


@lru_cache(maxsize=CACHE_SIZE)
def _described_between(
    urdf: str,
    ends: tuple[str | None, str | None],
    tips: tuple[tuple[str, str], ...],
    locked: tuple[tuple[str, float], ...] | str,
    group: tuple[str | None, str | None],
    visual_geometry: bool,
    appearances: str | None,
    covers: str | None,
) -> RobotDescription:
    """The description of a robot between two links, to several tips, or of a group of an SRDF, as texts state it."""
    srdf = None if group[0] is None else read_srdf(group[0])
    held = locked if isinstance(locked, str) else dict(locked)
    description = read_urdf(urdf, *ends, held, srdf, group[1], visual_geometry, dict(tips))
    if appearances is not None:
        description = description.with_appearances(read_appearances(appearances))
    return description if covers is None else description.with_covers(read_covers(covers))


@lru_cache(maxsize=CACHE_SIZE)
def _built(statement: Statement, carried: tuple[Carried, ...], disabled: tuple[tuple[str, str], ...]) -> SpatialArm:
    table: SpatialRobotSection = statement.table
    return table._made(carried, disabled)

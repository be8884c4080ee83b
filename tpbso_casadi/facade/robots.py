"""Robots as arguments."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from problems import InvalidProblem, PlanarArm, Robot
from problems.base import FloatArray, at, did_you_mean, shown_value
from problems.robots import BUILT_IN, LinkCover, SpatialArm
from tpbso_casadi.facade.arguments import as_argument, check_keywords, in_words_of_python, several
from tpbso_casadi.reaching import ArmAmong, PoseLike
from tpbso_casadi.scenario import (
    BESIDE,
    OF_THE_MODEL,
    TITLES,
    AnyRobotTable,
    ArmSection,
    CellSection,
    FrameSection,
    InputFolder,
    KnownFrames,
    RobotSection,
    ScenarioError,
    SpatialRobotSection,
    arm_table,
    as_scenario_errors,
    is_folder,
    parse_scenario,
    plain,
    read_table,
    settings_table,
)

STANDS = {"kind": "recorded-motion"}  # a [task] that asks for nothing


@dataclass(frozen=True, eq=False)
class StatedRobot:
    """A robot with everything that states it, so that a plan can be stored and planned again.

    Attributes:
        table: the [arm] or [robot] table of a scenario, with the texts of the files that it names.
        kept: what a model of it keeps: ``margin`` and ``self_collision`` of a [model] table, and ``may_touch``.
    """

    table: AnyRobotTable
    kept: Mapping[str, Any] = field(default_factory=dict)

    @cached_property
    def model(self) -> Robot:
        """The symbolic robot: kinematics, limits, bodies.

        Raises:
            ScenarioError: it cannot be.
        """
        try:
            model = self.table.build()
        except InvalidProblem as error:
            raise ScenarioError(as_argument(f"{self.table.prefix}{error.field}: {error.reason}")) from error
        return replace(model, **self.kept)

    def based_in(self, frames: Sequence[FrameSection]) -> StatedRobot:
        """The robot whose base, or bases, are stated in the world.

        Raises:
            ScenarioError: there is no frame of the name that a base states.
        """
        if not isinstance(self.table, SpatialRobotSection | CellSection):
            return self
        with as_scenario_errors():
            known = KnownFrames.of(frames)
            with at(self.table.prefix.partition(".")[0]):
                table = self.table.based_in(known)
        return self if table is self.table else replace(self, table=table)

    @property
    def dof(self) -> int:
        """The number of joints."""
        return self.model.dof

    @property
    def cover(self) -> dict[str, LinkCover]:
        """The spheres that hold its links' meshes, boxes and cylinders, in the links' frames, by the links' names.

        Of each the ``coarse`` ones for searches and the ``fine`` ones for proofs: ``balls.centers`` (n, 3) and
        ``balls.radii`` (n,), m; ``usual_overhang`` and ``largest_overhang``, m: how far 95 % of their surface, and all
        of it, are from the link; ``volume_ratio``. Empty for a robot without meshes, or with spheres of its own.
        """
        described = self.table.description() if isinstance(self.table, SpatialRobotSection) else None
        return {} if described is None else {cover.link: cover for cover in described.covers}

    def among(self, obstacles: Sequence[Any] = (), *, tip: str | None = None) -> ArmAmong:
        """The robot among obstacles that stand still, of which one asks where it is and what it reaches.

        Args:
            obstacles: objects, or tables as in a scenario.
            tip: whose tool, of a cell or of a robot of several tips.

        Raises:
            ScenarioError: naming what is wrong.
        """
        with in_words_of_python():
            stated = parse_scenario(
                {**self.tables, "obstacles": plain(several("obstacles", obstacles, "obstacles")), "task": STANDS}
            )
            built = stated.built()
            return ArmAmong.of(built.robot, built.obstacles, tip)

    @cached_property
    def _alone(self) -> ArmAmong:
        return self.among()

    def forward(self, postures: ArrayLike) -> FloatArray:
        """The tool's poses in postures: :meth:`ArmAmong.forward`."""
        with in_words_of_python():
            return self._alone.forward(postures)

    def jacobian(self, postures: ArrayLike) -> FloatArray:
        """The tool's Jacobians in postures: :meth:`ArmAmong.jacobian`."""
        with in_words_of_python():
            return self._alone.jacobian(postures)

    def manipulability(self, postures: ArrayLike) -> FloatArray:
        """Yoshikawa's measure of postures: :meth:`ArmAmong.manipulability`."""
        with in_words_of_python():
            return self._alone.manipulability(postures)

    def clearance(self, postures: ArrayLike, obstacles: Sequence[Any] = ()) -> FloatArray:
        """The room that postures have among obstacles: :meth:`ArmAmong.clearance`."""
        with in_words_of_python():
            return (self._alone if _is_empty(obstacles) else self.among(obstacles)).clearance(postures)

    def base_clearance(self, obstacles: Sequence[Any]) -> float:
        """The distance from obstacles of links that no joint moves: :attr:`ArmAmong.base_clearance`."""
        return self.among(obstacles).base_clearance

    def inverse(
        self, pose: PoseLike | Sequence[PoseLike], *, clear_of: Sequence[Any] = (), **settings: Any
    ) -> FloatArray | list[FloatArray]:
        """Postures with the tool at a pose: :meth:`ArmAmong.inverse`, with its settings.

        Args:
            pose: one, or several.
            clear_of: obstacles; who asks often makes ``arm.among(obstacles)`` once.
            settings: ``near``, ``turns``, ``touching``, ``starts``.
        """
        with in_words_of_python():
            return (self._alone if _is_empty(clear_of) else self.among(clear_of)).inverse(pose, **settings)

    @property
    def tables(self) -> dict[str, Any]:
        """The tables of a scenario that state the robot: its own, and keys of [model] and beside the tables."""
        name = self.table.prefix.partition(".")[0]
        kept = {key: value for key, value in self.kept.items() if key in OF_THE_MODEL}
        beside = {key: plain(value) for key, value in self.kept.items() if key in BESIDE}
        return {name: self.table, "model": kept, **beside}

    def __repr__(self) -> str:
        try:
            self.model  # noqa: B018  # which is refused where the frame of its base is still to be given
        except ScenarioError as error:
            return f"<robot: {error}>"
        return f"<robot with {self.dof} joints, {'in space' if self.model.dim == 3 else 'in the plane'}>"


def _is_empty(obstacles: object) -> bool:
    return isinstance(obstacles, list | tuple) and not obstacles


AnyRobot: TypeAlias = StatedRobot | Robot | str | Path | Sequence[float] | FloatArray


def robot(model: AnyRobot, **keys: Any) -> StatedRobot:
    """A robot: built in, of a URDF, an MJCF or a configuration of MoveIt, or in the plane.

    Args:
        model: ``"panda"``, ``"ur5e"`` or ``"iiwa14"``; the path of a URDF or MJCF file, or of the folder of a
            configuration of MoveIt; the link lengths (k,) of a planar arm in m; a :class:`PlanarArm` or a robot of any
            other class, as an object; or a robot that :func:`robot` made.
        keys: of the [robot] table, or of [arm] for link lengths, such as ``max_speed`` (one number or one a joint,
            rad/s), ``max_acceleration`` (rad/s^2), ``max_jerk`` (rad/s^3), ``joint_limits`` (k pairs, rad),
            ``max_torque`` (N m), ``limits`` (a joint_limits.yaml), ``group``, ``spheres``, ``payload``.

    Raises:
        ScenarioError: naming the first wrong key, or a file that cannot be read.
    """
    with in_words_of_python():
        return _robot(model, keys)


def cell(robots: Mapping[str, AnyRobot]) -> StatedRobot:
    """Several robots in one cell, planned together as one robot.

    Args:
        robots: by their names, each as :func:`robot` makes it, with ``base`` where it stands. Joints and links of the
            cell are called ``NAME/JOINT`` and ``NAME/LINK``; starts and goals may be stated by the robots' names.

    Raises:
        ScenarioError: one is in the plane, or cannot be part of a cell.
        TypeError: they are not by names.
    """
    if not isinstance(robots, Mapping):
        raise TypeError(f"robots: a dict of robots by their names is needed, not {shown_value(robots)}")
    with in_words_of_python():
        tables = {}
        for name, each in robots.items():
            stated = _robot(each, {})
            if not isinstance(stated.table, SpatialRobotSection) or stated.kept:
                raise ScenarioError(f"robots.{name}: a robot in space is needed, without margin and may_touch")
            tables[name] = {key: getattr(stated.table, key) for key in stated.table.stated_keys}
        return StatedRobot(read_table(CellSection, "robots", tables))


def _robot(model: AnyRobot, keys: dict[str, Any]) -> StatedRobot:
    if isinstance(model, StatedRobot | Robot):
        if keys:
            raise ScenarioError(f"{next(iter(keys))}: the robot is complete; give its limits where it is made")
        return model if isinstance(model, StatedRobot) else _stated(model)
    if isinstance(model, str | Path):
        check_keywords(keys, SpatialRobotSection.schema())
        section = read_table(SpatialRobotSection, "robot", plain(robot_key(str(model)) | keys))
        return StatedRobot(section.with_files(InputFolder(Path(), outside_allowed=True)))
    check_keywords(keys, ArmSection.schema())
    return StatedRobot(read_table(ArmSection, "arm", {"link_lengths": plain(model), **plain(keys)}))


def robot_key(model: str) -> dict[str, Any]:
    """The key that names a robot in space.

    Raises:
        ScenarioError: it is neither built in nor a file nor a folder.
    """
    if model in BUILT_IN:
        return {"model": model}
    if is_folder(model):
        return {"moveit_config": model}
    if not Path(model).suffix:
        known = [*BUILT_IN, *TITLES]
        reason = "is no robot, no scenario and no file; built in are the robots"
        raise ScenarioError(f"{model!r}: {reason} {', '.join(BUILT_IN)}{did_you_mean(model, known)}")
    return {"urdf": model}


def _stated(model: Robot) -> StatedRobot:
    """A robot which is there already.

    Raises:
        ScenarioError: only a description can state it.
    """
    plain_model = replace(model, margin=0.0, self_collision=False, may_touch=())
    kept = {
        key: getattr(model, key) for key in (*OF_THE_MODEL, *BESIDE) if getattr(model, key) != getattr(plain_model, key)
    }
    state = ROBOT_TABLES.get(type(model), _by_class)
    return StatedRobot(state(plain_model), kept)


def _planar(model: PlanarArm) -> ArmSection:
    return read_table(ArmSection, "arm", arm_table(model))


def _in_space(model: SpatialArm) -> AnyRobotTable:
    table: SpatialRobotSection | CellSection | None = model.statement
    if table is None or table.build() != model:  # another limit than the description has, say
        raise ScenarioError("robot: say tp.robot('panda') or tp.robot('arm.urdf'): a plan keeps the description")
    return table


def _by_class(model: Robot) -> RobotSection:
    return read_table(RobotSection, "robot", settings_table(model))


ROBOT_TABLES: dict[type[Robot], Callable[[Any], AnyRobotTable]] = {PlanarArm: _planar, SpatialArm: _in_space}

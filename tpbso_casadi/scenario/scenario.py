"""A scenario: all that a file states, checked as a whole, and the robot, scene and problem that it builds.

Every error is one line that names the key and the reason.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from typing import Annotated, Any, NamedTuple, Self, TypeVar

import numpy as np

from problems import InvalidProblem, Joints, Obstacle, Problem, Robot
from problems.assembly import Criteria
from problems.base import Count, InvalidTable, at
from tpbso_casadi.scenario.carried import (
    MOST_CARRIED,
    CarriedSection,
    Contacts,
    carried_bodies,
    own_contacts,
    with_contacts,
)
from tpbso_casadi.scenario.catalogues import LIMIT_CATALOGUE, OBJECTIVE_CATALOGUE, ROBOT_CATALOGUE, SOLVER_CATALOGUE
from tpbso_casadi.scenario.cell_robots import CellSection
from tpbso_casadi.scenario.constraints import HandSection, OwnConstraints
from tpbso_casadi.scenario.expressions import check_names
from tpbso_casadi.scenario.frames import FRAMES, AnyFrames, KnownFrames
from tpbso_casadi.scenario.layout_section import LayoutSection
from tpbso_casadi.scenario.model import ModelSection, with_motion
from tpbso_casadi.scenario.named_places import ArmOfRobot, KnownNames, StandingArms
from tpbso_casadi.scenario.obstacles import SHAPE_CATALOGUE, AnyObstacle, build_obstacles
from tpbso_casadi.scenario.places import SimulationSection
from tpbso_casadi.scenario.plugin_failures import plugin_failures_named
from tpbso_casadi.scenario.robots import AnyRobot, AnyRobotTable, ArmSection
from tpbso_casadi.scenario.solver_section import SolverSection
from tpbso_casadi.scenario.spatial_robots import SpatialRobotSection
from tpbso_casadi.scenario.tasks import TASKS, AnyTask
from tpbso_casadi.scenario.validation import MOST_OBSTACLES, FileSection, ScenarioError

LOG = logging.getLogger(__name__)
C = TypeVar("C")
ROBOTS = ("arm", "robot", "robots")  # tables of which one states what moves
CARRIED = "carried"  # a field of robots that is no key of their tables


class BuiltScene(NamedTuple):
    """A robot in its surroundings.

    Attributes:
        robot: with what it carries and keeps.
        obstacles: around it.
        model: the form of the model.
    """

    robot: Robot
    obstacles: tuple[Obstacle, ...]
    model: ModelSection


class Scenario(FileSection):
    """A whole scenario file."""

    arm: ArmSection | None = None
    robot: AnyRobot | None = None
    robots: CellSection | None = None
    task: AnyTask
    frames: AnyFrames = field(default_factory=list)
    obstacles: Annotated[list[AnyObstacle], Count(0, MOST_OBSTACLES)] = field(default_factory=list)
    scene: Annotated[str, Count(1, 1000)] | None = None
    carried: Annotated[list[CarriedSection], Count(0, MOST_CARRIED)] = field(default_factory=list)
    may_touch: Contacts = field(default_factory=list)
    model: ModelSection = ModelSection()
    constraints: OwnConstraints = field(default_factory=list)
    solver: SolverSection = SolverSection()
    simulation: SimulationSection | None = None
    layout: LayoutSection | None = None

    def __repr__(self) -> str:
        chosen = self.task.stated_objective
        objective = chosen if isinstance(chosen, str) else " + ".join(f"{w:g} {name}" for name, w in chosen.items())
        parts = [self.robot_table.title, self.task.kind, *filter(None, [objective])]
        parts += [f"{len(self.obstacles)} obstacle{'s' * (len(self.obstacles) > 1)}"] * bool(self.obstacles)
        polished = f"+polish{self.solver.polish_starts}" if self.solver.polish_starts else ""
        searched = [f"{self.solver.name}{polished}", f"seed {self.solver.seed}"] if self.task.has_solver else []
        return f"<scenario: {', '.join([*parts, *searched])}>"

    __str__ = __repr__

    def table(self) -> dict[str, Any]:
        content = super().table()
        for key in ("robots", "simulation", "layout", "scene", "carried", "may_touch", "constraints", FRAMES):
            if not getattr(self, key):
                content.pop(key, None)  # which is not there where tables are chosen
        return content

    @property
    def plugins(self) -> list[str]:
        """The names of plug-ins that the scenario uses, which may raise anything."""
        objective = self.task.stated_objective
        minimised = [objective] if isinstance(objective, str) else list(objective)
        named = [self.task.kind, *minimised, *self.model.limits, self.solver.name]
        named += [] if self.robot is None else self.robot.plugins
        named += [obstacle.shape for obstacle in self.obstacles]
        named = [str(name) for name in named]
        ours = {
            *TASKS,
            *OBJECTIVE_CATALOGUE.registry,
            *LIMIT_CATALOGUE.registry,
            *ROBOT_CATALOGUE.registry,
            *SHAPE_CATALOGUE.registry,
        }
        ours |= {"path", *SOLVER_CATALOGUE.registry, *self.task.own_objectives}
        return [name for name in named if name and name not in ours]

    @classmethod
    def from_table(cls, content: Any) -> Self:
        return super().from_table(content)._completed()

    def check(self) -> None:
        stated = [key for key in ROBOTS if getattr(self, key) is not None]
        if not stated:
            raise InvalidTable("missing key", "arm")
        if len(stated) > 1:
            raise InvalidTable(f"the robot is stated twice, as [{stated[0]}] and as [{stated[1]}]", stated[1])
        if self.frames and self.arm is not None:
            raise InvalidTable("of robots in space alone", FRAMES)
        if not self.task.has_solver and self.solver != SolverSection():
            raise InvalidTable(f"{self.task.kind!r} is timed; there is nothing to search for, leave it out", "solver")

    def _completed(self) -> Self:
        """The scenario whose [model] says all that depends on task and robot, and holds the [[constraints]]."""
        table, model = self.robot_table, with_motion(self.model, self.task)
        usual = {"self_collision": table.avoids_itself, "samples": table.usual_samples}
        model = model.filled_in(**{key: value for key, value in usual.items() if key not in model.stated_keys})
        if not self.constraints:
            return self.filled_in(model=model)
        with at("constraints"):
            own = check_names([*model.constraints, *self.constraints])
        return self.replaced(model=model.replaced(constraints=own), constraints=[])

    def with_postures(self) -> Self:
        """The scenario, which is in rad, with places in place of named ones, in the world, and arms that stay standing.

        Raises:
            InvalidTable: the robot's files name none of these postures, no arm or frame has such a name, or the place
                of an arm is not stated.
        """
        try:
            names = self._names
        except InvalidProblem:  # said when the robot is built
            return self
        names = replace(names, frames=self._known_frames(names))
        with at("task"):
            standing = StandingArms.of(self.task, names)
        if standing is not None:
            assert isinstance(self.robot_table, SpatialRobotSection | CellSection)
            robot = self.robot_table.standing(standing.postures)
            return self.replaced(**{"task": standing.task, self.robot_key: robot}).with_postures()
        parts, found = {"task": self.task, "simulation": self.simulation}, {}
        for key, part in parts.items():
            with at(key):
                found[key] = names.resolved(part)
        changed = {key: part for key, part in found.items() if part != parts[key]}
        return self.replaced(**changed, **self._surroundings_in_world(names.frames))

    def _known_frames(self, names: KnownNames) -> KnownFrames:
        """The frames by their names, none of which is that of an arm."""
        frames, arms = KnownFrames.of(self.frames), {*names.arms, *(self.robots.robots if self.robots else ())}
        for number, frame in enumerate(self.frames):
            if frame.name in arms:
                raise InvalidTable(f"an arm is called {frame.name!r}: rename the frame", FRAMES, number, "name")
        return frames

    def _surroundings_in_world(self, frames: KnownFrames) -> dict[str, Any]:
        """Obstacles and bases that are stated in frames as they are in the world, by their keys, and no frames.

        Keys are left out whose tables are in the world.
        """
        found: dict[str, Any] = {} if not self.frames else {FRAMES: []}
        if any(obstacle.frame is not None for obstacle in self.obstacles):
            found["obstacles"] = frames.all_in_world(self.obstacles, "obstacles")
        if isinstance(self.robot_table, SpatialRobotSection | CellSection):
            with at(self.robot_key):
                robot = self.robot_table.based_in(frames)
            found |= {} if robot is self.robot_table else {self.robot_key: robot}
        return found

    @property
    def _names(self) -> KnownNames:
        """The names that the robot gives to postures and to its arms."""
        if self.robots is not None:
            return self.robots.names()
        if isinstance(self.robot, SpatialRobotSection):
            described = self.robot.description()
            arms = {
                name: ArmOfRobot(own, {key: tuple(q[j] for j in own) for key, q in described.postures.items()})
                for name, own in described.chain.branches.items()
            }
            return KnownNames(described.postures, arms, len(described.chain.joints))
        return KnownNames({}, {}, 0)

    @property
    def robot_key(self) -> str:
        """The key of the table that states what moves."""
        return next(key for key in ROBOTS if getattr(self, key) is not None)

    @property
    def robot_table(self) -> AnyRobotTable:
        """The table that states what moves."""
        table: AnyRobotTable = getattr(self, self.robot_key)
        return table

    def problem(self) -> Problem[Any]:
        """The problem that the scenario states.

        Raises:
            ScenarioError: the robot cannot do the task, it is larger than what is planned, or a plug-in failed.
        """
        with plugin_failures_named(self):
            return self._stated(self.task.build)

    def criteria(self) -> Criteria:
        """The criteria of a motion.

        Raises:
            ScenarioError: as :meth:`problem`.
        """
        with plugin_failures_named(self):
            return self._stated(self.task.criteria)

    def judged(self) -> Criteria:
        """The criteria of a finished motion, without the parts that only a search needs.

        Raises:
            ScenarioError: as :meth:`problem`.
        """
        with plugin_failures_named(self):
            return self._stated(self.task.judged)

    def built(self) -> BuiltScene:
        """The robot, what is around it, and the form of the model, built once for tasks that are judged one by one.

        Raises:
            ScenarioError: as :meth:`problem`.
        """
        with plugin_failures_named(self):
            return self._stated(BuiltScene)

    def _stated(self, build: Callable[[Robot, tuple[Obstacle, ...], ModelSection], C]) -> C:
        began = time.perf_counter()
        robot = self._built_robot()
        if self.frames:
            raise ScenarioError(f"{FRAMES}: of a scenario as it is stated; with_postures() resolves them")
        self.model.check_size(robot.dof)
        obstacles = build_obstacles(self.obstacles, robot.dof)
        robot = self._with_contacts(robot, obstacles)
        tables = {**dict.fromkeys(("link_lengths", "joint_limits"), self.robot_table.prefix), "obstacles": ""}
        tables |= dict.fromkeys(ModelSection.schema(), "model.")
        try:
            if self.robots is not None:
                self.robots.check_standing(obstacles, self.model.kept_by, robot)
            robot = self.model.kept_by(robot)
            stated = build(robot, obstacles, self._model_from_start(robot))
            LOG.info("model: %d joints, %d obstacles in %.3f s", robot.dof, len(obstacles), time.perf_counter() - began)
            return stated
        except InvalidProblem as error:
            first = error.field.partition(".")[0]
            is_robot = self.robots is not None and first in self.robots.robots
            table = self.robot_table.prefix if is_robot else tables.get(first, "task.")
            raise ScenarioError(f"{table}{error.field}: {error.reason}") from error

    def _model_from_start(self, robot: Robot) -> ModelSection:
        """The form of the model, with what arms hold together as they do at a start that is stated by joints."""
        start = getattr(self.task, "start", None)
        if not isinstance(start, Joints) or len(start.values) != robot.dof:
            return self.model
        theta, held = np.array(start.values, dtype=np.float64), list(self.model.constraints)
        for number, section in enumerate(held):
            if isinstance(section, HandSection):
                try:
                    held[number] = section.from_posture(robot, theta)
                except InvalidProblem as error:
                    where = error.field if error.field == "constraints" else f"constraints.{number}.{error.field}"
                    raise InvalidProblem(where, error.reason) from error
        return self.model if held == self.model.constraints else self.model.replaced(constraints=held)

    def _with_contacts(self, robot: Robot, obstacles: Sequence[Obstacle]) -> Robot:
        """The robot that may touch what ``may_touch`` says, of itself and of obstacles."""
        allowed = with_contacts(robot, self.may_touch, obstacles)
        own = own_contacts(self.may_touch, obstacles)
        if own and not isinstance(self.robot_table, SpatialRobotSection | CellSection):
            raise ScenarioError("may_touch: two bodies of the robot itself: of robots in space alone")
        return replace(self._built_robot(own), may_touch=allowed.may_touch) if own else allowed

    def _built_robot(self, may_touch: Sequence[tuple[str, str]] = ()) -> Robot:
        """The robot with what it carries.

        Args:
            may_touch: names of bodies of its own.
        """
        table = self.robot_table
        try:
            if isinstance(table, SpatialRobotSection | CellSection):
                return table.build(carried_bodies(self.carried), may_touch)
            if self.carried:
                raise ScenarioError("carried: of robots in space alone")
            return table.build()
        except InvalidProblem as error:
            key = error.field if error.field.startswith(CARRIED) else f"{table.prefix}{error.field}"
            raise ScenarioError(f"{key}: {error.reason}") from error

"""What is where while a sequence goes on, and what its motion is judged by, stage by stage."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any, Self

import casadi as ca
import numpy as np

from problems import InvalidProblem, Joints, MovingObstacle, Obstacle, Robot, Tabulated, Trajectory
from problems.assembly import Criteria, MotionStage, SequenceCriteria
from problems.base import FloatArray, as_array, did_you_mean, rotation_of
from problems.objectives import OBJECTIVES
from problems.robots import SpatialArm, as_point, quaternions_of
from problems.tasks import Sequence as StagedTask
from tpbso_casadi.scenario.carried import CarriedSection
from tpbso_casadi.scenario.led_stages import tool_frames
from tpbso_casadi.scenario.moves import PointToPointTask
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.obstacles import build_obstacles
from tpbso_casadi.scenario.plugin_failures import plugin_failures_named
from tpbso_casadi.scenario.scenario import BuiltScene, Scenario
from tpbso_casadi.scenario.sequence import SequenceTask
from tpbso_casadi.scenario.stage_section import MovingStage, StageSection
from tpbso_casadi.scenario.stages import AttachStage, OutputStage
from tpbso_casadi.scenario.validation import ScenarioError

ENDS = "stage_ends"  # the quantity of a plan that says when its stages end, s
SAME_TIME = 1e-9  # s, or rad/s of what stands: rounding
PICTURES = 400  # times at which what is carried is placed for a picture


def criteria_of(scenario: Scenario, trajectory: Trajectory, quantities: Mapping[str, FloatArray]) -> Criteria:
    """The criteria that judge a known motion of a scenario.

    Args:
        scenario: of the motion.
        trajectory: the motion.
        quantities: that are stored with it: of a sequence, when its stages end.

    Raises:
        ScenarioError: as :meth:`Scenario.problem`; of a sequence, when its stages end is not said, or is impossible.
    """
    if not isinstance(scenario.task, SequenceTask):
        return scenario.criteria()
    with plugin_failures_named(scenario):
        return _criteria_of_sequence(scenario, scenario.task, trajectory, quantities)


def _criteria_of_sequence(
    scenario: Scenario, task: SequenceTask, trajectory: Trajectory, quantities: Mapping[str, FloatArray]
) -> SequenceCriteria:
    times = stage_times(task, trajectory, quantities)
    for number, (numbers, stage) in enumerate(task.legs):
        if not stage.moves and not _stands(trajectory, times[number], times[number + 1], stage.pause):
            raise ScenarioError(f"task.stages.{numbers[-1]}: the arm does not stand for {stage.pause:g} s, {ENDS}")
    return judged_by_stage(scenario, trajectory, np.minimum(times[1:], trajectory.duration))


def stage_times(task: SequenceTask, trajectory: Trajectory, quantities: Mapping[str, FloatArray]) -> FloatArray:
    """When the stages of a motion begin, and the last one ends, (n + 1,), s.

    Raises:
        ScenarioError: when its stages end is not said, or is impossible.
    """
    ends = np.asarray(quantities.get(ENDS, ()))
    times = np.append(0.0, ends)
    if (
        ends.shape != (len(task.legs),)
        or (np.diff(times) < 0.0).any()
        or abs(times[-1] - trajectory.duration) > SAME_TIME
    ):
        raise ScenarioError(f"task.stages: {len(task.legs)} increasing times are needed, {ENDS}")
    return times


def _stands(trajectory: Trajectory, start: float, end: float, seconds: float) -> bool:
    """Whether the joints stand from one time to another, s, and for so long."""
    if not abs(end - start - seconds) <= SAME_TIME:
        return False
    if not seconds:
        return True
    standing = trajectory.part(start, min(end, trajectory.duration))
    return bool(np.abs(standing.at(standing.extreme_times(1), 1)).max() <= SAME_TIME)


@dataclass(frozen=True)
class Cell:
    """The robot, and everything around it and in its hand, at one moment of a sequence.

    Attributes:
        scenario: of the sequence.
        robot: with an empty hand.
        obstacles: that stand around.
        carried: by the tool.
        contacts: pairs of names of what has been taken up and of what it may touch.
        digits: to which it is said where a body is taken up, m; None for exactly. What is made of robots that carry the
            same to these digits is made once.
    """

    scenario: Scenario
    robot: Robot
    obstacles: tuple[ObstacleSection, ...]
    carried: tuple[CarriedSection, ...]
    contacts: tuple[tuple[str, str], ...] = ()
    digits: int | None = None

    @classmethod
    def at_first(cls, scenario: Scenario, digits: int | None = None) -> Self:
        """The cell as the scenario states it.

        Args:
            scenario: of a sequence.
            digits: as of the attribute.

        Raises:
            ScenarioError: something moves by itself.
        """
        for number, obstacle in enumerate(scenario.obstacles):
            if obstacle.moves:
                raise ScenarioError(f"obstacles.{number}: moves; in a sequence obstacles stand still")
        obstacles, carried = tuple(scenario.obstacles), tuple(scenario.carried)
        return cls(scenario, scenario.robot_table.build(), obstacles, carried, digits=digits)

    def attached(self, stage: AttachStage, posture: FloatArray) -> Self:
        """The cell with a body in the hand: an obstacle as it lies, or one that is stated in the tool's frame.

        Raises:
            ScenarioError: there is no such obstacle, or one is carried by that name already.
        """
        name, mass, body = stage.name, stage.mass, stage.body
        if name in [held.name for held in self.carried]:
            raise ScenarioError(f"name: {name!r} is carried already")
        self._check_names(stage.touch)
        contacts = (*self.contacts, *((name, other) for other in stage.touch))
        if body is not None:
            held = CarriedSection(mass=mass, arm=stage.arm, body=body)
            return replace(self, carried=(*self.carried, held), contacts=contacts)
        index = self._index(name, [obstacle.name for obstacle in self.obstacles], "obstacle")
        taken = self.obstacles[index]
        pose = np.linalg.solve(self._tool(posture, stage.arm), _pose_of(taken))
        body = _posed(taken, pose if self.digits is None else np.round(pose, self.digits) + 0.0)
        others = (*self.obstacles[:index], *self.obstacles[index + 1 :])
        held = CarriedSection(mass=mass, arm=stage.arm, body=body)
        held.build()  # which raises where it cannot be carried
        return replace(self, obstacles=others, carried=(*self.carried, held), contacts=contacts)

    def detached(self, name: str, posture: FloatArray) -> Self:
        """The cell with a body that was carried standing where it is now.

        Raises:
            ScenarioError: nothing of that name is carried.
        """
        index = self._index(name, [held.name for held in self.carried], "carried body")
        held = self.carried[index].body
        body = _posed(held, self._tool(posture, self.carried[index].arm) @ _pose_of(held))
        others = (*self.carried[:index], *self.carried[index + 1 :])
        contacts = tuple(pair for pair in self.contacts if pair[0] != name)
        return replace(self, obstacles=(*self.obstacles, body), carried=others, contacts=contacts)

    def _check_names(self, names: Sequence[str]) -> None:
        """Check that there is a link, an obstacle or something carried of each name; else a ScenarioError."""
        around, held = ([each.name for each in bodies if each.name] for bodies in (self.obstacles, self.carried))
        known = [*self.robot.bodies.names, *around, *held]
        for number, name in enumerate(names):
            if name not in known:
                reason = f"nothing is called {name!r}{did_you_mean(name, known)}; there are {', '.join(known)}"
                raise ScenarioError(f"touch.{number}: {reason}")

    @staticmethod
    def _index(name: str, names: Sequence[str], what: str) -> int:
        if name not in names:
            known = ", ".join(filter(None, names)) or "none with a name"
            raise ScenarioError(f"name: no {what} is called {name!r}{did_you_mean(name, names)}; there is {known}")
        if list(names).count(name) > 1:
            raise ScenarioError(f"name: {names.count(name)} are called {name!r}; each needs a name of its own")
        return names.index(name)

    def seen_by(self, stage: StageSection) -> Self:
        """The cell whose robot has the tool of the arm that a stage moves.

        Raises:
            InvalidProblem: the robot has no such arm.
        """
        arm = stage.arm if isinstance(stage, MovingStage) else None
        return self if arm is None else replace(self, robot=_with_tool_of(self.robot, arm))

    def _tool(self, posture: FloatArray, arm: str | None) -> FloatArray:
        """The frame of the tool, of an arm where one is named, in a posture (dof,), (4, 4)."""
        return np.asarray(self.tools(posture[None], arm)[0])

    def tools(self, postures: FloatArray, arm: str | None) -> FloatArray:
        """Frames of the tool, of an arm where one is named, in postures (n, dof): (n, 4, 4).

        Raises:
            InvalidProblem: a robot in the plane, which carries nothing.
        """
        if not isinstance(self.robot, SpatialArm):
            raise InvalidProblem("name", "in the plane nothing is carried")
        return tool_frames(self.robot if arm is None else _with_tool_of(self.robot, arm), postures)

    def statement(self, stage: MovingStage, posture: FloatArray, goal: Any = None) -> Scenario:
        """The stage as a scenario of its own, a move from a posture (dof,).

        Args:
            stage: that is stated.
            posture: in which it begins.
            goal: in which posture it ends, (dof,); as the stage says where None.

        Raises:
            InvalidProblem: the stage cannot begin there.
        """
        robot, during = self.robot, self._during(stage)
        goals = stage.goals_from(robot, posture) if goal is None else Joints(tuple(map(float, goal)), turns="exact")
        start = Joints(tuple(map(float, posture)))
        task = PointToPointTask(kind="point-to-point", start=start, goal=goals, via=stage.vias_from(robot, posture))
        further = [*during.model.constraints, *stage.constraints, *stage.further_constraints(robot, posture)]
        solver = during.solver
        if "name" not in solver.stated_keys:
            solver = solver.replaced(name=during.robot_table.usual_solver)
        return during.replaced(task=task, model=during.model.replaced(constraints=further), solver=solver)

    def _during(self, stage: MovingStage) -> Scenario:
        """The scenario with the robot, what it carries, what is around it and may be touched during a stage."""
        scenario = self.scenario
        margin = scenario.model.margin if stage.margin is None else stage.margin
        stated = (*scenario.may_touch, *self.contacts, *stage.may_touch)
        pairs = [pair for pair in stated if self._concerns(pair)]
        return scenario.replaced(
            **{scenario.robot_key: scenario.robot_table.for_stage(stage.arm, stage.of_the_robot)},
            obstacles=list(self.obstacles),
            carried=list(self.carried),
            may_touch=list(dict.fromkeys(map(tuple, pairs))),
            model=scenario.model.replaced(margin=margin),
        )

    def scene(self, stage: MovingStage) -> BuiltScene:
        """The robot with what it carries during a stage, and what it keeps clear of.

        Raises:
            ScenarioError: the robot cannot be.
        """
        return self._during(stage).built()

    def _concerns(self, pair: Sequence[str]) -> bool:
        """Whether a contact is one of the robot, as long as what it names stands around or is carried."""
        return sum(name in [obstacle.name for obstacle in self.obstacles] for name in pair) < 2


def _with_tool_of(robot: Robot, arm: str) -> SpatialArm:
    """The robot with the tool of one of its arms.

    Raises:
        InvalidProblem: it has no such arm.
    """
    if not isinstance(robot, SpatialArm):
        raise InvalidProblem("arm", "there is one arm alone, which has no name; leave it out")
    return robot.with_tool_at(arm)


def _posed(body: ObstacleSection, pose: Any) -> ObstacleSection:
    """A body moved to another frame.

    Args:
        body: a solid in space, or one of a file.
        pose: its new frame, (4, 4).

    Raises:
        ScenarioError: it has no pose.
    """
    x, y, z, w = map(float, quaternions_of(pose[:3, :3].reshape(1, 9))[0])
    return body.posed(as_point(pose[:3, 3]), (x, y, z, w))


def _pose_of(body: ObstacleSection) -> FloatArray:
    """The frame of a body in space, (4, 4)."""
    center, quaternion = body.pose
    pose = np.eye(4)
    pose[:3, 3] = center
    if quaternion is not None:
        pose[:3, :3] = rotation_of(quaternion)
    return pose


def walked(
    scenario: Scenario, postures: Iterable[FloatArray], first: Cell | None = None
) -> Iterator[tuple[StageSection, Cell]]:
    """The stages of a sequence, each with what is where when it begins.

    Args:
        scenario: of the sequence.
        postures: with which the stages begin, (dof,) each; no more are taken than stages are asked for.
        first: what is where at first; as the scenario states it where None.

    Raises:
        ScenarioError: something is taken up that is not there, or put down that is not held.
    """
    task = scenario.task
    assert isinstance(task, SequenceTask)
    cell = first or Cell.at_first(scenario)
    for (numbers, stage), posture in zip(task.legs, postures, strict=True):
        with _of_stage(numbers[-1]):
            seen = cell.seen_by(stage)
        yield stage, seen
        with _of_stage(numbers[-1]):
            cell = stage.changed(cell, posture)


@contextmanager
def _of_stage(number: int) -> Iterator[None]:
    """Errors name the key of a stage."""
    try:
        yield
    except (ScenarioError, InvalidProblem) as error:
        raise ScenarioError(f"task.stages.{number}.{error}") from error


def judged_by_stage(scenario: Scenario, trajectory: Trajectory, ends: FloatArray) -> SequenceCriteria:
    """The criteria of a motion whose stages end at times (n,), s."""
    times = np.append(0.0, ends)
    postures = trajectory.at(times)
    stages, labels = [], scenario.task.labels  # type: ignore[attr-defined]
    cells = []
    for number, (stage, cell) in enumerate(walked(scenario, postures[:-1])):
        cells.append(cell)
        signal = (stage.signal, stage.value) if isinstance(stage, OutputStage) else None
        criteria = cell.statement(stage, postures[number]).judged() if isinstance(stage, MovingStage) else None
        stages.append(MotionStage(labels[number], stage.kind, times[number], times[number + 1], criteria, signal))
    first = Cell.at_first(scenario)
    robot = scenario.model.kept_by(first.robot)
    tools = as_array(robot.tool.position(ca.DM(postures)))
    moved = [0, *(number + 1 for number, stage in enumerate(stages) if stage.criteria is not None)]
    stops = tuple(tuple(tools[number].tolist()) for number in moved)
    obstacles = build_obstacles(list(scenario.obstacles), robot.dof)
    notes = []
    for one, (_, leg) in zip(stages, scenario.task.legs, strict=True):  # type: ignore[attr-defined]
        if one.criteria is not None:
            notes += [f"{one.label}: {note}" for note in (leg.note, *one.criteria.task.notes) if note]
    task = StagedTask(robot, obstacles, stops, shown_around(first, cells, trajectory, times), tuple(notes))
    return SequenceCriteria(task=task, objective=OBJECTIVES["time"], limits=(), stages=tuple(stages))


def shown_around(first: Cell, cells: Sequence[Cell], trajectory: Trajectory, times: FloatArray) -> tuple[Obstacle, ...]:
    """Everything around an arm in a picture; what is carried for a while moves.

    Args:
        first: what is where at first, with the whole robot.
        cells: what is where during each stage, (n,).
        trajectory: of all stages.
        times: when they begin, and when the last ends, (n + 1,), s.
    """
    held = {body.name: body.body for cell in cells for body in cell.carried}
    standing = [obstacle for obstacle in first.obstacles if obstacle.name not in held]
    dof = trajectory.coefficients.shape[2]
    shown = build_obstacles(standing, dof)
    if not held:
        return shown
    rows = np.unique(np.concatenate([times, np.linspace(0.0, times[-1], PICTURES)]))
    arms = {body.arm for cell in cells for body in cell.carried}
    tools = {arm: first.tools(trajectory.at(rows), arm) for arm in arms}
    at = np.clip(np.searchsorted(times, rows, side="right") - 1, 0, len(cells) - 1)
    for number, name in enumerate(held, start=len(standing) + 1):
        frames = _frames_of(name, [cells[index] for index in at], tools)
        moved = frames @ np.linalg.inv(frames[0])
        quaternions = quaternions_of(moved[:, :3, :3].reshape(-1, 9))
        motion = Tabulated.through(rows.tolist(), moved[:, :3, 3], quaternions)
        still = _posed(held[name], frames[0])
        shown += tuple(MovingObstacle(part, motion) for part in still.built(number))
    return shown


def _frames_of(name: str, cells: Sequence[Cell], tools: Mapping[str | None, FloatArray]) -> FloatArray:
    """The frames of a body, in the hand or standing, at n moments, (n, 4, 4); before it is there, its first one."""
    found: list[FloatArray | None] = []
    for number, cell in enumerate(cells):
        body = next((obstacle for obstacle in cell.obstacles if obstacle.name == name), None)
        held = next((held for held in cell.carried if held.name == name), None)
        if held is not None:
            found.append(tools[held.arm][number] @ _pose_of(held.body))
        else:
            found.append(None if body is None else _pose_of(body))
    first = next(frame for frame in found if frame is not None)
    return np.array([first if frame is None else frame for frame in found])

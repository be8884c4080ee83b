"""A third kind of problem, with nothing but what every problem must have: from posture to posture in a chosen time.

A task, a family of motions, an encoding and their assembly, each of the fewest lines.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

import casadi as ca
import numpy as np

from problems import OBJECTIVES, Constraint, Problem, Robot, Trajectory, Variable
from problems.assembly import CostSteps, Criteria, Decoded, Encoding, FeasibilityFirst
from problems.base import FloatArray, Matrix
from problems.certify import safe_time_scale
from problems.evaluation import Step
from problems.limits import Limit, limits_of
from problems.motions import Motion, SampleGrid, Samples
from problems.objectives import MotionBounds
from problems.programs import NonlinearProgram
from problems.scene import Obstacle
from problems.tasks import Task
from tpbso_casadi.scenario import ModelSection, TaskSection

MIN_DURATION, MAX_DURATION = 0.1, 10.0  # s
PHASE = np.linspace(0.0, 1.0, 41)
BLEND = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])  # of the phase, lowest power first; at rest at both ends


@dataclass(frozen=True)
class JointMove(Task):
    """Move all joints from one posture to another, rad."""

    numbers: ClassVar[tuple[str, ...]] = ("start", "goal")

    robot: Robot
    start: tuple[float, ...]
    goal: tuple[float, ...]
    obstacles: tuple[Obstacle, ...] = ()

    def conditions(self, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
        return []


@dataclass(frozen=True)
class Blend(Motion[Matrix]):
    """All joints along one polynomial; the parameter is the duration, s."""

    robot: Robot
    task: JointMove

    def samples(self, parameters: Matrix) -> Samples:
        start, change = ca.horzcat(*self.task.start), ca.horzcat(*self.task.goal) - ca.horzcat(*self.task.start)
        values = [ca.mtimes(ca.DM(column), change) / parameters**n for n, column in enumerate(self.grid.rows.T)]
        values[0] = values[0] + ca.repmat(start, len(PHASE), 1)
        return Samples(robot=self.robot, derivatives=tuple(values), duration=parameters)

    @cached_property
    def grid(self) -> SampleGrid:
        blend = np.polynomial.Polynomial(BLEND)
        rows = np.column_stack([blend.deriv(n)(PHASE) if n else blend(PHASE) for n in self.orders])
        return SampleGrid(rows=rows, pieces=np.zeros(len(PHASE), dtype=np.intp))

    def blocks(self, parameters: Matrix, orders: tuple[int, ...]) -> Matrix:
        start, goal = ca.vertcat(*self.task.start), ca.vertcat(*self.task.goal)
        return ca.vertcat(start, *((goal - start) / parameters**n for n in orders))

    def piece_sizes(self, orders: tuple[int, ...]) -> tuple[int, int]:
        return (size := self.robot.dof * (1 + len(orders))), size

    def at(self, window: Matrix, row: Matrix, durations: Matrix, orders: tuple[int, ...]) -> Samples:
        k = self.robot.dof
        values: list[Any] = [None] * len(self.orders)
        for place, order in enumerate(orders, start=1):
            values[order] = row[order] * window[place * k : (place + 1) * k].T
        if values[0] is not None:
            values[0] = values[0] + window[:k].T
        return Samples(robot=self.robot, derivatives=tuple(values), duration=durations)

    def durations(self, parameters: Matrix) -> Matrix:
        return parameters

    @property
    def duration_count(self) -> int:
        return 1

    def as_matrices(self, parameters: Matrix) -> list[Matrix]:
        return [parameters]

    def from_matrices(self, matrices: Sequence[Matrix]) -> Matrix:
        return matrices[0]

    def trajectory(self, parameters: Matrix) -> Trajectory:
        change = np.subtract(self.task.goal, self.task.start)
        piece = BLEND[:, None] * change
        piece[0] += self.task.start
        return Trajectory.from_pieces(np.array([float(parameters)]), [piece])


@dataclass(frozen=True)
class Duration(FeasibilityFirst, Encoding[Matrix]):
    """The search vector is the duration."""

    name: ClassVar[str] = "duration"
    scales_time: ClassVar[bool] = False

    motion: Blend

    @property
    def variables(self) -> tuple[Variable, ...]:
        return (Variable("T", MIN_DURATION, MAX_DURATION, "s"),)

    def decode(self, x: Matrix) -> Decoded[Matrix]:
        return Decoded(parameters=x[0])

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        return MotionBounds(duration=MAX_DURATION, rotation=np.inf, radius=np.inf)


@dataclass(frozen=True, kw_only=True)
class JointMoveProblem(Problem[Matrix]):
    """All of them together."""

    motion: Blend

    def steps(self) -> JointMoveSteps:
        return JointMoveSteps(self)

    def nlp(self) -> NonlinearProgram:
        return JointMoveProgram(self.motion, self.criteria.limits)

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        return {"T": np.array(x)}


class JointMoveSteps(CostSteps[Matrix]):
    """Nothing but the loop."""

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        vectors = self.motion_vectors(self.encoding.decode(self.x).parameters, orders, starting_values)
        return [Step.of("decode", {"x": self.x, "p": self.p}, vectors)]


class JointMoveProgram(NonlinearProgram):
    """The same for IPOPT."""

    names = ("T",)

    def __init__(self, motion: Blend, limits: Sequence[Limit]) -> None:
        self.motion, self.limits = motion, limits
        self._x = ca.SX.sym("T")

    @property
    def x(self) -> ca.SX:
        return self._x

    @property
    def f(self) -> Matrix:
        return self._x

    def constraints(self, margin: float) -> tuple[Constraint, ...]:
        samples = self.motion.samples(self._x)
        return tuple(constraint for limit in self.limits for constraint in limit.constraints(samples, margin))

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.array([MIN_DURATION]), np.array([MAX_DURATION])

    def from_search(self, x: FloatArray) -> FloatArray:
        return x

    def from_trajectory(self, trajectory: Trajectory) -> FloatArray:
        return np.array([trajectory.duration])

    def starts(self, rng: np.random.Generator) -> Iterator[FloatArray]:
        while True:
            yield rng.uniform(MIN_DURATION, MAX_DURATION, 1)

    def trajectory(self, x: FloatArray) -> Trajectory:
        trajectory = self.motion.trajectory(ca.DM(x))
        return trajectory.time_scaled(safe_time_scale(self.limits, trajectory))

    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        return {"T": np.array(x)}


class JointMoveTask(TaskSection):
    """[task] of a joint move: postures in rad."""

    kind: Literal["joint-move"]
    start: list[float]
    goal: list[float]

    def build(self, robot: Robot, obstacles: tuple[Obstacle, ...], model: ModelSection) -> JointMoveProblem:
        task = JointMove(robot, tuple(self.start), tuple(self.goal), obstacles)
        motion = Blend(robot, task)
        limits = limits_of(robot, obstacles, model.further_limits)
        criteria = Criteria(task=task, objective=OBJECTIVES["time"], limits=limits)
        return JointMoveProblem(criteria=criteria, motion=motion, encoding=Duration(motion))

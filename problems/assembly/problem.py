"""What every planning problem offers, whatever it plans."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray, Matrix
from problems.certify.verification import limit_verdicts
from problems.evaluation import EvaluationOptions, PopulationFunction
from problems.limits.constraint import Constraint, Verdict
from problems.motions.trajectory import Trajectory
from problems.objectives.objective import Objective
from problems.robots.planar import PlanarArm
from problems.scene.ellipse import Ellipse

if TYPE_CHECKING:
    from problems.nlp.program import NonlinearProgram

SAMPLING_MARGIN = 1e-3  # kept at the samples for what lies between them, of the arm's reach or a joint's range


@dataclass(frozen=True)
class Variable:
    """One decision variable: name, box and unit."""

    name: str
    lower: float
    upper: float
    unit: str


@dataclass(frozen=True)
class Model:
    """A problem written out over symbols of its decision variables.

    Attributes:
        x: the decision variables, (d, 1).
        objective: scalar expression.
        constraints: everything the plan must keep, those included that hold by construction.
        cost: scalar expression that a metaheuristic minimises.
    """

    x: ca.SX
    objective: Matrix
    constraints: tuple[Constraint, ...]
    cost: Matrix


class Problem(ABC):
    """A frozen statement of what is planned, with one symbolic model behind everything it answers."""

    arm: PlanarArm
    obstacles: tuple[Ellipse, ...]

    @property
    @abstractmethod
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in order."""

    @property
    @abstractmethod
    def measured_by(self) -> Objective:
        """The objective."""

    @cached_property
    @abstractmethod
    def model(self) -> Model:
        """The symbolic model over the search variables."""

    @abstractmethod
    def trajectory(self, x: FloatArray) -> Trajectory:
        """The exact trajectory of one candidate (d,)."""

    @abstractmethod
    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The arm's own quantities (the paper's symbols) of one candidate (d,)."""

    @abstractmethod
    def nlp(self) -> NonlinearProgram:
        """The same problem for solvers that follow gradients."""

    @abstractmethod
    def task_verdicts(self, trajectory: Trajectory) -> list[Verdict]:
        """Judge what the task itself demands of a finished trajectory: its ends, its path."""

    @abstractmethod
    def row_times(self, trajectory: Trajectory, at_least: int) -> FloatArray:
        """Times in s at which to tabulate a trajectory, those of the search's samples among them."""

    def verify(self, trajectory: Trajectory) -> list[Verdict]:
        """Judge a finished trajectory against every constraint, far more densely than the search does."""
        return [*limit_verdicts(self.arm, self.obstacles, trajectory), *self.task_verdicts(trajectory)]

    @property
    @abstractmethod
    def objective_upper_bound(self) -> float:
        """No feasible candidate costs more, every infeasible one does."""

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        lower, upper = zip(*((v.lower, v.upper) for v in self.variables), strict=True)
        return np.array(lower), np.array(upper)

    @property
    def constraints(self) -> tuple[Constraint, ...]:
        """The named constraints, symbolic in the search variables."""
        return self.model.constraints

    @cached_property
    def cost_function(self) -> ca.Function:
        """The compiled cost of one candidate."""
        return ca.Function("cost", [self.model.x], [self.model.cost], ["x"], ["cost"], {"cse": True})

    def evaluator(self, pricing: EvaluationOptions | None = None) -> PopulationFunction:
        """The cost of whole populations, computed as told: costs (m,) of candidates (m, d). Made once for each way."""
        asked = EvaluationOptions() if pricing is None else pricing
        if asked not in self._evaluators:
            self._evaluators[asked] = PopulationFunction(self.cost_function, asked)
        return self._evaluators[asked]

    @cached_property
    def _evaluators(self) -> dict[EvaluationOptions, PopulationFunction]:
        return {}

    def cost(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d); below every infeasible cost exactly when feasible at the samples."""
        return self.evaluator()(candidates)

    def objective_value(self, trajectory: Trajectory, times: FloatArray) -> float:
        """The objective of a trajectory, measured at times (n,) in s."""
        return float(self.measured_by.of(self.arm, trajectory.samples(times)))

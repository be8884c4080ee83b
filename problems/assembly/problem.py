"""A problem: statement, motion, encoding, limits and objective put together."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import ClassVar, Generic, Protocol, Self, TypeVar

import casadi as ca
import numpy as np

from problems.assembly.criteria import Criteria
from problems.assembly.direct import DirectPlanner
from problems.assembly.encoding import CostWeights, Decoded, Encoding, Variable
from problems.base import FloatArray, InvalidProblem, Matrix, Relaxation
from problems.evaluation import EvaluationOptions, PopulationFunction, Program
from problems.limits import SAMPLING_MARGIN, Constraint, Limit, peaks_of
from problems.motions import JointPath, Motion, Trajectory
from problems.objectives import OBJECTIVES, Objective
from problems.programs import NonlinearProgram
from problems.robots import Robot
from problems.tasks import ProgressMeasure, check_choice

P = TypeVar("P")


class ProgramSteps(Protocol):
    """The steps of a cost over samples."""

    def program(self) -> Program:
        """The program of all steps."""

    def parts(self) -> tuple[Program, tuple[str, ...]]:
        """The program with the objective and each penalty behind the cost, and the penalties' names."""


@dataclass(frozen=True)
class Model:
    """A problem written out over symbols of its decision variables, all samples at once.

    Attributes:
        x: the decision variables, (d, 1).
        objective: scalar expression.
        constraints: everything the plan must keep, those included that hold by construction.
    """

    x: ca.SX
    objective: Matrix
    constraints: tuple[Constraint, ...]


@dataclass(frozen=True, kw_only=True)
class Problem(ABC, Generic[P]):
    """A planning problem: cost, constraints, nonlinear program and verification from one set of formulas.

    Attributes:
        has_program: whether there is a nonlinear program of it.
        criteria: by which a motion is judged.
        motion: the family of motions in which an answer is sought.
        encoding: what a search vector means, and what it costs.
    """

    has_program: ClassVar[bool] = True

    criteria: Criteria
    motion: Motion[P]
    encoding: Encoding[P]

    @property
    def branches(self) -> Sequence[Problem[P]]:
        """Problems that keep near to one posture each, where inverse kinematics has several, the quickest first.

        None by default.
        """
        return ()

    @property
    def branch(self) -> dict[str, FloatArray]:
        """The postures (dof,) that this problem keeps near to, by the names of its stops; none by default."""
        return {}

    def on_branch(self, branch: Mapping[str, FloatArray]) -> Problem[P]:
        """The problem that keeps near to given postures (dof,), by the names of its stops.

        Raises:
            InvalidProblem: it has no such stops, or the postures are not there.
        """
        if branch:
            raise InvalidProblem("branches", "this task leaves no posture to inverse kinematics")
        return self

    @cached_property
    def direct(self) -> DirectPlanner:
        """The planner that makes motions without a search, and improves a given one."""
        return DirectPlanner()

    @property
    def variables(self) -> tuple[Variable, ...]:
        """The decision variables, in order."""
        return self.encoding.variables

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the search box, both (d,)."""
        return self.encoding.bounds

    def with_objective(self, objective: Objective) -> Self:
        """The problem with another objective, over the same search vectors."""
        return replace(self, criteria=replace(self.criteria, objective=objective))

    def with_integrals_at_samples(self) -> Self:
        """The problem with integrals over time taken from its samples alone; itself where they always are."""
        return self

    def nearest_candidate(self, trajectory: Trajectory) -> FloatArray | None:
        """The search vector (d,) whose motion is nearest to a given one; None where that is not known, by default."""
        return None

    @property
    def searched_limits(self) -> tuple[Limit, ...]:
        """The limits as a search keeps them; those of the motion by default."""
        return self.criteria.limits

    def decoded(self, x: Matrix) -> Decoded[P]:
        """The motion of a search vector (d, 1), with its final time; symbolic or numeric."""
        decoded, limits = self.encoding.decode(x), self.encoding.slowing(self.criteria.limits)
        peaks = self._peaks(decoded.parameters, limits) if limits else []
        return replace(decoded, parameters=self.encoding.timed(decoded.parameters, limits, peaks, x))

    def _peaks(self, shape: P, limits: Sequence[Limit]) -> list[Matrix]:
        """The largest magnitudes of limits that scale with time, at the samples of a shape; a row for each limit."""
        samples = self.motion.samples(shape)
        return [peaks_of(limit, samples) for limit in limits]

    def _point_constraints(self, parameters: P) -> list[Constraint]:
        """Constraints on single points of a motion, as a search sees them: by default on steps between samples."""
        if not self.encoding.step_limits:
            return []
        steps = self.motion.samples(parameters).steps
        return [constraint for limit in self.encoding.step_limits for constraint in limit.between(*steps)]

    def _duration_constraints(self, parameters: P) -> list[Constraint]:
        """The bounds of the durations of a motion's parts, as a search sees them; none where nothing is promised."""
        bounds = self.criteria.task.duration_bounds
        return [] if bounds is None else [bounds.at(self.motion.durations(parameters).T, SAMPLING_MARGIN)]

    @abstractmethod
    def steps(self) -> ProgramSteps:
        """The steps of a candidate's cost over samples."""

    def cost_program(self) -> Program:
        """The cost, in steps over samples."""
        return self.steps().program()

    def parts_program(self) -> tuple[Program, tuple[str, ...]]:
        """The cost and, as further values of one program, the objective and each penalty; and the penalties' names."""
        return self.steps().parts()

    @abstractmethod
    def nlp(self) -> NonlinearProgram:
        """The problem as a program for solvers that follow gradients."""

    def relaxed(self, relaxation: Relaxation, step: float) -> Self:
        """The problem with one of its limits looser by a step, in its unit; tighter where the step is negative."""
        replacement = relaxation.replacement(step)
        parts = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **{name: replacement.copied(part) for name, part in parts.items()})

    def progress_measures(self) -> tuple[ProgressMeasure, ...]:
        """Quantities to record and plot during a search; none by default."""
        return ()

    @abstractmethod
    def quantities(self, x: FloatArray) -> dict[str, FloatArray]:
        """The robot's own quantities (the paper's symbols) of one candidate (d,)."""

    @cached_property
    def model(self) -> Model:
        """All constraints and the objective as expressions of the search vector."""
        x = ca.SX.sym("x", len(self.variables))
        decoded = self.decoded(x)
        samples = self.motion.samples(decoded.parameters)
        constraints = [c for limit in self.criteria.limits for c in limit.constraints(samples, SAMPLING_MARGIN)]
        constraints += self._duration_constraints(decoded.parameters)
        constraints += self._point_constraints(decoded.parameters)
        if decoded.reach is not None:
            constraints.append(decoded.reach)
        return Model(x, self.criteria.objective.value(samples), tuple(constraints))

    @cached_property
    def weights(self) -> CostWeights:
        """The weights in the cost."""
        bound = self.criteria.objective.upper_bound(self.encoding.motion_bounds(self.criteria.limits))
        return self.encoding.weights(bound, self._penalised_constraints)

    def _penalised_constraints(self) -> list[Constraint]:
        """Constraints of the motion in the middle of the search box: any one, of which only the shapes matter."""
        parameters = self.decoded(ca.DM(np.mean(self.bounds, axis=0))).parameters
        samples, penalised = self.motion.samples(parameters), self.encoding.penalised(self.criteria.limits)
        constraints = [c for limit in penalised for c in limit.constraints(samples, SAMPLING_MARGIN)]
        return constraints + self._point_constraints(parameters)

    @property
    def objective_upper_bound(self) -> float:
        """The cost that separates feasible candidates (at most this) from infeasible ones (more)."""
        return self.weights.objective_upper_bound

    @cached_property
    def program(self) -> Program:
        """The cost of one candidate, in steps over samples."""
        return self.cost_program()

    def evaluator(self, options: EvaluationOptions | None = None) -> PopulationFunction:
        """The cost of whole populations: costs (m,) of candidates (m, d). Made once for each set of options."""
        chosen = EvaluationOptions() if options is None else options
        if chosen not in self._evaluators:
            self._evaluators[chosen] = self._new_evaluator(chosen)
        return self._evaluators[chosen]

    def _new_evaluator(self, options: EvaluationOptions) -> PopulationFunction:
        """One that has not been made yet; for :meth:`evaluator` to call."""
        return PopulationFunction(self.program, options)

    @cached_property
    def _evaluators(self) -> dict[EvaluationOptions, PopulationFunction]:
        return {}

    def cost(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d); below every infeasible cost exactly when feasible at the samples."""
        return self.evaluator()(candidates)

    @cached_property
    def _decoder(self) -> ca.Function:
        x = ca.SX.sym("x", len(self.variables))
        return ca.Function("decode", [x], self.motion.as_matrices(self.decoded(x).parameters))

    def parameters_of(self, x: FloatArray) -> P:
        """Numeric parameters of the motion of one candidate (d,)."""
        return self.motion.from_matrices(self._decoder.call([ca.DM(x)]))

    def trajectory(self, x: FloatArray) -> Trajectory:
        """The exact trajectory of one candidate (d,)."""
        return self.motion.trajectory(self.parameters_of(x))

    def path(self, x: FloatArray) -> JointPath:
        """The path of one candidate (d,), whatever its timing."""
        return JointPath.of(self.trajectory(x))


def objective_named(objective: Objective | str, robot: Robot) -> Objective:
    """An objective for a robot, given itself or by its name.

    Raises:
        InvalidProblem: there is none of that name, or it is not defined for the robot.
    """
    if isinstance(objective, str):
        check_choice("objective", objective, OBJECTIVES)
    found = OBJECTIVES[objective] if isinstance(objective, str) else objective
    found.check(robot)
    return found

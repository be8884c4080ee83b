"""The audit of a scenario, a plan or a run: structure, verdicts, optimality, shadow prices.

A finished motion is hardly ever an optimum of the nonlinear program: a search's is not, sequential programs and the
last stage have programs of their own, and what breaks a limit between samples is run more slowly as a whole. IPOPT
descends from it to the nearest optimum, whose multipliers are the shadow prices.

The content of ``python -m tpbso_casadi.audit --json``; :mod:`tpbso_casadi.display.audit_tables` prints it.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import casadi as ca
import numpy as np

from problems import CertificateStatus, Constraint, Limit, Problem, Trajectory, Verdict
from problems.assembly import Criteria
from problems.base import FloatArray, as_array
from problems.certify import freedom, structure_of
from problems.limits import SAMPLING_MARGIN, ExpressionLimit
from problems.nlp import (
    MotionProgram,
    NonlinearProgram,
    Optimality,
    Sensitivity,
    optimality,
    payload_price,
    ranking,
    sensitivities,
    settled,
)
from solvers import IPOPT, Descent, Solution, StopReason
from tpbso_casadi.planning import Motion
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.storage import CertificateResult, StoredRun

LONGEST = 60.0  # s, of a descent
CHECKED_TIMES = 401  # at which limits that were left out have to hold
BROKEN = -1e-3  # of the scale of a limit


@dataclass(frozen=True)
class Optimum:
    """An optimum of a plan's nonlinear program.

    Attributes:
        objective: at the optimum, in its unit.
        excess: of the plan's objective over it, relative.
        status: of IPOPT.
        residuals: of the conditions of optimality there.
        sensitivities: shadow prices, the largest first.
        seconds: that it took.
    """

    objective: float
    excess: float
    status: str
    residuals: dict[str, float]
    sensitivities: tuple[Sensitivity, ...]
    seconds: float

    @property
    def ranking(self) -> list[Sensitivity]:
        """What holds the motion back: that of which one per cent more saves most first."""
        return ranking(self.sensitivities)


def nearest_optimum(problem: Problem[Any], motion: Motion) -> Optimum | None:
    """Descend from a motion of a problem's form; None where no optimum is found.

    Limits from which the motion is far are left out, and put back if the optimum breaks one.
    """
    began = time.perf_counter()
    whole = problem.nlp()
    found = None
    near = whole.near(motion.trajectory)
    for program in (whole,) if near is whole else (near, whole):
        solution = _descended(program, motion.trajectory)
        if solution.stop_reason is not StopReason.CONVERGED:
            return None
        found = program, solution
        if program is whole or _holds(problem.limits, program.trajectory(solution.x), problem):
            break
    assert found is not None
    program, solution = found
    objective = solution.objective * program.objective_size
    return Optimum(
        objective=objective,
        excess=(motion.objective - objective) / abs(objective) if objective else 0.0,
        status=solution.status,
        residuals=solution.residuals,
        sensitivities=prices_of(program, solution, problem),
        seconds=time.perf_counter() - began,
    )


def prices_of(program: NonlinearProgram, solution: Solution, problem: Problem[Any]) -> tuple[Sensitivity, ...]:
    """Shadow prices of limits and of the payload at a solution, the largest first."""
    z, unit, robot = solution.x, problem.objective.unit, problem.robot
    lower, upper = program.bounds_near(z)
    own = settled(z, (lower, upper), np.where(lower == upper, 0.0, solution.bound_multipliers))
    rows = settled(_rows(program, z), program.row_bounds(), solution.row_multipliers)
    prices = sensitivities(program, z, np.concatenate([rows, own]), unit, robot)
    carried = payload_price(program, z, rows, unit) if isinstance(program, MotionProgram) else None
    return tuple(sorted([*prices, *([] if carried is None else [carried])], key=lambda price: price.per_unit))


def _descended(program: NonlinearProgram, trajectory: Trajectory) -> Solution:
    descent = Descent(program, IPOPT())
    descent.stop.deadline = time.perf_counter() + LONGEST
    return descent(program.from_trajectory(trajectory))


def _rows(program: NonlinearProgram, z: FloatArray) -> FloatArray:
    """The scaled rows at variables (n,), (r,)."""
    return as_array(ca.Function("rows", [program.x], [program.g])(z)).ravel()


def _holds(limits: Iterable[Limit], trajectory: Trajectory, problem: Problem[Any]) -> bool:
    """Whether a motion keeps limits, about, at many times."""
    samples = trajectory.samples(trajectory.times(CHECKED_TIMES), problem.robot)
    return all(row.room > BROKEN for limit in limits for row in limit.constraints(samples) if row.for_all_t)


ACTIVE_MARGIN = 1e-3  # below which a constraint is active, of its bound, or of the reach where the bound is 0
POLISH_KEYS = {"accepted", "status", "residuals", "multipliers"}


def audit_scenario(scenario: Scenario) -> dict[str, Any]:
    """The symbolic audit: the search model and the nonlinear program if there is one, constraint by constraint.

    Raises:
        ScenarioError: the task cannot be done.
    """
    began = time.perf_counter()
    problem = scenario.problem()
    names = [variable.name for variable in problem.variables]
    return {
        "kind": "scenario",
        "search": _model(problem, problem.constraints, problem.model.x, names, problem.bounds),
        "program": _program(problem) if problem.has_program else None,
        "seconds": time.perf_counter() - began,
    }


def _program(problem: Problem[Any]) -> dict[str, Any]:
    program = problem.nlp()
    start = next(program.starts(np.random.default_rng(0)))
    rows = program.constraints(SAMPLING_MARGIN)
    return _model(problem, rows, program.x, program.names, program.bounds_near(start))


def _model(
    problem: Problem[Any],
    constraints: Sequence[Constraint],
    x: ca.SX,
    names: Sequence[str],
    bounds: tuple[FloatArray, FloatArray],
) -> dict[str, Any]:
    equations = problem.task.equations
    numbered = [replace(c, equation=equations.get(c.name, c.equation)) for c in constraints]
    structures = [structure_of(constraint, x, names, *bounds) for constraint in numbered]
    return {
        "variables": len(names),
        "rows": sum(structure.rows for structure in structures),
        "degrees_of_freedom": freedom(constraints, x),
        "constraints": [asdict(structure) for structure in structures],
    }


def impossible(audit: dict[str, Any]) -> list[str]:
    """The names of the constraints of an audited scenario that no point of the search box can meet."""
    return [c["name"] for c in audit["search"]["constraints"] if c["never_met"]]


def audit_run(run: StoredRun) -> dict[str, Any]:
    """The numeric audit and the certificate of a stored run that has been read and recomputed."""
    began = time.perf_counter()
    motion, polish, retiming = run.motion, run.result.polish, run.result.retiming
    verdicts = motion.criteria.verify(motion.trajectory)
    certified = time.perf_counter()
    kkt = None if run.problem is None or not run.problem.has_program else optimality_of(run.problem, run.found)
    judged = time.perf_counter()
    optimum = None if run.problem is None or kkt is None else _optimum(run.problem, run)
    return {
        "kind": "run",
        "searched": run.problem is not None,
        "nothing_chosen": None if run.problem is not None or motion.stages else motion.criteria.nothing_chosen,
        "stages": [stage.model_dump(mode="json") for stage in run.result.stages],
        "objective": run.result.objective.model_dump(),
        "certificate": {
            **CertificateResult.of(motion).model_dump(mode="json"),
            "seconds": certified - began,
        },
        "constraints": [_constraint(verdict, motion.criteria) for verdict in verdicts],
        "optimality": None if kkt is None else {**asdict(kkt), "licq": kkt.licq, "seconds": judged - certified},
        "optimum": optimum,
        "retiming": None if retiming is None else retiming.model_dump(exclude={"motion"}),
        "polish": None if polish is None else polish.model_dump(include=POLISH_KEYS),
    }


def optimality_of(problem: Problem[Any], motion: Motion) -> Optimality:
    """First-order conditions of a motion in the program of its problem, multipliers by least squares."""
    program = problem.nlp()
    return optimality(program, program.from_trajectory(motion.trajectory), problem.objective.unit, problem.robot)


def _optimum(problem: Problem[Any], run: StoredRun) -> dict[str, Any] | None:
    """The optimum near the plan or, if that was timed in another form than the program's, near the motion before."""
    of_the_tool = any(isinstance(limit, ExpressionLimit) for limit in problem.limits)
    if problem.robot.dim == 3 and (problem.task.obstacles or of_the_tool):
        return None  # second derivatives in space take a minute, of clearances several, which no deadline ends
    motion = run.motion if problem.nlp().takes_any_motion else run.found
    optimum = nearest_optimum(problem, motion)
    if optimum is None:
        return None
    ranked = [{**asdict(price), "per_cent": price.per_cent} for price in optimum.ranking]
    return {**asdict(optimum), "ranking": ranked, "of_plan": motion is run.motion}


def _constraint(verdict: Verdict, problem: Criteria) -> dict[str, Any]:
    """A verdict with its margin: how far inside the bound the worst value is, negative outside."""
    distance = abs(verdict.worst - verdict.bound)
    margin = distance if verdict.status is not CertificateStatus.VIOLATED else -distance
    scale = abs(verdict.bound) or problem.robot.reach()[1]
    return {
        **asdict(verdict),
        "status": str(verdict.status),
        "margin": margin,
        "active": margin <= ACTIVE_MARGIN * scale,
    }

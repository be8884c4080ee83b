"""The audit of a scenario, a plan or a run: structure, verdicts, optimality, prices.

The content of ``tpbso audit --json``; :mod:`tpbso_casadi.display.audit_tables` prints it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

import casadi as ca
import numpy as np

from problems import CertificateStatus, Constraint, Problem, Verdict
from problems.assembly import Criteria
from problems.base import FloatArray
from problems.certify import freedom, structure_of
from problems.limits import SAMPLING_MARGIN, ExpressionLimit
from problems.programs import Optimality, optimality
from tpbso_casadi.planning import JudgedMotion, PlannedMotion, nearest_optimum
from tpbso_casadi.scenario import Scenario
from tpbso_casadi.storage import CertificateResult, result_of

ACTIVE_MARGIN = 1e-3  # below which a constraint is active, of its bound, or of the reach where the bound is 0
NOTHING_CHOSEN = {  # why there is no optimum to hold a motion against, by whether it is stated
    False: "the timing is the fastest of its path; there was nothing else to choose",
    True: "the motion is judged as it is stated; nothing of it was chosen",
}
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
        "search": _model(problem.criteria, problem.model.constraints, problem.model.x, names, problem.bounds),
        "program": _program(problem) if problem.has_program else None,
        "seconds": time.perf_counter() - began,
    }


def _program(problem: Problem[Any]) -> dict[str, Any]:
    program = problem.nlp()
    start = next(program.starts(np.random.default_rng(0)))
    rows = program.constraints(SAMPLING_MARGIN)
    return _model(problem.criteria, rows, program.x, program.names, program.bounds_near(start))


def _model(
    criteria: Criteria,
    constraints: Sequence[Constraint],
    x: ca.SX,
    names: Sequence[str],
    bounds: tuple[FloatArray, FloatArray],
) -> dict[str, Any]:
    equations = criteria.task.equations
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


def audit_run(plan: PlannedMotion) -> dict[str, Any]:
    """The numeric audit and the certificate of a plan; one that was read has been recomputed."""
    motion, problem, result = plan.motion, plan.problem, result_of(plan)
    polish, retiming = result.polish, result.retiming
    began = time.perf_counter()
    verdicts = motion.criteria.verify(motion.trajectory)
    certified = time.perf_counter()
    kkt = None if problem is None or not problem.has_program else optimality_of(problem, plan.found)
    judged = time.perf_counter()
    optimum = None if problem is None or kkt is None else _optimum(problem, plan)
    return {
        "kind": "run",
        "searched": problem is not None,
        "nothing_chosen": None if problem is not None or motion.stages else NOTHING_CHOSEN[motion.is_stated],
        "stages": [stage.table() for stage in result.stages],
        "objective": result.objective.table(),
        "certificate": {
            **CertificateResult.of(motion).table(),
            "seconds": certified - began,
        },
        "constraints": [_constraint(verdict, motion.criteria) for verdict in verdicts],
        "optimality": None if kkt is None else {**asdict(kkt), "licq": kkt.licq, "seconds": judged - certified},
        "optimum": optimum,
        "retiming": None if retiming is None else retiming.part(retiming.schema().keys() - {"motion"}),
        "polish": None if polish is None else polish.part(POLISH_KEYS),
    }


def optimality_of(problem: Problem[Any], motion: JudgedMotion) -> Optimality:
    """First-order conditions of a motion in the program of its problem, multipliers by least squares."""
    program = problem.nlp()
    return optimality(program, program.from_trajectory(motion.trajectory))


def _optimum(problem: Problem[Any], plan: PlannedMotion) -> dict[str, Any] | None:
    """The optimum near the plan, with the prices of its limits."""
    criteria = problem.criteria
    of_the_tool = any(isinstance(limit, ExpressionLimit) for limit in criteria.limits)
    if criteria.robot.dim == 3 and (criteria.obstacles or of_the_tool):
        return None  # second derivatives in space take a minute, of clearances several, which no deadline ends
    optimum = nearest_optimum(problem, plan.motion, plan.found, plan.scenario.model.retime)
    if optimum is None:
        return None
    shares = ("per_cent", "timed_per_cent")
    ranked = [{**asdict(price), **{share: getattr(price, share) for share in shares}} for price in optimum.ranking]
    return {**asdict(optimum), "ranking": ranked}


def _constraint(verdict: Verdict, criteria: Criteria) -> dict[str, Any]:
    """A verdict with its margin: how far inside the bound the worst value is, negative outside."""
    distance = abs(verdict.worst - verdict.bound)
    margin = distance if verdict.status is not CertificateStatus.VIOLATED else -distance
    scale = abs(verdict.bound) or criteria.robot.reach()[1]
    return {
        **asdict(verdict),
        "status": str(verdict.status),
        "margin": margin,
        "active": margin <= ACTIVE_MARGIN * scale,
    }

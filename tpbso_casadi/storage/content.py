"""The content of ``result.json`` of a plan."""

from __future__ import annotations

from dataclasses import asdict
from platform import python_version
from typing import Any

from problems import Problem
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.storage.plain import settings_of
from tpbso_casadi.storage.result import (
    CertificateResult,
    ConstraintResult,
    HistoryResult,
    ObjectiveResult,
    PolishedMotion,
    PolishResult,
    RunResult,
    SolutionResult,
    SolverResult,
    VariableResult,
)
from tpbso_casadi.storage.versions import versions


def result_of(plan: Plan) -> RunResult:
    """The content of ``result.json``: everything to rerun and judge the plan."""
    search, solver = plan.search, plan.scenario.solver
    objective = plan.problem.objective
    return RunResult(
        scenario=plan.scenario,
        solver=SolverResult(name=solver.name, settings=settings_of(solver.build())),
        seed=solver.seed,
        objective=ObjectiveResult(name=objective.name, value=plan.objective, unit=objective.unit),
        cost=search.cost,
        feasible=plan.feasible,
        constraints=[ConstraintResult(**asdict(verdict), satisfied=verdict.satisfied) for verdict in plan.verdicts],
        certificate=CertificateResult(verdict=plan.motion.status),
        solution=_solution(plan),
        polish=None if plan.polish is None else _polish(plan.polish),
        rounds=plan.rounds,
        evaluations=search.evaluations,
        iterations=search.iterations,
        seconds=search.seconds,
        stop_reason=search.stop_reason,
        interrupted=plan.interrupted,
        history=HistoryResult(evaluations=search.history.evaluations.tolist(), cost=search.history.cost.tolist()),
        versions={"python": python_version(), **versions()},
    )


def _solution(plan: Plan) -> SolutionResult:
    motion, search = plan.motion, plan.search
    return SolutionResult(
        variables=None if search.in_program_variables else _variables(plan.problem, search.x),
        quantities={name: values.tolist() for name, values in motion.quantities.items()},
        time_scale=motion.time_scale,
        breakpoints=motion.trajectory.breakpoints.tolist(),
        coefficients=motion.trajectory.coefficients.tolist(),
    )


def _variables(problem: Problem[Any], x: FloatArray) -> list[VariableResult]:
    """The best search vector (d,), by name; before any polish."""
    return [
        VariableResult(name=variable.name, value=float(value), unit=variable.unit)
        for variable, value in zip(problem.variables, x, strict=True)
    ]


def _polish(polish: Polish) -> PolishResult:
    solution = polish.search.solution
    return PolishResult(
        before=polished_motion(polish.before),
        after=polished_motion(polish.after),
        accepted=polish.accepted,
        starts=polish.search.iterations,
        iterations=solution.iterations,
        evaluations=polish.search.evaluations,
        seconds=polish.seconds,
        status=solution.status,
        stop_reason=solution.stop_reason,
        residuals=dict(solution.residuals),
        multipliers=dict(polish.multipliers),
    )


def polished_motion(motion: Motion) -> PolishedMotion:
    """What is stored of a motion before or after a polish."""
    return PolishedMotion(objective=motion.objective, worst_violation=motion.worst_violation, feasible=motion.feasible)

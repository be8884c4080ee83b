"""The result of a plan, as it is stored."""

from __future__ import annotations

from dataclasses import asdict
from platform import python_version
from typing import Any

from problems import Problem
from problems.base import FloatArray
from tpbso_casadi.plain import settings_of, versions
from tpbso_casadi.planning import Motion, PlannedMotion, Polish, Retiming, SearchedMotion
from tpbso_casadi.storage.result import (
    AtGoalResult,
    CertificateResult,
    ClosestApproachResult,
    ConstraintResult,
    HistoryResult,
    ObjectivePart,
    ObjectiveResult,
    PiecesResult,
    PolishedMotion,
    PolishResult,
    RetimingResult,
    RunResult,
    SolutionResult,
    SolverResult,
    TimedMotion,
    VariableResult,
)


def result_of(plan: PlannedMotion) -> RunResult:
    """The content of ``result.json``: everything to rerun and judge the plan."""
    objective = plan.criteria.objective
    return RunResult(
        scenario=plan.scenario,
        objective=ObjectiveResult(
            name=objective.name, value=plan.objective, unit=objective.unit, parts=_parts(plan.motion)
        ),
        feasible=plan.feasible,
        constraints=[ConstraintResult(**asdict(verdict), satisfied=verdict.satisfied) for verdict in plan.verdicts],
        certificate=CertificateResult(verdict=plan.motion.status),
        closest_approach=closest_approach_of(plan.motion),
        at_goal=at_goal_of(plan.motion),
        solution=_solution(plan),
        retiming=None if plan.retiming is None else _retiming(plan.retiming),
        interrupted=plan.interrupted,
        versions={"python": python_version(), **versions()},
        **(_of_timing(plan) if plan.searched is None else _of_search(plan.searched)),
    )


def closest_approach_of(motion: Motion) -> ClosestApproachResult | None:
    """What is stored of how near a motion comes to an obstacle."""
    found = motion.closest_approach
    return None if found is None else ClosestApproachResult(**asdict(found))


def at_goal_of(motion: Motion) -> AtGoalResult | None:
    """What is stored of the time after a motion."""
    found = motion.at_goal
    return None if found is None else AtGoalResult(**asdict(found))


def _parts(motion: Motion) -> list[ObjectivePart]:
    """What a weighted sum is made of."""
    return [
        ObjectivePart(name=part.name, value=value, unit=part.unit, weight=weight)
        for part, weight, value in motion.objective_parts
    ]


def _of_search(plan: SearchedMotion) -> dict[str, Any]:
    """The keys that describe a search."""
    search, solver = plan.search, plan.scenario.solver
    return {
        "solver": SolverResult(name=solver.name, settings=settings_of(solver.build())),
        "seed": solver.seed,
        "cost": search.cost,
        "polish": None if plan.polish is None else _polish(plan.polish),
        "rounds": plan.rounds,
        "evaluations": search.evaluations,
        "iterations": search.iterations,
        "seconds": search.seconds,
        "stop_reason": search.stop_reason,
        "history": HistoryResult(evaluations=search.history.evaluations.tolist(), cost=search.history.cost.tolist()),
    }


def _of_timing(plan: PlannedMotion) -> dict[str, Any]:
    """The same keys where there was none."""
    nothing = dict.fromkeys(("solver", "seed", "cost", "polish", "stop_reason"))
    counts = {"rounds": 1, "evaluations": 0, "iterations": 0, "seconds": plan.seconds_timed}
    return {**nothing, **counts, "history": HistoryResult(evaluations=[], cost=[])}


def _solution(plan: PlannedMotion) -> SolutionResult:
    motion, found = plan.motion, plan.searched
    has_vector = found is not None and not found.search.in_program_variables
    return SolutionResult(
        variables=_variables(found.problem, found.search.x) if found is not None and has_vector else None,
        quantities={name: values.tolist() for name, values in motion.quantities.items()},
        branches=None if found is None else _branches(found.problem),
        time_scale=motion.time_scale,
        breakpoints=motion.trajectory.breakpoints.tolist(),
        coefficients=motion.trajectory.coefficients.tolist(),
    )


def _branches(problem: Problem[Any]) -> dict[str, list[float]] | None:
    """The postures that a problem keeps near to, by stop."""
    return {name: theta.tolist() for name, theta in problem.branch.items()} or None


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


def _retiming(retiming: Retiming) -> RetimingResult:
    before = retiming.before.trajectory
    motion = PiecesResult(breakpoints=before.breakpoints.tolist(), coefficients=before.coefficients.tolist())
    return RetimingResult(
        before=_timed_motion(retiming.before),
        after=None if retiming.after is None else _timed_motion(retiming.after),
        candidate=retiming.candidate,
        accepted=retiming.accepted,
        seconds=retiming.seconds,
        motion=motion if retiming.accepted else None,
    )


def _timed_motion(motion: Motion) -> TimedMotion:
    return TimedMotion(**dict(polished_motion(motion)), duration=motion.trajectory.duration)


def polished_motion(motion: Motion) -> PolishedMotion:
    """What is stored of a motion before or after a polish."""
    return PolishedMotion(objective=motion.objective, worst_violation=motion.worst_violation, feasible=motion.feasible)

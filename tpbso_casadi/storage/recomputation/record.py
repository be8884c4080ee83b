"""What a result says of its motion: objective, constraints, certificate; the same for every kind of plan."""

from __future__ import annotations

from problems import Verdict
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.recomputation.agreement import Contradiction, agree, same
from tpbso_casadi.storage.result import ConstraintResult, RunResult
from tpbso_casadi.storage.versions import versions


def check_motion(result: RunResult, motion: Motion) -> None:
    """Everything in a result that follows from its scenario and its motion.

    Raises:
        Contradiction: naming the first key that does not.
    """
    objective = motion.problem.objective
    same("objective.name", result.objective.name, objective.name)
    same("objective.unit", result.objective.unit, objective.unit)
    agree("objective.value", result.objective.value, motion.objective)
    parts, stored_parts = motion.objective_parts, result.objective.parts
    same("objective.parts", [part.name for part in stored_parts], [part.name for part, _, _ in parts])
    for kept, (part, weight, value) in zip(stored_parts, parts, strict=True):
        key = f"objective.parts.{part.name}"
        same(key, (kept.unit, kept.weight), (part.unit, weight))
        agree(f"{key}.value", kept.value, value)
    same("constraints", [c.name for c in result.constraints], [verdict.name for verdict in motion.verdicts])
    for stored, verdict in zip(result.constraints, motion.verdicts, strict=True):
        _check_constraint(stored, verdict)
    same("feasible", result.feasible, motion.feasible)
    same("certificate.verdict", result.certificate.verdict, motion.status)
    if set(result.versions) != {"python", *versions()}:
        raise Contradiction(f"versions: those of python, {', '.join(versions())} are needed")


def check_no_search(result: RunResult) -> None:
    """Nothing is said of a search where a given path was timed.

    Raises:
        Contradiction: there is.
    """
    for key in ("solver", "seed", "cost", "stop_reason", "polish", "retiming"):
        same(key, getattr(result, key), None)
    same("solution.variables", result.solution.variables, None)
    same("solution.quantities", result.solution.quantities, {})
    same("solution.time_scale", result.solution.time_scale, 1.0)
    for key in ("evaluations", "iterations"):
        same(key, getattr(result, key), 0)
    same("rounds", result.rounds, 1)
    same("history", (result.history.evaluations, result.history.cost), ([], []))


def _check_constraint(stored: ConstraintResult, verdict: Verdict) -> None:
    key, scale = f"constraints.{verdict.name}", abs(verdict.bound) + 1e-9
    agree(f"{key}.worst", stored.worst, verdict.worst, scale)
    agree(f"{key}.bound", stored.bound, verdict.bound, scale)
    for name in ("unit", "status", "satisfied"):
        same(f"{key}.{name}", getattr(stored, name), getattr(verdict, name))
    same(f"{key}.where", stored.where, verdict.where)

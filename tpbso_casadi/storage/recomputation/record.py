"""What a result says of its motion: objective, constraints, certificate; the same for every kind of plan."""

from __future__ import annotations

import numpy as np

from problems import Verdict
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.content import at_goal_of, closest_approach_of
from tpbso_casadi.storage.recomputation.agreement import Contradiction, agree, same
from tpbso_casadi.storage.result import AtGoalResult, ClosestApproachResult, ConstraintResult, RunResult
from tpbso_casadi.storage.versions import versions

SEARCHED_TOLERANCE = 1e-6  # m, of a smallest distance, which is searched for
WHEN_TOLERANCE = 1e-3  # s, of when that is, and of when something comes near; relative beyond 1 s


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
    if result.closest_approach is not None:  # older results have none
        _check_closest_approach(result.closest_approach, closest_approach_of(motion))
    if result.at_goal is not None:
        _check_at_goal(result.at_goal, at_goal_of(motion))
    if set(result.versions) != {"python", *versions()}:
        raise Contradiction(f"versions: those of python, {', '.join(versions())} are needed")


def _check_closest_approach(stored: ClosestApproachResult, computed: ClosestApproachResult | None) -> None:
    if computed is None or computed.distance is None:
        raise Contradiction("closest_approach: there is no obstacle within reach")
    agree("closest_approach.distance", stored.distance, computed.distance, 1.0, SEARCHED_TOLERANCE)
    agree("closest_approach.time", stored.time, computed.time, 1.0, WHEN_TOLERANCE)
    same("closest_approach.pair", stored.pair, computed.pair)


def _check_at_goal(stored: AtGoalResult, computed: AtGoalResult | None) -> None:
    if computed is None:
        raise Contradiction("at_goal: nothing moves that could come near")
    same("at_goal.touched", stored.touched, computed.touched)
    computed_until = np.inf if computed.clear_until is None else computed.clear_until
    agree("at_goal.clear_until", stored.clear_until, computed_until, 1.0, WHEN_TOLERANCE)


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

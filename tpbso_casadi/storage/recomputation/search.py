"""What a result says of its search, its polish and the last stage, which timed the motion anew."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.finishing import CANDIDATES, POLISHED, SAME_PATH, Retiming
from tpbso_casadi.planning.motion import Motion, motion_of
from tpbso_casadi.planning.plan import RESTARTS, may_start_again
from tpbso_casadi.storage.content import polished_motion
from tpbso_casadi.storage.plain import settings_of
from tpbso_casadi.storage.recomputation.agreement import TIMING_TOLERANCE, TOLERANCE, Contradiction, agree, close, same
from tpbso_casadi.storage.recomputation.motions import check_follows
from tpbso_casadi.storage.result import HistoryResult, PolishedMotion, PolishResult, RetimingResult, RunResult


def check_search(result: RunResult, problem: Problem[Any], found: Motion, motion: Motion) -> None:
    """Everything in a result that follows from its scenario, its search vector and its motions.

    Args:
        result: to be checked.
        problem: that was searched.
        found: the motion that search and polish led to.
        motion: the plan; the same unless it was timed anew.

    Raises:
        Contradiction: naming the first key that does not.
    """
    solver = result.scenario.solver
    if result.solver is None:
        raise Contradiction("solver: a table is needed")
    same("seed", result.seed, solver.seed)
    same("solver.name", result.solver.name, solver.name)
    same("solver.settings", result.solver.settings, settings_of(solver.build()))
    _check_history(result, result.history)
    _check_whether_polished(result, problem)
    _check_whether_retimed(result)
    vector = result.solution.vector
    if vector is not None:
        _check_vector(result, vector, problem, found)
    if result.polish is not None:
        _check_polish(result.polish, vector, problem, found)
    if result.retiming is not None:
        _check_retiming(result.retiming, found, motion)


def _check_history(result: RunResult, history: HistoryResult) -> None:
    """As many entries of each kind, evaluations that grow and costs that fall to those of the result."""
    if not history.evaluations or len(history.evaluations) != len(history.cost):
        raise Contradiction("history: as many costs as evaluations are needed, and one at least")
    cost = [np.inf if value is None else value for value in history.cost]
    if any(later <= earlier for earlier, later in pairwise(history.evaluations)):
        raise Contradiction("history.evaluations: do not grow")
    if any(later > earlier for earlier, later in pairwise(cost)):
        raise Contradiction("history.cost: the best so far grows")
    same("evaluations", result.evaluations, history.evaluations[-1])
    if not len(history.cost) - 2 <= result.iterations <= len(history.cost):  # the last may have been cut short
        raise Contradiction(f"iterations: {result.iterations} with {len(history.cost)} entries of the history")
    same("cost", result.cost, history.cost[-1])
    if result.stop_reason is None:
        raise Contradiction("stop_reason: missing")


def _check_whether_polished(result: RunResult, problem: Problem[Any]) -> None:
    """There is a polish where one is asked for and possible, and no other; more than one round only within a time."""
    solver, polish = result.scenario.solver, result.polish
    if polish is not None and not solver.polish_starts and solver.within is None:
        raise Contradiction("polish: the scenario asks for none")
    due = problem.is_descended and solver.polish_starts and solver.within is None and not result.interrupted
    if polish is None and due:
        raise Contradiction("polish: missing key")
    most = 1 + (RESTARTS if may_start_again(result.scenario, problem) else 0)
    if result.rounds > most and solver.within is None and result.solution.branches is None:
        raise Contradiction(f"rounds: {'one is' if most == 1 else f'{most} are'} all that the scenario asks for")
    if polish is not None and solver.within is None and polish.starts > solver.polish_starts:
        raise Contradiction(f"polish.starts: {polish.starts} where the scenario asks for {solver.polish_starts}")
    if polish is not None and polish.accepted:
        same("solution.time_scale", result.solution.time_scale, 1.0)


def _check_whether_retimed(result: RunResult) -> None:
    """There is a last stage where the scenario asks for one, and no other."""
    asked = result.scenario.model.retime
    if result.retiming is not None and not asked:
        raise Contradiction("retiming: the scenario asks for none")
    if result.retiming is None and asked and not result.interrupted:
        raise Contradiction("retiming: missing key")


def _check_vector(result: RunResult, x: FloatArray, problem: Problem[Any], found: Motion) -> None:
    """The cost of a search vector (d,) and, unless it has been polished, its motion."""
    stored, variables = result.solution.variables or [], problem.variables
    same("solution.variables", [(v.name, v.unit) for v in stored], [(v.name, v.unit) for v in variables])
    agree("cost", result.cost, float(problem.cost(x[None])[0]))
    if result.polish is not None and result.polish.accepted:
        return
    computed = motion_of(problem, x)
    tolerance = TIMING_TOLERANCE if problem.free_timing else TOLERANCE
    agree("solution.time_scale", found.time_scale, computed.time_scale, tolerance=tolerance)
    duration = computed.trajectory.duration
    agree("solution.variables", found.trajectory.duration, duration, tolerance=tolerance)
    if problem.free_timing:
        check_follows("solution.variables: the motion", problem.path(x), found.trajectory)
    else:
        close("solution.coefficients", found.trajectory.coefficients, computed.trajectory.coefficients)
    same("solution.quantities", list(found.quantities), list(computed.quantities))
    for name, values in computed.quantities.items():
        close(f"solution.quantities.{name}", found.quantities[name], values)


def _check_polish(polish: PolishResult, vector: FloatArray | None, problem: Problem[Any], found: Motion) -> None:
    """What a polish started from, what it led to, and whether that was accepted rightly."""
    before, after = polish.before, polish.after
    better = before.objective is None or (after.objective is not None and after.objective < before.objective)
    same("polish.accepted", polish.accepted, after.feasible and (better or not before.feasible))
    _check_side("polish.after" if polish.accepted else "polish.before", after if polish.accepted else before, found)
    if vector is not None:
        tolerance = TIMING_TOLERANCE if problem.free_timing else TOLERANCE
        _check_side("polish.before", before, motion_of(problem, vector), tolerance)


def _check_side(key: str, stored: PolishedMotion, motion: Motion, tolerance: float = TOLERANCE) -> None:
    computed = polished_motion(motion)
    agree(f"{key}.objective", stored.objective, motion.objective, tolerance=tolerance)
    agree(f"{key}.worst_violation", stored.worst_violation, motion.worst_violation, 1.0, tolerance)
    same(f"{key}.feasible", stored.feasible, computed.feasible)


def _check_retiming(retiming: RetimingResult, found: Motion, motion: Motion) -> None:
    """What the last stage started from, what it led to, and how the two motions belong together."""
    _check_side("retiming.before", retiming.before, found)
    agree("retiming.before.duration", retiming.before.duration, found.trajectory.duration)
    if retiming.candidate not in {"", *CANDIDATES} or (retiming.after is None) != (retiming.candidate == ""):
        raise Contradiction(f"retiming.candidate: one of {', '.join(CANDIDATES)} is needed with a motion after")
    if not retiming.accepted:
        return
    if retiming.after is None:
        raise Contradiction("retiming.accepted: there is no motion")
    _check_side("retiming.after", retiming.after, motion)
    agree("retiming.after.duration", retiming.after.duration, motion.trajectory.duration)
    same("retiming.accepted", retiming.accepted, Retiming(found, motion, retiming.candidate, 0.0).accepted)
    if retiming.candidate == SAME_PATH:
        check_follows("solution.coefficients: the motion", found.path, motion.trajectory)
        return
    ends, own = (m.trajectory.at(m.trajectory.breakpoints[[0, -1]]) for m in (found, motion))
    if retiming.candidate == POLISHED:  # which may choose another posture at its goal
        return
    if not np.allclose(own, ends, rtol=TOLERANCE, atol=TOLERANCE):
        raise Contradiction("solution.coefficients: the motion has not the ends of retiming.motion")

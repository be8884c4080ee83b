"""A stored run, computed again and compared."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from problems import Problem, Trajectory, Verdict
from problems.base import FloatArray
from problems.motions import CONTINUOUS_ORDERS, SMOOTH_ORDERS, JointPath
from problems.timing import departure
from tpbso_casadi.plain import plain, settings_of, versions
from tpbso_casadi.planning import (
    CANDIDATES,
    POLISHED,
    RESTARTS,
    SAME_PATH,
    Motion,
    Retiming,
    may_start_again,
    motion_of,
)
from tpbso_casadi.scenario import ScenarioError, read_text
from tpbso_casadi.storage.build_result import at_goal_of, closest_approach_of, polished_motion
from tpbso_casadi.storage.exporting import TORQUE, table_of
from tpbso_casadi.storage.result import (
    AtGoalResult,
    ClosestApproachResult,
    ConstraintResult,
    HistoryResult,
    PolishedMotion,
    PolishResult,
    RetimingResult,
    RunResult,
)
from tpbso_casadi.storage.run_folder import LARGEST_RESULT, SUFFIXES, digest_of

TOLERANCE = 1e-9  # between a stored and a recomputed number, relative to the largest of its column
TIMING_TOLERANCE = 1e-6  # where a timing is computed again, which another machine does not to the last digits


class Contradiction(ValueError):
    """A stored value that contradicts its recomputation; the message is one line: ``key.path: reason``."""


def agree(key: str, stored: float | None, computed: float, scale: float = 0.0, tolerance: float = TOLERANCE) -> None:
    """A number is the computed one, to the tolerance of it or of a scale; none where that is not finite.

    Raises:
        Contradiction: it is not.
    """
    if stored is None or not np.isfinite(computed):
        agrees = stored is None and not np.isfinite(computed)
    else:
        agrees = bool(abs(stored - computed) <= tolerance * max(abs(computed), scale))
    if not agrees:
        raise Contradiction(f"{key}: {stored!r} is stored, {computed!r} is computed")


def close(key: str, stored: FloatArray, computed: FloatArray) -> None:
    """Arrays of the motion that a search vector stands for.

    Raises:
        Contradiction: they are not.
    """
    if computed.shape != stored.shape or not np.allclose(stored, computed, rtol=TOLERANCE, atol=TOLERANCE):
        raise Contradiction(f"{key}: not the motion of solution.variables")


def same(key: str, stored: object, computed: object) -> None:
    """A value is the computed one.

    Raises:
        Contradiction: it is not.
    """
    if stored != computed:
        raise Contradiction(f"{key}: {plain(stored)!r} is stored, {plain(computed)!r} is computed")


def check_table(path: Path, motion: Motion) -> None:
    """The rows of ``trajectory.csv`` are those of the motion; older ones have no torques.

    Raises:
        Contradiction: they are not, or cannot be read; the message begins with the file.
    """
    header, expected = table_of(motion, motion.times)
    try:
        stored_header, *rows = csv.reader(read_text(path, LARGEST_RESULT).splitlines())
        without = [name for name in header if not name.startswith(TORQUE)]
        if stored_header == without:
            header, expected = without, expected[:, : len(without)]
        if stored_header != header or len(rows) != len(expected) or {len(row) for row in rows} != {len(header)}:
            raise Contradiction(f"{path}: {expected.shape[0]} rows of {','.join(header)} are needed")
        stored = np.array(rows, dtype=np.float64)
    except ScenarioError as error:
        raise Contradiction(str(error)) from error
    except csv.Error as error:
        raise Contradiction(f"{path}: not a table of numbers: {error}") from error
    except Contradiction:
        raise
    except ValueError as error:
        raise Contradiction(f"{path}: not a table of numbers") from error
    away = np.abs(stored - expected) > TOLERANCE * np.maximum(1.0, np.abs(expected).max(axis=0))
    if away.any() or not np.isfinite(stored).all():
        row, column = np.argwhere(away | ~np.isfinite(stored))[0]
        raise Contradiction(
            f"{path} line {row + 2}: {header[column]} = {stored[row, column]!r} where the stored motion has "
            f"{expected[row, column]!r}"
        )


def check_files(folder: Path, digests: Mapping[str, str]) -> None:
    """The other files in a run folder are those that were written with it; one that was removed does not matter.

    Files of kinds that no run has, notes for example, do not matter either.

    Raises:
        Contradiction: one is not; the message begins with the file.
    """
    for path in sorted(folder.iterdir()):
        of_interest = path.name in digests or path.suffix in SUFFIXES
        if path.name == "result.json" or not of_interest:
            continue
        if not path.is_file() or path.is_symlink() or digest_of(path) != digests.get(path.name):
            raise Contradiction(f"{path}: is not of this run")


MOST_COEFFICIENTS = 50  # of a piece: a path of degree 5 timed twice has 21
PATH_TOLERANCE = 1e-9  # rad, for angles up to 1 rad, and of larger ones


def check_trajectory(key: str, motion: Motion, problem: Problem[Any] | None) -> None:
    """Pieces one after the other from t = 0, as smooth as they have to be, with the velocities of the task at the ends.

    Args:
        key: of the motion in the result, for messages.
        motion: that is stored.
        problem: that has been searched; its motions have a fixed number of pieces unless they are timed path by path.

    Raises:
        Contradiction: they are not.
    """
    if problem is None or motion.free_timing:
        _check_shape(key, motion)
    else:
        lower, upper = problem.bounds
        _check_same_shape(key, motion.trajectory, problem.trajectory((lower + upper) / 2.0))
    trajectory, criteria = motion.trajectory, motion.criteria
    if trajectory.breakpoints.size != trajectory.coefficients.shape[1] + 1 or not _increase(trajectory):
        raise Contradiction(f"{key}.breakpoints: increasing times are needed, one more than pieces")
    orders = CONTINUOUS_ORDERS if motion.free_timing else SMOOTH_ORDERS
    jump = trajectory.largest_jump(criteria.task.end_velocities, orders, criteria.task.end_accelerations)
    if not jump <= TOLERANCE:
        how = "at rest" if not criteria.task.end_velocities.any() else "at the velocities of the task"
        raise Contradiction(f"{key}.coefficients: the pieces do not join smoothly, or not {how} (by {jump:.2g})")


def _increase(trajectory: Trajectory) -> bool:
    return bool((np.diff(trajectory.breakpoints) > 0.0).all())


def _check_shape(key: str, motion: Motion) -> None:
    order, _, joints = motion.trajectory.coefficients.shape
    if order > MOST_COEFFICIENTS or joints != motion.problem.robot.dof or motion.trajectory.breakpoints[0] != 0.0:
        dof = motion.problem.robot.dof
        raise Contradiction(f"{key}: at most {MOST_COEFFICIENTS} coefficients of {dof} joints from t = 0 are needed")


def _check_same_shape(key: str, trajectory: Trajectory, expected: Trajectory) -> None:
    if trajectory.coefficients.shape != expected.coefficients.shape or trajectory.breakpoints[0] != 0.0:
        order, pieces, joints = expected.coefficients.shape
        raise Contradiction(f"{key}: {order} coefficients of {pieces} pieces and {joints} joints from t = 0 are needed")


def check_follows(key: str, path: JointPath, trajectory: Trajectory) -> None:
    """A motion runs a path, for all t, whatever its timing.

    Raises:
        Contradiction: it leaves it, or that it does not cannot be proven.
    """
    away = departure(path, trajectory)
    if not away <= PATH_TOLERANCE * max(1.0, float(np.abs(path.at(path.breakpoints)).max())):
        raise Contradiction(f"{key}: leaves its path, by up to {away:.2g} rad")


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

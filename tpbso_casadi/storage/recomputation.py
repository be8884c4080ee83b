"""Every stored number is compared with its recomputation from the scenario and the stored motion."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np

from problems import Verdict
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.motion import Motion, motion_of
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.content import polished_motion
from tpbso_casadi.storage.motion_table import table_of
from tpbso_casadi.storage.plain import plain, settings_of
from tpbso_casadi.storage.result import ConstraintResult, HistoryResult, PolishedMotion, PolishResult, RunResult
from tpbso_casadi.storage.run_folder import LARGEST_RESULT, SUFFIXES, digest_of
from tpbso_casadi.storage.versions import versions

TOLERANCE = 1e-9  # between a stored and a recomputed number, relative to the largest of its column


class Contradiction(ValueError):
    """A stored value that contradicts its recomputation; the message is one line: ``key.path: reason``."""


def check_trajectory(motion: Motion) -> None:
    """Pieces as the problem has them, one after the other, smooth, and at rest at both ends.

    Raises:
        Contradiction: they are not.
    """
    trajectory, problem = motion.trajectory, motion.problem
    lower, upper = problem.bounds
    expected = problem.trajectory((lower + upper) / 2.0)
    if trajectory.coefficients.shape != expected.coefficients.shape or trajectory.breakpoints[0] != 0.0:
        order, pieces, joints = expected.coefficients.shape
        raise Contradiction(
            f"solution: {order} coefficients of {pieces} pieces and {joints} joints from t = 0 are needed"
        )
    if trajectory.breakpoints.shape != expected.breakpoints.shape or not (np.diff(trajectory.breakpoints) > 0.0).all():
        raise Contradiction("solution.breakpoints: increasing times are needed, one more than pieces")
    jump = trajectory.largest_jump()
    if not jump <= TOLERANCE:
        raise Contradiction(f"solution.coefficients: the pieces do not join smoothly, or not at rest (by {jump:.2g})")


def check_result(result: RunResult, motion: Motion) -> None:
    """Everything in a result that follows from its scenario, its motion and its search vector.

    Raises:
        Contradiction: naming the first key that does not.
    """
    solver, problem = result.scenario.solver, motion.problem
    _same("seed", result.seed, solver.seed)
    _same("solver.name", result.solver.name, solver.name)
    _same("solver.settings", result.solver.settings, settings_of(solver.build()))
    _same("objective.name", result.objective.name, problem.objective.name)
    _same("objective.unit", result.objective.unit, problem.objective.unit)
    _agree("objective.value", result.objective.value, motion.objective)
    _same("constraints", [c.name for c in result.constraints], [verdict.name for verdict in motion.verdicts])
    for stored, verdict in zip(result.constraints, motion.verdicts, strict=True):
        _check_constraint(stored, verdict)
    _same("feasible", result.feasible, motion.feasible)
    _same("certificate.verdict", result.certificate.verdict, motion.status)
    if set(result.versions) != {"python", *versions()}:
        raise Contradiction(f"versions: those of python, {', '.join(versions())} are needed")
    _check_history(result, result.history)
    _check_whether_polished(result)
    vector = result.solution.vector
    if vector is not None:
        _check_vector(result, vector, motion)
    if result.polish is not None:
        _check_polish(result.polish, vector, motion)


def _check_whether_polished(result: RunResult) -> None:
    """There is a polish where the scenario asks for one, and no other; more than one round only within a time."""
    solver, polish = result.scenario.solver, result.polish
    if polish is not None and not solver.polish_starts and solver.within is None:
        raise Contradiction("polish: the scenario asks for none")
    if polish is None and solver.polish_starts and solver.within is None and not result.interrupted:
        raise Contradiction("polish: missing key")
    if result.rounds > 1 and solver.within is None:
        raise Contradiction("rounds: one is all that the scenario asks for")
    if polish is not None and solver.within is None and polish.starts > solver.polish_starts:
        raise Contradiction(f"polish.starts: {polish.starts} where the scenario asks for {solver.polish_starts}")
    if polish is not None and polish.accepted:
        _same("solution.time_scale", result.solution.time_scale, 1.0)


def _check_constraint(stored: ConstraintResult, verdict: Verdict) -> None:
    key, scale = f"constraints.{verdict.name}", abs(verdict.bound) + 1e-9
    _agree(f"{key}.worst", stored.worst, verdict.worst, scale)
    _agree(f"{key}.bound", stored.bound, verdict.bound, scale)
    for name in ("unit", "status", "satisfied"):
        _same(f"{key}.{name}", getattr(stored, name), getattr(verdict, name))
    _same(f"{key}.where", stored.where, verdict.where)


def _check_history(result: RunResult, history: HistoryResult) -> None:
    """As many entries of each kind, evaluations that grow and costs that fall to those of the result."""
    if not history.evaluations or len(history.evaluations) != len(history.cost):
        raise Contradiction("history: as many costs as evaluations are needed, and one at least")
    cost = [np.inf if value is None else value for value in history.cost]
    if any(later <= earlier for earlier, later in pairwise(history.evaluations)):
        raise Contradiction("history.evaluations: do not grow")
    if any(later > earlier for earlier, later in pairwise(cost)):
        raise Contradiction("history.cost: the best so far grows")
    _same("evaluations", result.evaluations, history.evaluations[-1])
    if not len(history.cost) - 2 <= result.iterations <= len(history.cost):  # the last may have been cut short
        raise Contradiction(f"iterations: {result.iterations} with {len(history.cost)} entries of the history")
    _same("cost", result.cost, history.cost[-1])


def _check_vector(result: RunResult, x: FloatArray, motion: Motion) -> None:
    """The cost of a search vector (d,) and, unless it has been polished, its motion."""
    stored, variables = result.solution.variables or [], motion.problem.variables
    _same("solution.variables", [(v.name, v.unit) for v in stored], [(v.name, v.unit) for v in variables])
    _agree("cost", result.cost, float(motion.problem.cost(x[None])[0]))
    if result.polish is not None and result.polish.accepted:
        return
    computed = motion_of(motion.problem, x)
    _agree("solution.time_scale", motion.time_scale, computed.time_scale)
    _agree("solution.variables", motion.trajectory.duration, computed.trajectory.duration)
    _close("solution.coefficients", motion.trajectory.coefficients, computed.trajectory.coefficients)
    _same("solution.quantities", list(motion.quantities), list(computed.quantities))
    for name, values in computed.quantities.items():
        _close(f"solution.quantities.{name}", motion.quantities[name], values)


def _check_polish(polish: PolishResult, vector: FloatArray | None, motion: Motion) -> None:
    """What a polish started from, what it led to, and whether that was accepted rightly."""
    before, after = polish.before, polish.after
    better = before.objective is None or (after.objective is not None and after.objective < before.objective)
    _same("polish.accepted", polish.accepted, after.feasible and (better or not before.feasible))
    _check_polished(
        "polish.after" if polish.accepted else "polish.before", after if polish.accepted else before, motion
    )
    if vector is not None:
        _check_polished("polish.before", before, motion_of(motion.problem, vector))


def _check_polished(key: str, stored: PolishedMotion, motion: Motion) -> None:
    computed = polished_motion(motion)
    _agree(f"{key}.objective", stored.objective, motion.objective)
    _agree(f"{key}.worst_violation", stored.worst_violation, motion.worst_violation, 1.0)
    _same(f"{key}.feasible", stored.feasible, computed.feasible)


def check_table(path: Path, motion: Motion) -> None:
    """The rows of ``trajectory.csv`` are those of the motion.

    Raises:
        Contradiction: they are not, or cannot be read; the message begins with the file.
    """
    header, expected = table_of(motion, motion.times)
    try:
        stored_header, *rows = csv.reader(read_text(path, LARGEST_RESULT).splitlines())
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


def _agree(key: str, stored: float | None, computed: float, scale: float = 0.0) -> None:
    if stored is None and not np.isfinite(computed):
        return
    if stored is None or not abs(stored - computed) <= TOLERANCE * max(abs(computed), scale):
        raise Contradiction(f"{key}: {stored!r} is stored, {computed!r} is computed")


def _close(key: str, stored: FloatArray, computed: FloatArray) -> None:
    if computed.shape != stored.shape or not np.allclose(stored, computed, rtol=TOLERANCE, atol=TOLERANCE):
        raise Contradiction(f"{key}: not the motion of solution.variables")


def _same(key: str, stored: object, computed: object) -> None:
    if stored != computed:
        raise Contradiction(f"{key}: {plain(stored)!r} is stored, {plain(computed)!r} is computed")

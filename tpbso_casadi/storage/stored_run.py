"""A run folder read back and audited: every stored number is compared with a recomputation from its scenario."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from problems import Trajectory
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.motion import Motion, motion_of
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.plain import plain
from tpbso_casadi.storage.result import InvalidResult, RunResult
from tpbso_casadi.storage.run_folder import table_of

TOLERANCE = 1e-9  # between a stored and a recomputed number, relative to the largest of its column


class InvalidRun(ValueError):
    """A run folder whose parts contradict each other, or cannot be read; the message is one line."""


@dataclass(frozen=True)
class StoredRun:
    """The content of a run folder.

    Attributes:
        result: the content of ``result.json``.
        motion: the trajectory in it, verified again.
    """

    result: RunResult
    motion: Motion

    @property
    def scenario(self) -> Scenario:
        """The scenario of the run."""
        return self.result.scenario


def read_run(folder: Path) -> StoredRun:
    """Read a run folder and check that its parts agree.

    Raises:
        InvalidRun: a file is missing or unreadable, or a number is not what a recomputation gives.
    """
    path = folder / "result.json"
    try:
        result = RunResult.from_json(path.read_text(encoding="utf-8"))
        with plugin_failures_named(result.scenario, Contradiction, InvalidRun):
            motion = motion_in(result)
            _check_result(result, motion)
    except OSError as error:
        raise InvalidRun(f"{path}: cannot be read: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise InvalidRun(f"{path}: not a text file: {error.reason} at byte {error.start}") from error
    except ScenarioError as error:
        raise InvalidRun(f"{path}: scenario.{error}") from error
    except (InvalidResult, Contradiction) as error:
        raise InvalidRun(f"{path}: {error}") from error
    _check_table(folder / "trajectory.csv", motion)
    return StoredRun(result, motion)


class Contradiction(ValueError):
    """A stored value that contradicts its recomputation; the message is ``key.path: reason``."""


def motion_in(result: RunResult) -> Motion:
    """The motion that a result holds.

    Raises:
        ScenarioError: the robot of its scenario cannot do its task.
        Contradiction: the stored numbers are not a smooth motion of that robot.
    """
    solution = result.solution
    trajectory = Trajectory(np.array(solution.breakpoints), np.array(solution.coefficients))
    quantities = {name: np.array(values) for name, values in solution.quantities.items()}
    motion = Motion(result.scenario.problem(), trajectory, quantities, solution.time_scale)
    _check_trajectory(motion)
    return motion


def _check_trajectory(motion: Motion) -> None:
    """Pieces one after the other, for each joint, continuous up to the acceleration, at rest at both ends."""
    trajectory, links = motion.trajectory, motion.problem.robot.dof
    pieces = trajectory.breakpoints.size - 1
    if trajectory.coefficients.shape[1:] != (pieces, links) or trajectory.breakpoints[0] != 0.0:
        raise Contradiction(f"solution: coefficients of {pieces} pieces and {links} joints from t = 0 are needed")
    if not (np.diff(trajectory.breakpoints) > 0.0).all():
        raise InvalidRun("solution.breakpoints: times do not increase")
    jump = trajectory.largest_jump()
    if jump > TOLERANCE:
        raise Contradiction(f"solution.coefficients: the pieces do not join smoothly, or not at rest (by {jump:.2g})")


def _check_result(result: RunResult, motion: Motion) -> None:
    """Objective, constraints, certificate and, where a search vector is stored, the motion and cost of it."""
    solver = result.scenario.solver
    _same("seed", result.seed, solver.seed)
    _same("solver.name", result.solver.name, solver.name)
    _agree("objective.value", result.objective.value, motion.objective)
    _same("constraints", [c.name for c in result.constraints], [verdict.name for verdict in motion.verdicts])
    for stored, verdict in zip(result.constraints, motion.verdicts, strict=True):
        key, scale = f"constraints.{verdict.name}", abs(verdict.bound) + 1e-9
        _agree(f"{key}.worst", stored.worst, verdict.worst, scale)
        _agree(f"{key}.bound", stored.bound, verdict.bound, scale)
        _same(f"{key}.status", stored.status, verdict.status)
        _same(f"{key}.satisfied", stored.satisfied, verdict.satisfied)
    _same("feasible", result.feasible, motion.feasible)
    _same("certificate.verdict", result.certificate.verdict, motion.status)
    vector = result.solution.vector
    if vector is not None:
        _check_vector(result, vector, motion)


def _check_vector(result: RunResult, x: FloatArray, motion: Motion) -> None:
    """The cost of a search vector (d,) and, unless it has been polished, its motion."""
    variables = motion.problem.variables
    if x.size != len(variables):
        raise Contradiction(f"solution.variables: {x.size} where the problem has {len(variables)}")
    _agree("cost", result.cost, float(motion.problem.cost(x[None])[0]))
    if result.polish is None or not result.polish.accepted:
        computed = motion_of(motion.problem, x).trajectory
        _agree("solution.variables", motion.trajectory.duration, computed.duration)
        _close("solution.coefficients", motion.trajectory.coefficients, computed.coefficients)


def _check_table(path: Path, motion: Motion) -> None:
    header, expected = table_of(motion, motion.times)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            stored_header, *rows = csv.reader(file)
        stored = np.array(rows, dtype=np.float64)
    except OSError as error:
        raise InvalidRun(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidRun(f"{path}: not a table of numbers: {error}") from error
    if stored_header != header or stored.shape != expected.shape:
        raise InvalidRun(f"{path}: {expected.shape[0]} rows of {','.join(header)} are needed")
    away = np.abs(stored - expected) > TOLERANCE * np.maximum(1.0, np.abs(expected).max(axis=0))
    if away.any() or not np.isfinite(stored).all():
        row, column = np.argwhere(away | ~np.isfinite(stored))[0]
        raise InvalidRun(
            f"{path} line {row + 2}: {header[column]} = {stored[row, column]!r} where the stored motion has "
            f"{expected[row, column]!r}"
        )


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

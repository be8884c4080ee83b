"""A run folder read back, and held against what its scenario says when it is computed again."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from problems import Trajectory
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.motion import Motion, found_motion
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.run_folder import table_of

AGREES = 1e-9  # relative to the largest number of a column


class InvalidRun(ValueError):
    """A run folder whose parts contradict each other, or cannot be read; the message is one line."""


@dataclass(frozen=True)
class StoredRun:
    """What a run folder holds.

    Attributes:
        result: the content of ``result.json``.
        scenario: the scenario in it.
        motion: the trajectory in it, judged anew.
    """

    result: dict[str, Any]
    scenario: Scenario
    motion: Motion


def read_run(folder: Path) -> StoredRun:
    """Read a run folder and check that its parts agree.

    Raises:
        InvalidRun: a file is missing or unreadable, or a number is not what a recomputation gives.
    """
    path = folder / "result.json"
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
        scenario = parse_scenario(result["scenario"])
        solution = result["solution"]
        trajectory = Trajectory(_numbers(solution["breakpoints"], 1), _numbers(solution["coefficients"], 3))
        quantities = {name: _numbers(values, 1) for name, values in solution["quantities"].items()}
        motion = Motion(scenario.problem(), trajectory, quantities, float(solution["time_scale"]))
        _check_trajectory(motion)
        _check_result(path, result, motion)
    except OSError as error:
        raise InvalidRun(f"{path}: cannot be read: {error.strerror}") from error
    except ScenarioError as error:
        raise InvalidRun(f"{path}: scenario.{error}") from error
    except (KeyError, TypeError, AttributeError) as error:
        raise InvalidRun(f"{path}: incomplete: {type(error).__name__} {error}") from error
    except InvalidRun:
        raise
    except ValueError as error:
        raise InvalidRun(f"{path}: not a result: {error}") from error
    _check_table(folder / "trajectory.csv", motion)
    return StoredRun(result, scenario, motion)


def _numbers(values: Any, dimensions: int) -> FloatArray:
    array = np.array(values, dtype=np.float64)
    if array.ndim != dimensions or not np.isfinite(array).all():
        raise ValueError(f"an array of {dimensions} dimensions and finite numbers is needed")
    return array


def _check_trajectory(motion: Motion) -> None:
    """Pieces one after the other, for each joint, continuous up to the acceleration, at rest at both ends."""
    trajectory, links = motion.trajectory, motion.problem.arm.links
    pieces = trajectory.breakpoints.size - 1
    if trajectory.coefficients.shape[1:] != (pieces, links) or trajectory.breakpoints[0] != 0.0:
        raise InvalidRun(f"solution: coefficients of {pieces} pieces and {links} joints from t = 0 are needed")
    if not (np.diff(trajectory.breakpoints) > 0.0).all():
        raise InvalidRun("solution.breakpoints: times do not increase")
    jump = trajectory.largest_jump()
    if jump > AGREES:
        raise InvalidRun(f"solution.coefficients: the pieces do not join smoothly, or not at rest (by {jump:.2g})")


def _check_result(path: Path, result: dict[str, Any], motion: Motion) -> None:
    """Objective, constraints, certificate and, where a search vector is stored, the motion and cost of it."""
    _agree(path, "objective.value", result["objective"]["value"], motion.objective)
    for stored, verdict in zip(result["constraints"], motion.verdicts, strict=True):
        _same(path, "constraints.name", stored["name"], verdict.name)
        _agree(path, f"constraints.{verdict.name}.worst", stored["worst"], verdict.worst, abs(verdict.bound) + 1e-9)
        _same(path, f"constraints.{verdict.name}.status", stored["status"], str(verdict.status))
    _same(path, "feasible", result["feasible"], motion.feasible)
    _same(path, "certificate.verdict", result["certificate"]["verdict"], str(motion.status))
    if result["solution"]["variables"] is None:
        return
    x = _numbers([variable["value"] for variable in result["solution"]["variables"]], 1)
    if x.size != len(motion.problem.variables):
        raise InvalidRun(f"{path}: solution.variables: {x.size} where the problem has {len(motion.problem.variables)}")
    _agree(path, "cost", result["cost"], float(motion.problem.cost(x[None])[0]))
    if not result.get("polish", {}).get("accepted", False):
        found = found_motion(motion.problem, x)
        _agree(path, "solution.variables", found.trajectory.duration, motion.trajectory.duration)
        _close(path, "solution.coefficients", found.trajectory.coefficients, motion.trajectory.coefficients)


def _check_table(path: Path, motion: Motion) -> None:
    header, expected = table_of(motion, motion.times)
    try:
        with path.open(newline="", encoding="utf-8") as file:
            found_header, *rows = csv.reader(file)
        found = np.array(rows, dtype=np.float64)
    except OSError as error:
        raise InvalidRun(f"{path}: cannot be read: {error.strerror}") from error
    except ValueError as error:
        raise InvalidRun(f"{path}: not a table of numbers: {error}") from error
    if found_header != header or found.shape != expected.shape:
        raise InvalidRun(f"{path}: {expected.shape[0]} rows of {','.join(header)} are needed")
    away = np.abs(found - expected) > AGREES * np.maximum(1.0, np.abs(expected).max(axis=0))
    if away.any() or not np.isfinite(found).all():
        row, column = np.argwhere(away | ~np.isfinite(found))[0]
        raise InvalidRun(
            f"{path} line {row + 2}: {header[column]} = {found[row, column]!r} where the stored motion has "
            f"{expected[row, column]!r}"
        )


def _agree(path: Path, key: str, stored: float, computed: float, scale: float = 0.0) -> None:
    if not abs(stored - computed) <= AGREES * max(abs(computed), scale):
        raise InvalidRun(f"{path}: {key}: {stored!r} is stored, {computed!r} is computed")


def _close(path: Path, key: str, computed: FloatArray, stored: FloatArray) -> None:
    if computed.shape != stored.shape or not np.allclose(stored, computed, rtol=AGREES, atol=AGREES):
        raise InvalidRun(f"{path}: {key}: not the motion of solution.variables")


def _same(path: Path, key: str, stored: object, computed: object) -> None:
    if stored != computed:
        raise InvalidRun(f"{path}: {key}: {stored!r} is stored, {computed!r} is computed")

"""A stored run, read back and checked."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from problems import InvalidProblem, Problem
from problems.base import number_of
from problems.motions import JointPath
from tpbso_casadi.planning import SAME_PATH, EarlierMotion, JudgedMotion, PlannedMotion, Retiming
from tpbso_casadi.scenario import (
    Scenario,
    ScenarioError,
    criteria_of,
    pieces_in,
    pieces_table,
    plugin_failures_named,
    read_bytes,
    read_text,
)
from tpbso_casadi.storage.motion_tables import PIECES, TORQUE, table_of
from tpbso_casadi.storage.recomputation import ROUNDING, Contradiction, check_result, check_trajectory
from tpbso_casadi.storage.result import InvalidResult, RunResult, StoredRun
from tpbso_casadi.storage.run_folder import LARGEST_RESULT, SUFFIXES, digest_of
from tpbso_casadi.storage.tables import SolutionResult


class InvalidRun(ValueError):
    """A run folder whose parts contradict each other, or cannot be read; the message is one line."""


def read_run(folder: Path) -> StoredRun:
    """Read a run folder and check that its parts agree.

    Raises:
        InvalidRun: a file is missing or unreadable, has been changed, or a number is not what a recomputation gives.
    """
    path, result = folder / "result.json", read_result(folder)
    try:
        with np.errstate(all="ignore"), plugin_failures_named(result.scenario, Contradiction):
            run = checked(result)
    except ScenarioError as error:
        raise InvalidRun(f"{path}: scenario.{error}") from error
    except Contradiction as error:
        raise InvalidRun(f"{path}: {error}") from error
    except (ArithmeticError, ValueError, RuntimeError) as error:  # where numbers are beyond all bounds
        raise InvalidRun(f"{path}: solution: no motion can be computed from it ({error})") from error
    try:
        check_table(folder / "trajectory.csv", run.motion)
        check_files(folder, result.files)
    except Contradiction as error:
        raise InvalidRun(str(error)) from error
    return run


def read_result(folder: Path) -> RunResult:
    """The content of a run folder's ``result.json`` as it was written, with the pieces that stand in a file beside.

    Raises:
        InvalidRun: a file is missing or unreadable, or has been changed.
    """
    path = folder / "result.json"
    try:
        result = RunResult.from_json(read_text(path, LARGEST_RESULT))
        if result.solution.breakpoints is not None:
            return result
        path = folder / PIECES
        content = read_bytes(path, LARGEST_RESULT)
        if sha256(content).hexdigest() != result.files.get(PIECES):
            raise InvalidResult("is not of this run")
        return result.replaced(solution=result.solution.replaced(**pieces_in(content)))
    except ScenarioError as error:
        raise InvalidRun(str(error)) from error
    except ValueError as error:
        raise InvalidRun(f"{path}: {error}") from error


def read_earlier(folder: Path) -> EarlierMotion:
    """The motion of a run folder, as it was written: whoever uses it proves it again.

    Raises:
        InvalidRun: as of :func:`read_result`.
    """
    result = read_result(folder)
    quantities = {name: np.array(values) for name, values in result.solution.quantities.items()}
    return EarlierMotion(result.scenario, result.solution.trajectory, quantities)


def check_table(path: Path, motion: JudgedMotion) -> None:
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
        stored = np.array([[number_of(cell) for cell in row] for row in rows])
    except ScenarioError as error:
        raise Contradiction(str(error)) from error
    except csv.Error as error:
        raise Contradiction(f"{path}: not a table of numbers: {error}") from error
    except Contradiction:
        raise
    except ValueError as error:
        raise Contradiction(f"{path}: not a table of numbers") from error
    away = np.abs(stored - expected) > ROUNDING * np.maximum(1.0, np.abs(expected).max(axis=0))
    if away.any() or not np.isfinite(stored).all():
        row, column = np.argwhere(away | ~np.isfinite(stored))[0]
        raise Contradiction(
            f"{path} line {row + 2}: {header[column]} = {float(stored[row, column])!r} where the stored motion has "
            f"{float(expected[row, column])!r}"
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


def path_of(plan: PlannedMotion) -> JointPath:
    """The path of a plan's motion, of the lowest degree that is known of it."""
    same = plan.retiming is not None and plan.retiming.candidate == SAME_PATH
    return plan.found.path if same else plan.motion.path


def path_table(plan: PlannedMotion) -> dict[str, Any]:
    """The [task] table of a plan's path, with the speeds of its ends; plain data.

    Raises:
        ScenarioError: the timing of a path would not keep how it begins.
    """
    task = plan.criteria.task
    if task.end_accelerations.any():
        raise ScenarioError("it has an acceleration at an end, which the timing of a path does not keep")
    start, goal = (float(np.linalg.norm(velocity)) for velocity in task.end_velocities)
    return {**pieces_table(path_of(plan)), "start_speed": start, "goal_speed": goal}


def _searched(scenario: Scenario, solution: SolutionResult) -> Problem[Any]:
    """The problem of a scenario, on the branches of a solution."""
    problem = scenario.problem()
    if solution.branches is None and not problem.branch:
        return problem
    try:
        return problem.on_branch({name: np.array(theta) for name, theta in (solution.branches or {}).items()})
    except InvalidProblem as error:
        raise Contradiction(f"solution.branches: {error}") from error


def checked(result: RunResult) -> StoredRun:
    """The run that a result describes, all of it computed again.

    Raises:
        ScenarioError: the robot of its scenario cannot do its task.
        Contradiction: a number is not what a recomputation gives.
    """
    scenario, solution = result.scenario, result.solution
    problem = _searched(scenario, solution) if scenario.task.is_searched else None
    quantities = {name: np.array(values) for name, values in solution.quantities.items()}
    criteria = criteria_of(scenario, solution.trajectory, quantities) if problem is None else problem.criteria
    motion = JudgedMotion(criteria, solution.trajectory, quantities, solution.time_scale)
    found, retiming = motion, None
    if result.retiming is not None and result.retiming.motion is not None:
        found = replace(motion, trajectory=result.retiming.motion.trajectory)
        motion = motion.timed_anew(motion.trajectory)
        retiming = Retiming(found, motion, result.retiming.candidate, result.retiming.seconds)
        check_trajectory("retiming.motion", found, problem)
    check_trajectory("solution", motion, problem)
    check_result(result, problem, found, motion)
    return StoredRun(scenario=scenario, motion=motion, problem=problem, retiming=retiming, result=result)

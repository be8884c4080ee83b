"""A run folder read back and audited."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from problems import Trajectory
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.scenario.input_files import read_text
from tpbso_casadi.scenario.scenario import Scenario, plugin_failures_named
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.recomputation import Contradiction, check_files, check_result, check_table, check_trajectory
from tpbso_casadi.storage.result import InvalidResult, RunResult
from tpbso_casadi.storage.run_folder import LARGEST_RESULT


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
        InvalidRun: a file is missing or unreadable, has been changed, or a number is not what a recomputation gives.
    """
    path = folder / "result.json"
    try:
        text = read_text(path, LARGEST_RESULT)
    except ScenarioError as error:
        raise InvalidRun(str(error)) from error
    try:
        result = RunResult.from_json(text)
        with np.errstate(all="ignore"), plugin_failures_named(result.scenario, Contradiction):
            motion = motion_in(result)
            check_result(result, motion)
    except ScenarioError as error:
        raise InvalidRun(f"{path}: scenario.{error}") from error
    except (InvalidResult, Contradiction) as error:
        raise InvalidRun(f"{path}: {error}") from error
    except (ArithmeticError, ValueError) as error:  # of SciPy and NumPy, when numbers are beyond all bounds
        raise InvalidRun(f"{path}: solution: no motion can be computed from it ({error})") from error
    try:
        check_table(folder / "trajectory.csv", motion)
        check_files(folder, result.files)
    except Contradiction as error:
        raise InvalidRun(str(error)) from error
    return StoredRun(result, motion)


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
    check_trajectory(motion)
    return motion

"""A plan, or its motion, from which the search of another one begins."""

from __future__ import annotations

from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.scenario.section import ScenarioError


def candidates_of(problem: Problem[Any], previous: PlannedMotion | Motion | None) -> FloatArray | None:
    """The candidates (m, d) that a plan leaves for the search of another problem; None where no plan is given.

    They are the best candidate of its own search, where that had the same variables, and the motion itself, where the
    problem can tell which candidate is nearest to it.

    Raises:
        ScenarioError: it has neither, or is of another number of joints.
    """
    if previous is None:
        return None
    joints = previous.trajectory.coefficients.shape[2]
    if joints != problem.robot.dof:
        raise ScenarioError(f"warm_start: a motion of {joints} joints for a robot of {problem.robot.dof}")
    rows = [x for x in (_searched(problem, previous), problem.nearest_candidate(previous.trajectory)) if x is not None]
    if not rows:
        raise ScenarioError("warm_start: its search had other variables, and none can be fitted to its motion")
    return np.stack(rows)


def _searched(problem: Problem[Any], previous: PlannedMotion | Motion) -> FloatArray | None:
    """The best candidate (d,) of its search, where there was one with the same variables."""
    found = previous.searched if isinstance(previous, PlannedMotion) else None
    if found is None or found.search.in_program_variables:
        return None
    names = [[variable.name for variable in each.variables] for each in (found.problem, problem)]
    return found.search.x if names[0] == names[1] else None

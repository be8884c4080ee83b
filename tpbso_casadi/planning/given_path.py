"""Paths that are given: nothing is searched for, their least time is computed."""

from __future__ import annotations

import logging
import time
from functools import partial

from problems import InvalidProblem
from problems.assembly.criteria import Criteria
from solvers.driver.interruption import Interruption
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.planned_motion import PlannedMotion
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.tasks.joint_path import FIELDS

LOG = logging.getLogger(__name__)


def timed(scenario: Scenario, criteria: Criteria, progress: Progress, interruption: Interruption) -> PlannedMotion:
    """The motion of a scenario that states a path.

    Raises:
        ScenarioError: there is no motion along it.
        KeyboardInterrupt: Ctrl-C.
    """
    began = time.perf_counter()
    progress.phase("retiming")
    try:
        motion = interruption.breakable(partial(motion_along, criteria))
    except InvalidProblem as error:
        raise ScenarioError(f"task.{FIELDS.get(error.field, error.field)}: {error.reason}") from error
    seconds = time.perf_counter() - began
    LOG.info("retiming: a given path in %.3f s", seconds)
    return PlannedMotion(scenario=scenario, motion=motion, seconds_timed=seconds)


def motion_along(criteria: Criteria) -> Motion:
    """The motion along a given path in the least time, verified.

    Raises:
        InvalidProblem: there is none.
    """
    return Motion(criteria, criteria.given_motion(), {})

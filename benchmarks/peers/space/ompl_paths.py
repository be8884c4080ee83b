"""Paths by OMPL: RRT-Connect, simplification, and B-spline smoothing, all of its own."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
import ompl.base as ob
import ompl.geometric as og
from ompl import util

from benchmarks.motion_bench_maker.planner_collision import PlannerCollision
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from problems.base import FloatArray
from problems.robots import JointLimits

STEP = 0.01  # rad along an edge between postures that are checked
FIRST_LOOK = 8  # every so many of them are checked first
ASLEEP = 3.0  # times as long as a search may take on the wall
SMOOTHING = 5  # rounds of B-spline smoothing
RANGE = 0.5  # rad, of an extension of a tree: by default 2.6, with which cages take ten times as long


@dataclass(frozen=True)
class FoundPaths:
    """Waypoints (n, k), rad, of the simplified path, and of that smoothed; and the CPU seconds of finding them."""

    paths: tuple[FloatArray, ...]
    seconds: float


def find_paths(
    problem: MotionProblem, collision: PlannerCollision, limits: JointLimits, seed: int, seconds: float
) -> FoundPaths | None:
    """Find a path; call it once a process, since OMPL's seed cannot be set twice.

    Args:
        problem: start and goal.
        collision: says what is free.
        limits: for the ranges of the joints.
        seed: from 1 on.
        seconds: of CPU time at most, for the search; simplification has as long again.

    Returns:
        None where the search found nothing in time.
    """
    util.setLogLevel(util.LogLevel.LOG_NONE)
    util.RNG.setSeed(seed)
    began = time.process_time()
    information = _space(collision, limits)
    definition = ob.ProblemDefinition(information)
    definition.setStartAndGoalStates(_state(information, problem.start), _state(information, problem.goal))
    planner = og.RRTConnect(information)
    planner.setRange(RANGE)
    planner.setProblemDefinition(definition)
    planner.setup()
    if str(planner.solve(_after(seconds))) != "Exact solution":
        return None
    path, simplifier = definition.getSolutionPath(), og.PathSimplifier(information)
    simplifier.simplify(path, _after(seconds))
    simplified = _waypoints(path, len(problem.start))
    simplifier.smoothBSpline(path, SMOOTHING)
    paths = simplified, _waypoints(path, len(problem.start))
    return FoundPaths(paths, time.process_time() - began)


def _after(seconds: float) -> ob.PlannerTerminationCondition:
    """Ends a search after so many CPU seconds, whatever else the machine does; one that sleeps, after thrice that.

    OMPL waits, and does nothing, where a goal is in contact.
    """
    end, last = time.process_time() + seconds, time.perf_counter() + ASLEEP * seconds
    return ob.PlannerTerminationCondition(lambda: time.process_time() > end or time.perf_counter() > last)


def _space(collision: PlannerCollision, limits: JointLimits) -> ob.SpaceInformation:
    assert limits.position is not None
    joints = len(limits.speed)
    space, bounds = ob.RealVectorStateSpace(joints), ob.RealVectorBounds(joints)
    for joint, (low, high) in enumerate(limits.position):
        bounds.setLow(joint, low)
        bounds.setHigh(joint, high)
    space.setBounds(bounds)
    information = ob.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: collision.all_free(_angles(state, joints)[None]))
    information.setMotionValidator(_Edges(information, collision, joints))
    information.setup()
    return information


class _Edges(ob.MotionValidator):  # type: ignore[misc]
    """Checks an edge in one call."""

    def __init__(self, information: ob.SpaceInformation, collision: PlannerCollision, joints: int) -> None:
        super().__init__(information)
        self._collision, self._joints = collision, joints

    def checkMotion(self, first: ob.State, second: ob.State) -> bool:  # noqa: N802 (OMPL's name)
        """Whether the edge is free."""
        start, end = _angles(first, self._joints), _angles(second, self._joints)
        return free_line(self._collision, start, end)


def free_line(collision: PlannerCollision, start: FloatArray, end: FloatArray) -> bool:
    """Whether a straight line of joint angles is free."""
    count = max(int(np.ceil(np.linalg.norm(end - start) / STEP)), 1)
    postures = start + np.linspace(0.0, 1.0, count + 1)[:, None] * (end - start)
    return collision.all_free(postures[::-FIRST_LOOK]) and collision.all_free(postures)


def _angles(state: ob.State, joints: int) -> FloatArray:
    return np.array([state[joint] for joint in range(joints)])


def _state(information: ob.SpaceInformation, angles: tuple[float, ...]) -> ob.State:
    state = information.allocState()
    for joint, angle in enumerate(angles):
        state[joint] = angle
    return state


def _waypoints(path: og.PathGeometric, joints: int) -> FloatArray:
    return np.array([_angles(path.getState(number), joints) for number in range(path.getStateCount())])

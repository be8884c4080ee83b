"""The planners of the comparison under one signature, and the record that each leaves."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.planner_collision import PlannerCollision
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.records import Record
from benchmarks.motion_bench_maker.setting import Setting
from problems import Trajectory
from problems.assembly import Criteria
from tpbso_casadi import Joints, Planner, ScenarioError

UNPROVEN = {"speed", "acceleration", "jerk", "torque"}  # of these the excess is recorded: TOPP-RA's accelerations jump
PADDING = 0.002  # m that paths leave around obstacles, so that splines along them have room


@dataclass(frozen=True)
class Answer:
    """What a planner found.

    Attributes:
        trajectory: the motion; None where there is none.
        seconds: CPU time of planning.
        error: why there is no motion.
        details: that allow to make the motion again.
    """

    trajectory: Trajectory | None
    seconds: float
    error: str
    details: dict[str, Any]


def by_ompl(setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Answer:
    """RRT-Connect, simplification, smoothing, a spline, and its timing by TOPP-RA."""
    from benchmarks.peers.space.ompl_paths import find_paths  # noqa: PLC0415 (an extra)
    from benchmarks.peers.space.timed_paths import fastest  # noqa: PLC0415

    collision, padded = collisions(setting, problem)
    began = time.process_time()
    paths = find_paths(problem, padded, setting.limits, seed, seconds)
    timed = None if paths is None else fastest(paths.paths, collision, setting.limits)
    spent = time.process_time() - began
    if timed is None:
        return Answer(None, spent, "no path in time" if paths is None else "no spline is free", {})
    return Answer(timed.trajectory, spent, "", {"waypoints": timed.waypoints.tolist()})


def collisions(setting: Setting, problem: MotionProblem) -> tuple[PlannerCollision, PlannerCollision]:
    """What is free, and what is with room for a spline."""
    checker = setting.checker(problem)
    return PlannerCollision(checker), PlannerCollision(checker, padding(checker, problem))


def padding(checker: Checker, problem: MotionProblem) -> float:
    """What paths leave around obstacles, m: less where an end has less than twice that."""
    ends = float(checker.clearance(np.array([problem.start, problem.goal])).min())
    return max(0.0, min(PADDING, ends / 2.0))


def by_drake(setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Answer:
    """Drake's KinematicTrajectoryOptimization; there is nothing random about it."""
    from benchmarks.peers.space.drake_trajectory import optimize  # noqa: PLC0415 (an extra)

    optimized = optimize(setting, problem, setting.checker(problem), seconds)
    if not optimized.success:
        return Answer(None, optimized.seconds, f"SNOPT: {optimized.status}", {})
    details = {"knots": optimized.knots.tolist(), "control_points": optimized.control_points.tolist()}
    return Answer(optimized.trajectory, optimized.seconds, "", details)


def by_roboplan(setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Answer:
    """RRT-Connect, shortcuts and TOPP-RA, all of roboplan."""
    from benchmarks.peers.space.roboplan_trajectory import find_motion  # noqa: PLC0415 (an extra)

    checker = setting.checker(problem)
    found = find_motion(setting, problem, checker, padding(checker, problem), seed, seconds)
    if found.motion is None:
        return Answer(None, found.seconds, found.error, {})
    stated = (found.motion.speeds, setting.limits.speed), (found.motion.accelerations, setting.limits.acceleration)
    excess = [max(float((np.abs(values) / limits).max()) - 1.0, 0.0) for values, limits in stated]
    details = {"waypoints": found.waypoints.tolist(), "mode": found.motion.mode, "excess at its samples": excess}
    return Answer(found.motion.trajectory, found.seconds, "", details)


def by_direct(setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Answer:
    """Our own, as ``Planner.plan`` plans by default, certificates included; without a limit of time.

    The way back is planned before, so that code is loaded and robot and scene are there, as those of the others are.
    """
    scenario = Question(setting, to_pose=False).scenario(problem)
    planner, start, goal = Planner(scenario, solver="direct", seed=seed), Joints(problem.start), Joints(problem.goal)
    began = time.process_time()
    with suppress(ScenarioError):
        planner.plan(goal, start)
    first, began = time.process_time() - began, time.process_time()
    try:
        plan = planner.plan(start, goal)
    except ScenarioError as error:
        return Answer(None, time.process_time() - began, str(error), {})
    spent = time.process_time() - began
    if not plan.certified:
        return Answer(None, spent, str(plan.status), {})
    return Answer(plan.trajectory, spent, "", {"way back, s": first})


PLANNERS: dict[str, Callable[[Setting, MotionProblem, int, float], Answer]] = {
    "ompl": by_ompl,
    "roboplan": by_roboplan,
    "drake": by_drake,
    "direct": by_direct,
}


def record(planner: str, setting: Setting, problem: MotionProblem, seed: int, seconds: float) -> Record:
    """Plan, and judge the motion at samples."""
    answer = PLANNERS[planner](setting, problem, seed, seconds)
    return judged(planner, setting, problem, seed, answer)


def judged(planner: str, setting: Setting, problem: MotionProblem, seed: int, answer: Answer) -> Record:
    """The record of an answer; certified is that obstacles, the robot itself and joint ranges are kept for all t."""
    given = problem.name, planner, seed, setting.digest(problem), setting.bound(problem)
    trajectory = answer.trajectory
    if trajectory is None:
        return Record(*given, seconds=answer.seconds, error=answer.error)
    broken = [verdict.name for verdict in criteria(setting, problem).verify(trajectory) if not verdict.satisfied]
    return Record(
        *given,
        duration=trajectory.duration,
        seconds=answer.seconds,
        clearance=setting.clearance(problem, trajectory.at, trajectory.duration),
        excess=setting.excess(trajectory.at, trajectory.duration),
        certified=not set(broken) - UNPROVEN,
        details=answer.details | {"broken": broken},
    )


def criteria(setting: Setting, problem: MotionProblem) -> Criteria:
    """What our own planner would be held to, for its certificates."""
    return Question(setting, to_pose=False).scenario(problem).judged()

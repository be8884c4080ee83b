"""The planners as their documentation shows them: default settings, and what it says to do with a path afterwards."""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.planner_collision import PlannerCollision
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.space.planners import PLANNERS as CAREFUL
from benchmarks.peers.space.planners import Answer
from problems import Trajectory
from problems.base import FloatArray
from problems.robots import JointLimits
from tpbso_casadi import Joints, Planner
from tpbso_casadi.facade.foreign import exact_pieces

RATE = 100.0  # rows a second, of exports
WAYPOINTS = 5  # of a random path
TIMED = frozenset({"speed", "acceleration"})
AMONG_OBSTACLES = TIMED | {"joint range", "clearance", "self clearance"}
SAME = 1e-9  # rad between waypoints


@dataclass(frozen=True)
class Rows:
    """Times (n,), s, from 0 on; angles, speeds and accelerations (n, k) of the joints, rad."""

    times: FloatArray
    angles: FloatArray
    speeds: FloatArray
    accelerations: FloatArray

    @property
    def states(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """All of it, as ``tp.certify`` takes rows."""
        return self.times, self.angles, self.speeds, self.accelerations

    @classmethod
    def of(cls, motion: Trajectory) -> Rows:
        """A motion at the rate of exports, and its end."""
        last = motion.duration
        times = np.arange(0.0, last, 1.0 / RATE)
        times = np.append(times[times < last - SAME], last)
        return cls(times, *(motion.at(times, order) for order in range(3)))


@dataclass(frozen=True)
class Made:
    """A motion as the library evaluates it, None where it gives rows alone, and its rows."""

    motion: Trajectory | None
    rows: Rows


@dataclass(frozen=True)
class ForeignPlanner:
    """A planner.

    Attributes:
        words: what it is.
        make: a motion of a problem, in so many seconds at most; None where it finds none.
        told: the limits that it was told.
        random: whether its problems are random waypoints instead of scenes.
    """

    words: str
    make: Callable[[Setting, MotionProblem, float], Made | None]
    told: frozenset[str] = AMONG_OBSTACLES
    random: bool = False


def made(motion: Any) -> Made | None:
    """A motion of another library, or ours."""
    pieces = motion if motion is None or isinstance(motion, Trajectory) else _pieces(motion)
    return None if pieces is None else Made(pieces, Rows.of(pieces))


def _pieces(motion: Any) -> Trajectory:
    exact = exact_pieces(motion)
    assert exact is not None
    return exact[0]


def by_ompl(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """RRT-Connect by ``SimpleSetup``, simplified, interpolated, and timed by TOPP-RA along a spline."""
    path = simplified_path(setting, problem, seconds, interpolate=True)
    return None if path is None else made(timed_by_toppra(path, setting.limits))


def simplified_path(
    setting: Setting, problem: MotionProblem, seconds: float, *, interpolate: bool = False
) -> FloatArray | None:
    """Waypoints (n, k), rad, of OMPL's simplified path, with all that its default resolution looks at if asked."""
    from ompl import base, geometric, util  # noqa: PLC0415 (an extra)

    util.setLogLevel(util.LogLevel.LOG_NONE)
    collision, joints = PlannerCollision(setting.checker(problem)), len(problem.start)
    space, bounds = base.RealVectorStateSpace(joints), base.RealVectorBounds(joints)
    for joint, (low, high) in enumerate(setting.limits.position or ()):
        bounds.setLow(joint, low)
        bounds.setHigh(joint, high)
    space.setBounds(bounds)
    setup = geometric.SimpleSetup(space)

    def angles(state: Any) -> FloatArray:
        return np.array([state[joint] for joint in range(joints)])

    setup.setStateValidityChecker(lambda state: collision.all_free(angles(state)[None]))
    setup.setPlanner(geometric.RRTConnect(setup.getSpaceInformation()))
    ends = [space.allocState(), space.allocState()]
    for state, posture in zip(ends, (problem.start, problem.goal), strict=True):
        for joint, angle in enumerate(posture):
            state[joint] = angle
    setup.setStartAndGoalStates(*ends)
    if str(setup.solve(seconds)) != "Exact solution":
        return None
    setup.simplifySolution()
    path = setup.getSolutionPath()
    if interpolate:
        path.interpolate()
    waypoints = np.array([angles(path.getState(number)) for number in range(path.getStateCount())])
    return np.asarray(waypoints[np.append(True, np.linalg.norm(np.diff(waypoints, axis=0), axis=1) > SAME)])


def timed_by_toppra(waypoints: FloatArray, limits: JointLimits) -> Any:
    """TOPP-RA's own spline through waypoints over their chords, its own grid and its default parametrisation."""
    import toppra  # noqa: PLC0415 (an extra)
    from toppra.algorithm import TOPPRA  # noqa: PLC0415
    from toppra.interpolator import SplineInterpolator  # noqa: PLC0415

    from benchmarks.peers.toppra_limits import speed_and_acceleration  # noqa: PLC0415

    toppra.setup_logging("CRITICAL")
    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(waypoints, axis=0), axis=1)))
    return TOPPRA(speed_and_acceleration(limits), SplineInterpolator(along, waypoints)).compute_trajectory()


def by_ruckig(path: FloatArray, limits: JointLimits, synchronization: str = "Time") -> Trajectory:
    """From waypoint to waypoint with a rest at each, all of Ruckig that is free."""
    from ruckig import InputParameter, Ruckig, Synchronization  # noqa: PLC0415
    from ruckig import Trajectory as RuckigTrajectory  # noqa: PLC0415

    joints = path.shape[1]
    given, legs = InputParameter(joints), []
    given.max_velocity, given.max_acceleration = list(limits.speed), list(limits.acceleration)
    given.max_jerk = list(limits.jerk or ())
    given.synchronization = getattr(Synchronization, synchronization)
    for start, goal in itertools.pairwise(path):
        given.current_position, given.target_position = start.tolist(), goal.tolist()
        leg = RuckigTrajectory(joints)
        Ruckig(joints).calculate(given, leg)
        legs.append(_pieces(leg))
    starts = np.cumsum([0.0, *(leg.duration for leg in legs)])
    times = [leg.breakpoints[:-1] + start for leg, start in zip(legs, starts, strict=False)]
    coefficients = np.concatenate([leg.coefficients for leg in legs], axis=1)
    return Trajectory(np.concatenate([*times, starts[-1:]]), coefficients)


def ompl_and_ruckig(synchronization: str) -> Callable[[Setting, MotionProblem, float], Made | None]:
    """OMPL's simplified path, from waypoint to waypoint."""

    def make(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
        path = simplified_path(setting, problem, seconds)
        return None if path is None else made(by_ruckig(path, setting.limits, synchronization))

    return make


@lru_cache(maxsize=1024)
def _optimized(setting: Setting, problem: MotionProblem, seconds: float) -> Answer:
    return CAREFUL["drake"](setting, problem, 1, seconds)


def by_drake(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """KinematicTrajectoryOptimization, as it comes out."""
    return made(_optimized(setting, problem, seconds).trajectory)


def by_drake_and_toppra(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """The same, timed anew along its path by Drake's Toppra on the grid that Drake proposes."""
    from benchmarks.peers.space.drake_trajectory import retimed  # noqa: PLC0415 (an extra)

    answer = _optimized(setting, problem, seconds)
    if answer.trajectory is None:
        return None
    return made(retimed(setting, problem, answer.details["knots"], answer.details["control_points"]))


def by_roboplan(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """RRT-Connect, shortcuts and TOPP-RA of roboplan."""
    from benchmarks.peers.space.roboplan_trajectory import DEFAULTS, find_motion  # noqa: PLC0415 (an extra)

    motion = find_motion(setting, problem, setting.checker(problem), 0.0, 1, seconds, DEFAULTS).motion
    if motion is None:
        return None
    return Made(None, Rows(motion.times - motion.times[0], motion.angles, motion.speeds, motion.accelerations))


def by_ours(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """Direct planning; a plan that is not proven is no plan."""
    planner = Planner(Question(setting, to_pose=False).scenario(problem), solver="direct", seed=1)
    plan = planner.plan(Joints(problem.start), Joints(problem.goal))
    return made(plan.trajectory) if plan.certified else None


def random_waypoints(setting: Setting, number: int) -> MotionProblem:
    """A problem whose start and goal are those of random waypoints; its name says which."""
    path = waypoints_of(setting, f"random-{number:04d}")
    return MotionProblem(f"random-{number:04d}", tuple(path[0].tolist()), tuple(path[-1].tolist()), ())


def waypoints_of(setting: Setting, name: str) -> FloatArray:
    """The waypoints (n, k), rad, of a random problem, anywhere in the joints' ranges."""
    low, high = np.array(setting.limits.position).T
    rng = np.random.default_rng(int(name.rpartition("-")[2]))
    return np.asarray(rng.uniform(low, high, (WAYPOINTS, len(low))))


def toppra_at_random(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """TOPP-RA alone."""
    return made(timed_by_toppra(waypoints_of(setting, problem.name), setting.limits))


def ruckig_at_random(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """Ruckig alone."""
    return made(by_ruckig(waypoints_of(setting, problem.name), setting.limits))


def careful_ompl(setting: Setting, problem: MotionProblem, seconds: float) -> Made | None:
    """Looks every 0.01 rad, keeps 2 mm, and takes the quickest spline that is free every 0.005 rad."""
    return made(CAREFUL["ompl"](setting, problem, 1, seconds).trajectory)


FOREIGN: dict[str, ForeignPlanner] = {
    "ompl": ForeignPlanner("OMPL RRT-Connect, simplified, interpolated; TOPP-RA: defaults", by_ompl),
    "ompl-careful": ForeignPlanner("the same, every 0.01 rad, 2 mm kept, constant accelerations", careful_ompl),
    "ompl-ruckig": ForeignPlanner(
        "OMPL as above; Ruckig from waypoint to waypoint", ompl_and_ruckig("Time"), AMONG_OBSTACLES | {"jerk"}
    ),
    "ompl-ruckig-phase": ForeignPlanner(
        "the same, phases synchronised", ompl_and_ruckig("Phase"), AMONG_OBSTACLES | {"jerk"}
    ),
    "drake": ForeignPlanner("Drake KinematicTrajectoryOptimization", by_drake),  # accelerations at ends are free
    "drake-toppra": ForeignPlanner("the same, and Drake's Toppra", by_drake_and_toppra),
    "roboplan": ForeignPlanner("roboplan RRT-Connect, shortcuts, TOPP-RA: defaults", by_roboplan),
    "direct": ForeignPlanner("ours, `direct`", by_ours, AMONG_OBSTACLES | {"jerk"}),
    "toppra": ForeignPlanner("TOPP-RA through 5 random waypoints: defaults", toppra_at_random, TIMED, random=True),
    "ruckig": ForeignPlanner("Ruckig through 5 random waypoints", ruckig_at_random, TIMED | {"jerk"}, random=True),
}


def problems_for(
    planner: ForeignPlanner, setting: Setting, scenes: Sequence[MotionProblem], count: int
) -> list[MotionProblem]:
    """The problems of a planner: scenes, or so many random ones."""
    return [random_waypoints(setting, number) for number in range(count)] if planner.random else list(scenes)

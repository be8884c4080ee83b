"""``python -m benchmarks.peers --space FILE.jsonl --payloads 0,3``: what torque limits cost, by planner and payload.

In free space Ruckig, run more slowly until its torques hold, and TOPP-RA on a straight line; among obstacles OMPL with
TOPP-RA, and ours. Torques are checked by Pinocchio.
"""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.motion_bench_maker.limited import NoResult, within
from benchmarks.motion_bench_maker.motors import Motors, Payload
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.report import CHECKED_TIMES, TIMES_PER_CHUNK, Report
from benchmarks.peers.space.planners import collisions
from benchmarks.peers.torque_limited import Motion, by_ruckig, by_toppra, slowed
from problems import Robot
from problems.motions import JointPath
from tpbso_casadi.judging.grid import parse_solvers
from tpbso_casadi.planning import plan

PROBLEMS = (
    "bookshelf_small_panda-0001",
    "box_panda-0001",
    "cage_panda-0001",
    "table_pick_panda-0001",
    "bookshelf_tall_panda-0002",
)
RUCKIG, SLOWED, LINE, OMPL, OURS = (
    "Ruckig, ignores torques and obstacles",
    "Ruckig, slowed until torques hold; ignores obstacles",
    "TOPP-RA, straight line; ignores obstacles and jerk",
    "OMPL + TOPP-RA, seed {seed}; ignores jerk",
    "ours",
)
LINE_INTERVALS = 1000
OMPL_SEEDS, OMPL_SECONDS = (1, 2, 3), 10.0
SOLVER, EVALUATIONS, SEED = "lshade", 20_000, 1
MOST_SECONDS = 600.0  # of a job


@dataclass(frozen=True)
class Outcome:
    """A planner on a problem with a payload.

    Attributes:
        problem: its name.
        planner: its name.
        mass: of the payload, kg.
        duration: of the motion, s; None where there is none.
        seconds: CPU time.
        peak: the largest torque as a share of its limit, at very many times.
        certified: whether it is proven to keep everything; None where nobody asked.
    """

    problem: str
    planner: str
    mass: float
    duration: float | None = None
    seconds: float = 0.0
    peak: float = 0.0
    certified: bool | None = None


def compare_payloads(
    setting: Setting, problems: Sequence[MotionProblem], masses: Sequence[float], workers: int
) -> Report:
    """A row for each planner and payload, a column for each problem: duration and peak torque."""
    jobs: list[tuple[Callable[..., list[Outcome]], tuple[object, ...]]] = []
    for problem in problems:
        jobs.append((in_free_space, (setting, problem, masses)))
        jobs += [(among_obstacles, (setting, problem, masses, seed)) for seed in OMPL_SEEDS]
        jobs += [(planned, (setting, problem, mass)) for mass in masses]
    with ThreadPoolExecutor(workers) as threads:
        outcomes = list(itertools.chain(*threads.map(lambda job: _done(*job), jobs)))
    planners = [RUCKIG, SLOWED, LINE, *(OMPL.format(seed=seed) for seed in OMPL_SEEDS), OURS]
    rows = [_row(planner, mass, problems, outcomes) for mass in masses for planner in planners]
    header = ["payload, kg", "planner", *(problem.name for problem in problems), "CPU seconds, median"]
    return Report("Durations in s with torque limits, and the largest torque as a share of its limit", header, rows)


def _done(job: Callable[..., list[Outcome]], given: tuple[object, ...]) -> list[Outcome]:
    """What a job finds in a process of its own; nothing where it finds nothing in time."""
    try:
        return list(within(MOST_SECONDS, job, *given))
    except NoResult:
        return []


def _row(planner: str, mass: float, problems: Sequence[MotionProblem], outcomes: Sequence[Outcome]) -> list[str]:
    own = {one.problem: one for one in outcomes if (one.planner, one.mass) == (planner, mass)}
    seconds = [one.seconds for one in own.values()]
    cells = [_cell(own.get(problem.name)) for problem in problems]
    return [f"{mass:g}", planner, *cells, f"{np.median(seconds):.3g}" if seconds else "-"]


def _cell(outcome: Outcome | None) -> str:
    if outcome is None or outcome.duration is None:
        return "-"
    return f"{outcome.duration:.3f} ({outcome.peak:.4f}{'; not certified' if outcome.certified is False else ''})"


def loaded(setting: Setting, mass: float) -> Setting:
    """The same robot with a payload at its tool."""
    return replace(setting, payload=Payload(mass) if mass else None)


def robot_of(setting: Setting, problem: MotionProblem, mass: float) -> Robot:
    """Our model of it."""
    return Question(loaded(setting, mass), to_pose=False).scenario(problem).problem().criteria.robot


def peak(setting: Setting, mass: float, at: Motion, duration: float) -> float:
    """The largest torque as a share of its limit, at very many times."""
    assert setting.tool is not None
    motors = Motors(setting.urdf, setting.kinematics.names, setting.tool, Payload(mass))
    chunks = np.array_split(np.linspace(0.0, duration, CHECKED_TIMES), CHECKED_TIMES // TIMES_PER_CHUNK)
    return max(motors.peak(*(at(times, order) for order in range(3))) for times in chunks)


def in_free_space(setting: Setting, problem: MotionProblem, masses: Sequence[float]) -> list[Outcome]:
    """Those that ignore obstacles."""
    return [outcome for mass in masses for outcome in _free(setting, problem, mass)]


def _free(setting: Setting, problem: MotionProblem, mass: float) -> Iterator[Outcome]:
    robot, ends = robot_of(setting, problem, mass), np.array([problem.start, problem.goal])
    fast = by_ruckig(ends, setting.limits)
    line = by_toppra(JointPath.through(ends), robot, LINE_INTERVALS)
    for planner, timed in ((RUCKIG, fast), (SLOWED, slowed(fast, robot)), (LINE, line)):
        if timed is not None:
            worst = peak(setting, mass, timed.at, timed.duration)
            yield Outcome(problem.name, planner, mass, timed.duration, timed.seconds, worst)


def among_obstacles(setting: Setting, problem: MotionProblem, masses: Sequence[float], seed: int) -> list[Outcome]:
    """OMPL's path, timed by TOPP-RA for each payload; call it once a process, as OMPL's seed cannot be set twice."""
    from benchmarks.peers.space.ompl_paths import find_paths  # noqa: PLC0415 (an extra)
    from benchmarks.peers.space.timed_paths import fastest  # noqa: PLC0415

    collision, padded = collisions(setting, problem)
    found = find_paths(problem, padded, setting.limits, seed, OMPL_SECONDS)
    outcomes, planner = [], OMPL.format(seed=seed)
    for mass in masses if found is not None else ():
        assert found is not None
        robot, began = robot_of(setting, problem, mass), time.process_time()
        timed = fastest(found.paths, collision, setting.limits, robot)
        if timed is not None:
            seconds, motion = found.seconds + time.process_time() - began, timed.trajectory
            worst = peak(setting, mass, motion.at, motion.duration)
            outcomes.append(Outcome(problem.name, planner, mass, motion.duration, seconds, worst))
    return outcomes


def planned(setting: Setting, problem: MotionProblem, mass: float) -> list[Outcome]:
    """Ours."""
    scenario = Question(loaded(setting, mass), to_pose=False).scenario(problem)
    spec = replace(parse_solvers(SOLVER)[0], table={"evaluations": EVALUATIONS})
    began = time.process_time()
    found = plan(spec.applied(scenario, SEED))
    seconds, motion = time.process_time() - began, found.trajectory
    worst = peak(setting, mass, motion.at, motion.duration)
    return [Outcome(problem.name, OURS, mass, motion.duration, seconds, worst, found.feasible)]

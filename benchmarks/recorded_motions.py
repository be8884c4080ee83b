r"""Are the certificates of stated motions right? Random rows, and planted violations.

Random motions of a planar arm and of a Panda, rows joined by lines, cubics or quintics, are certified and then looked
at by code of their own (SciPy's interpolation, spheres and distances in NumPy) at very many samples. A certificate is
false where a sample breaks what it calls certified. Planted: a limit or a margin that the motion breaks by no more than
a millionth, or for no longer than a tenth of a millisecond; none may be called certified.

    python -m benchmarks.recorded_motions --random 1000 --problems panda.jsonl --robot-urdf panda.urdf \
        --spheres panda-spheres.toml
    python -m benchmarks.recorded_motions --planted 200 ...
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from scipy.interpolate import BPoly, CubicHermiteSpline, PPoly
from scipy.optimize import minimize_scalar

from benchmarks.motion_bench_maker.collision import Checker
from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from problems import Ellipse, Obstacle, PlanarArm, Robot, Trajectory, Verdict
from problems.assembly import recorded_motion
from problems.base import FloatArray
from problems.motions import MotionRows
from problems.tasks import RecordedMotion

KINDS = ("linear", "cubic", "quintic")
SAMPLES, CHUNK = 100_000, 20_000
SLACK = 1e-8  # relative: a sample beyond a limit by more breaks it
TOUCH = 1e-9  # m
NEAREST, FARTHEST = 1e-3, 0.3  # m: margins that are planted
MOST_DRAWS, OTHERS = 100, 10_000  # motions that are drawn for one, and how their numbers are apart
LOOKS = 4_001  # for the least distance, before it is followed


@dataclass(frozen=True)
class Case:
    """A motion among obstacles, and what its certificate says.

    Attributes:
        curve: the motion by SciPy.
        motion: the same by ours.
        robot: that moves.
        obstacles: around it.
        distance: the least distance from obstacles in postures (n, k), (n,), m; by code of its own.
        least: the least of it over so many samples of a curve that lasts so long, s.
    """

    curve: PPoly
    motion: Trajectory
    robot: Robot
    obstacles: tuple[Obstacle, ...]
    distance: Callable[[FloatArray], FloatArray]
    least: Callable[[PPoly, float, int], float] = lambda curve, duration, samples: np.inf

    def judged(self) -> tuple[dict[str, Verdict], float]:
        """The verdicts by name, and the CPU milliseconds that they took."""
        criteria = recorded_motion(RecordedMotion(self.robot, self.motion, self.obstacles))
        began = time.process_time()
        found = {verdict.name: verdict for verdict in criteria.verify(self.motion)}
        return found, 1e3 * (time.process_time() - began)


def random_rows(rng: np.random.Generator, start: FloatArray, goal: FloatArray, kind: str) -> tuple[PPoly, Trajectory]:
    """Rows about the straight line from a posture to another, joined by SciPy and by ours."""
    count, seconds = int(rng.integers(3, 12)), float(rng.uniform(0.8, 5.0))
    times = np.concatenate([[0.0], np.sort(rng.uniform(0.05, 0.95, count)), [1.0]]) * seconds
    u = times / seconds
    shapes = u**3 * (10.0 - 15.0 * u + 6.0 * u**2), 30.0 * (u * (1.0 - u)) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u)
    bumps = 10.0 ** rng.uniform(-4.0, -0.7) * rng.normal(size=(3, len(u), len(start))) * (u * (1.0 - u))[:, None]
    states = [np.outer(shape, goal - start) + bump for shape, bump in zip(shapes, bumps, strict=True)]
    q, v, a = start + states[0], states[1] / seconds, states[2] / seconds**2
    motion = MotionRows(times, q, v, a, kind).trajectory
    if kind == "quintic":
        curve = PPoly.from_bernstein_basis(BPoly.from_derivatives(times, np.stack([q, v, a], axis=1)))
    elif kind == "cubic":
        curve = CubicHermiteSpline(times, q, v)
    else:
        curve = PPoly(np.stack([np.diff(q, axis=0) / np.diff(times)[:, None], q[:-1]]), times)
    return curve, motion


def planar_case(rng: np.random.Generator, kind: str) -> Case:
    """An arm in the plane among discs."""
    k = int(rng.integers(2, 5))
    arm = PlanarArm(tuple(rng.uniform(0.3, 0.8, k).tolist()), (3.0,) * k, (20.0,) * k)
    reach = arm.reach()[1]
    discs = []
    for _ in range(rng.integers(1, 4)):
        angle, far, radius = rng.uniform(-np.pi, np.pi), reach * rng.uniform(0.4, 1.1), float(rng.uniform(0.03, 0.15))
        discs.append((float(far * np.cos(angle)), float(far * np.sin(angle)), radius))
    obstacles = tuple(Ellipse((x, y), (radius, radius)) for x, y, radius in discs)

    def distance(theta: FloatArray) -> FloatArray:
        angles = np.cumsum(theta, axis=1)
        ends = np.cumsum(np.array(arm.link_lengths) * np.exp(1j * angles), axis=1)
        starts = np.concatenate([np.zeros((len(theta), 1)), ends[:, :-1]], axis=1)
        found = np.full(len(theta), np.inf)
        for x, y, radius in discs:
            along, away = ends - starts, complex(x, y) - starts
            share = np.clip((away * along.conjugate()).real / np.abs(along) ** 2, 0.0, 1.0)
            found = np.minimum(found, np.abs(away - share * along).min(axis=1) - radius)
        return found

    curve, motion = random_rows(rng, rng.uniform(-1.5, 1.5, k), rng.uniform(-1.5, 1.5, k), kind)

    def least(curve: PPoly, duration: float, samples: int) -> float:
        parts = np.array_split(np.linspace(0.0, duration, samples), max(1, samples // CHUNK))
        return min(float(distance(curve(part)).min()) for part in parts)

    return Case(curve, motion, arm, obstacles, distance, least)


@lru_cache(maxsize=8)
def _scene(setting: Setting, problem: MotionProblem) -> tuple[Robot, tuple[Obstacle, ...], Checker]:
    built = Question(setting, to_pose=False).scenario(problem).built()
    return built.robot, built.obstacles, setting.checker(problem)


def panda_case(
    setting: Setting, problem: MotionProblem, rng: np.random.Generator, kind: str, of_obstacles: bool = False
) -> Case:
    """A Panda among the obstacles of a problem, on its way to the goal or a little of it."""
    robot, obstacles, checker = _scene(setting, problem)
    checker = replace(checker, near=checker.near[checker.spheres.bodies[checker.near[:, 0]] > 0])  # what a joint moves
    if of_obstacles:
        checker = replace(checker, own=checker.own[:0])
    start, goal = np.array(problem.start), np.array(problem.goal)
    if rng.random() < 0.7:
        goal = start + rng.uniform(0.02, 0.4) * (goal - start)
    curve, motion = random_rows(rng, start, goal, kind)
    return Case(curve, motion, robot, obstacles, checker.clearance, checker.least_clearance)


def case_of(number: int, setting: Setting, problems: list[MotionProblem], of_obstacles: bool = False) -> Case:
    """The motion of a number; even ones are planar."""
    rng = np.random.default_rng(number)
    kind = KINDS[(number // 2) % len(KINDS)]
    if number % 2 == 0:
        return planar_case(rng, kind)
    return panda_case(setting, problems[(number // 2) % len(problems)], rng, kind, of_obstacles)


def broken_at_samples(case: Case, samples: int) -> set[str]:
    """Which limits a sample breaks; of lines that meet accelerations are not looked at."""
    limits, broken = case.robot.limits, set()
    if case.least(case.curve, case.motion.duration, samples) < case.robot.margin - TOUCH:
        broken.add("clearance")
    for part in np.array_split(np.linspace(case.curve.x[0], case.curve.x[-1], samples), max(1, samples // CHUNK)):
        inner = part[part < case.curve.x[-1]]
        theta = case.curve(inner)
        for name, order, bound in (("speed", 1, limits.speed), ("acceleration", 2, limits.acceleration)):
            if (np.abs(case.curve(inner, order)) > np.array(bound) * (1.0 + SLACK)).any():
                broken.add(name)
        if limits.position is not None:
            low, high = np.array(limits.position).T
            if ((theta < low - SLACK) | (theta > high + SLACK)).any():
                broken.add("joint range")
    return broken


Outcome = tuple[dict[str, str], set[str], float]


def check_random(number: int, setting: Setting, problems: list[MotionProblem], samples: int) -> Outcome:
    """The statuses of a random motion, what samples break, and CPU milliseconds of the proof."""
    case = case_of(number, setting, problems)
    verdicts, milliseconds = case.judged()
    statuses = {name: str(verdict.status) for name, verdict in verdicts.items()}
    if "self clearance" in statuses:  # the samples do not tell one from the other
        both = [statuses.pop("self clearance"), statuses.get("clearance", "certified")]
        worst = next((status for status in ("violated", "undecided") if status in both), "certified")
        statuses["clearance"] = worst
    return statuses, broken_at_samples(case, samples), milliseconds


def check_planted(number: int, setting: Setting, problems: list[MotionProblem]) -> tuple[str, str, float, float]:
    """What was planted, what the certificate says of it, by how much it is broken, and CPU milliseconds."""
    rng = np.random.default_rng(100_000 + number)
    kinds = ("speed", "acceleration", "clearance", "clearance for a moment")
    what, case = kinds[(number // 2) % len(kinds)], case_of(number, setting, problems, of_obstacles=True)
    least, bend = _least_distance(case)
    for further in range(1, MOST_DRAWS):
        if what in kinds[:2] or NEAREST < least < FARTHEST:
            break
        case = case_of(number + OTHERS * further, setting, problems, of_obstacles=True)
        least, bend = _least_distance(case)
    if what in kinds[:2]:
        case = replace(case, **dict(zip(("curve", "motion"), _smooth(rng, case), strict=True)))
        order, excess = kinds.index(what) + 1, float(10.0 ** rng.uniform(-8.0, -6.0))
        joint, peak = _peak(case.curve, order)
        case = replace(case, robot=_limited(case.robot, what, joint, peak / (1.0 + excess)))
        name = what
    else:
        moment = float(10.0 ** rng.uniform(-6.0, -4.0))  # s
        excess = float(10.0 ** rng.uniform(-8.0, -6.0)) if what == "clearance" else max(bend * moment**2 / 8.0, 1e-12)
        case, name = replace(case, robot=replace(case.robot, margin=least + excess)), "clearance"
    verdicts, milliseconds = case.judged()
    status = "no verdict" if name not in verdicts else str(verdicts[name].status)
    return what, status, excess, milliseconds


def _smooth(rng: np.random.Generator, case: Case) -> tuple[PPoly, Trajectory]:
    ends = case.motion.at(case.motion.breakpoints[[0, -1]])
    return random_rows(rng, ends[0], ends[1], "quintic")


def _peak(curve: PPoly, order: int) -> tuple[int, float]:
    """The joint whose derivative has the largest size, and that size, from the roots of the next one."""
    rates, next_one = curve.derivative(order), curve.derivative(order + 1)
    peaks = []
    for joint in range(curve.c.shape[2]):
        roots = PPoly(next_one.c[:, :, joint], next_one.x).roots(extrapolate=False)
        times = np.concatenate([curve.x, roots[np.isfinite(roots)]])
        peaks.append(float(np.abs(rates(times)[:, joint]).max()))
    joint = int(np.argmax(peaks))
    return joint, peaks[joint]


def _limited(robot: Robot, what: str, joint: int, bound: float) -> Robot:
    """The robot with a limit of one joint, and ten times as much for the others."""
    bounds = tuple(bound if number == joint else 10.0 * bound for number in range(robot.dof))
    key = f"max_{what}"
    if hasattr(robot, key):
        return replace(robot, **{key: bounds})
    return replace(robot, limits=replace(robot.limits, **{what: bounds}))


def _least_distance(case: Case) -> tuple[float, float]:
    """The least distance, m, followed from where many samples have it, and how it bends there, m/s^2."""

    def at(t: float) -> float:
        return float(case.distance(case.curve(np.array([t])))[0])

    times = np.linspace(case.curve.x[0], np.nextafter(case.curve.x[-1], 0.0), LOOKS)
    values = case.distance(case.curve(times))
    nearest = int(np.argmin(values))
    step = times[1] - times[0]
    low, high = max(times[0], times[nearest] - step), min(times[-1], times[nearest] + step)
    found = minimize_scalar(at, bounds=(low, high), method="bounded", options={"xatol": 1e-12})
    least, when = min((float(found.fun), float(found.x)), (float(values[nearest]), float(times[nearest])))
    h = 1e-3
    around = [at(float(np.clip(when + side, times[0], times[-1]))) for side in (-h, h)]
    return least, max(sum(around) - 2.0 * least, 1e-12) / h**2


LOOKED_AT = ("speed", "acceleration", "joint range", "clearance")


def print_random(outcomes: list[Outcome], samples: int) -> None:
    print(f"{len(outcomes)} motions against {samples} samples each")
    print("| limit | certified | violated | undecided | false certified | violated that no sample saw |")
    print("|---|---|---|---|---|---|")
    for name in LOOKED_AT:
        rows = [(statuses[name], name in broken) for statuses, broken, _ in outcomes if name in statuses]
        counts = Counter(status for status, _ in rows)
        false = sum(status == "certified" and broken for status, broken in rows)
        unseen = sum(status == "violated" and not broken for status, broken in rows)
        print(f"| {name} | {counts['certified']} | {counts['violated']} | {counts['undecided']} | {false} | {unseen} |")
    taken = [milliseconds for *_, milliseconds in outcomes]
    for label, part in (("planar arm", taken[::2]), ("Panda", taken[1::2])):
        print(f"CPU ms a certificate, {label}: median {np.median(part):.1f}, 95 % {np.percentile(part, 95):.1f}")


def print_planted(outcomes: list[tuple[str, str, float, float]]) -> None:
    print("| planted | motions | violated | undecided | certified |")
    print("|---|---|---|---|---|")
    for what in dict.fromkeys(what for what, *_ in outcomes):
        counts = Counter(status for each, status, *_ in outcomes if each == what)
        row = [sum(counts.values()), *(counts[status] for status in ("violated", "undecided"))]
        print(f"| {what} | {' | '.join(map(str, row))} | {counts['certified'] + counts['no verdict']} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--random", type=int, metavar="N", help="so many random motions")
    parser.add_argument("--planted", type=int, metavar="N", help="so many planted violations")
    parser.add_argument("--problems", type=Path, required=True, metavar="FILE", help="of MotionBenchMaker, of a Panda")
    add_problem_options(parser, Path())
    parser.add_argument("--samples", type=int, default=SAMPLES)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    setting, problems = setting_of(options), problems_of(options, options.problems)
    with ProcessPoolExecutor(options.workers, get_context("spawn")) as pool:
        if options.random:
            work = partial(check_random, setting=setting, problems=problems, samples=options.samples)
            print_random(list(pool.map(work, range(options.random), chunksize=5)), options.samples)
        if options.planted:
            check = partial(check_planted, setting=setting, problems=problems)
            print_planted(list(pool.map(check, range(options.planted), chunksize=5)))


if __name__ == "__main__":
    main()

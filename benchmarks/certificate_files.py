"""Are certificates checked rightly by others? 1,000 of them, as they are and each with one number changed.

Plans of MotionBenchMaker's problems (those of a file, see benchmarks.motion_bench_maker), then of random moves among
random solids, until there are enough. Each is written, checked by ``check_certificate.py``, changed by so little that
one claim is false, and checked again; a third time with one cell of time left out. What makes a claim false is known
from samples of the motion by other code: limits are put just below the largest value seen, margins just above the
smallest room.

    python -m benchmarks.certificate_files panda.jsonl --robot-urdf panda.urdf --spheres panda-spheres.toml --count 1000
"""

from __future__ import annotations

import argparse
import gzip
import json
import sys
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from benchmarks.motion_bench_maker.options import add_problem_options, problems_of, setting_of
from benchmarks.motion_bench_maker.ours import Question
from problems.assembly import Criteria, certificate_of
from problems.base import FloatArray, InvalidProblem, as_array
from problems.certify import check_certificate as checker
from problems.motions import Trajectory
from tpbso_casadi.planning import PlannedMotion, plan
from tpbso_casadi.scenario import Scenario, ScenarioError, overridden, parse_scenario

Content = dict[str, Any]
TIMES, LOOKS = 2_001, 401  # at which a motion is looked at: its torques, and what is near it
LESS, NEARER = 1e-6, 1e-5  # how much a limit is put below what is reached, of it; how much a margin above the room, m
DIRECT = {"name": "direct"}
ROBOTS = {
    "panda": [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8],
    "ur5e": [0.0, -1.6, 1.6, -1.6, -1.6, 0.0],
    "iiwa14": [0.0, 0.5, 0.0, -1.4, 0.0, 1.0, 0.0],
}


@dataclass(frozen=True, eq=False)
class Case:
    """A certified plan and its certificate."""

    criteria: Criteria
    motion: Trajectory
    content: Content


def plans(options: argparse.Namespace) -> Iterator[PlannedMotion]:
    """Certified plans: of the problems of a file, then of random moves."""
    if options.problems is not None:
        question = Question(setting_of(options), to_pose=False)
        for problem in problems_of(options, options.problems):
            yield from _planned(lambda problem=problem: overridden(question.scenario(problem), solver=DIRECT))
    move = random_planar_move if options.plane else random_move
    for seed in range(options.seed, options.seed + 100_000):
        yield from _planned(lambda seed=seed: move(np.random.default_rng(seed)))


def _planned(stated: Callable[[], Scenario]) -> Iterator[PlannedMotion]:
    try:
        found = plan(stated())
    except (ScenarioError, InvalidProblem):  # a start in an obstacle, a goal beyond the ranges
        return
    if found.feasible:
        yield found


def random_move(rng: np.random.Generator) -> Scenario:
    """A built-in robot among solids at random, one of which may move, between two postures."""
    name = str(rng.choice(list(ROBOTS)))
    start, goal = (np.array(ROBOTS[name]) + rng.uniform(-0.5, 0.5, (2, len(ROBOTS[name])))).tolist()
    return parse_scenario(
        {
            "robot": {"model": name, **({} if name == "panda" else {"max_acceleration": 15.0})},
            "task": {"kind": "point-to-point", "start": {"joints": start}, "goal": {"joints": goal}},
            "obstacles": [_solid(rng) for _ in range(rng.integers(1, 6))],
            "model": {"margin": 0.01},
            "solver": DIRECT,
        }
    )


def random_planar_move(rng: np.random.Generator) -> Scenario:
    """A planar arm among flat things at random, between two postures, by a short search."""
    links = int(rng.integers(2, 6))
    arm: dict[str, Any] = {"link_lengths": (2.0 * rng.dirichlet(np.full(links, 4.0))).tolist()}
    arm |= {"max_speed": 4.0, "max_acceleration": 20.0}
    arm |= {"link_radius": rng.uniform(0.005, 0.04)} if rng.random() < 0.5 else {}
    start, goal = rng.uniform(-1.5, 1.5, (2, links)).tolist()
    return parse_scenario(
        {
            "arm": arm,
            "task": {"kind": "point-to-point", "start": {"joints": start}, "goal": {"joints": goal}},
            "obstacles": [_flat(rng) for _ in range(rng.integers(1, 4))],
            "model": {"margin": float(rng.choice([0.0, 0.01])), "self_collision": bool(rng.random() < 0.5)},
            "solver": {"name": "pso", "evaluations": 1500, "seed": 1},
        }
    )


def _flat(rng: np.random.Generator) -> dict[str, Any]:
    around, away = rng.uniform(-np.pi, np.pi), rng.uniform(0.5, 1.9)
    place = away * np.array([np.cos(around), np.sin(around)])
    drifting = {"velocity": rng.uniform(-0.2, 0.2, 2).tolist()} if rng.random() < 0.25 else {}
    shape = str(rng.choice(["ellipse", "box", "polygon"]))
    if shape == "polygon":
        angles = np.sort(rng.uniform(-np.pi, np.pi, int(rng.integers(4, 9))))
        rays = rng.uniform(0.05, 0.25, (len(angles), 1)) * np.column_stack([np.cos(angles), np.sin(angles)])
        return {"shape": shape, "points": (place + rays).tolist(), **drifting}
    sizes = {("semi_axes" if shape == "ellipse" else "size"): rng.uniform(0.04, 0.25, 2).tolist()}
    return {"shape": shape, "center": place.tolist(), "angle": rng.uniform(-3.0, 3.0), **sizes, **drifting}


def _solid(rng: np.random.Generator) -> dict[str, Any]:
    turn = rng.normal(size=4)
    sizes: dict[str, dict[str, Any]] = {
        "box": {"size": rng.uniform(0.05, 0.3, 3).tolist()},
        "sphere": {"radius": rng.uniform(0.03, 0.15)},
        "capsule": {"radius": rng.uniform(0.02, 0.08), "length": rng.uniform(0.1, 0.5)},
        "cylinder": {"radius": rng.uniform(0.03, 0.15), "length": rng.uniform(0.1, 0.4)},
        "ellipsoid": {"semi_axes": rng.uniform(0.04, 0.2, 3).tolist()},
        "polytope": {"points": rng.uniform(-0.15, 0.15, (int(rng.integers(5, 12)), 3)).tolist()},
    }
    shape = str(rng.choice(list(sizes)))
    around, away = rng.uniform(-np.pi, np.pi), rng.uniform(0.35, 0.9)
    place = [away * float(np.cos(around)), away * float(np.sin(around)), rng.uniform(0.0, 0.9)]
    drifting = {"velocity": rng.uniform(-0.2, 0.2, 3).tolist()} if rng.random() < 0.2 else {}
    turned = {} if shape == "sphere" else {"quaternion": (turn / np.linalg.norm(turn)).tolist()}
    return {"shape": shape, "center": place, **turned, **sizes[shape], **drifting}


# What can be changed. Each is given a case, and makes it false; None where that is not in it.

Change = Callable[[Case, np.random.Generator], Content | None]


def _copy(case: Case) -> tuple[Content, Content]:
    """A certificate to be changed, and its only stage."""
    new = deepcopy(case.content)
    return new, new["stages"][0]


def lower_limit(order: int) -> Change:
    """A limit of a derivative is just below its largest value."""

    def change(case: Case, rng: np.random.Generator) -> Content | None:
        (new, stage), times = _copy(case), case.motion.extreme_times(order)
        peaks = np.abs(case.motion.at(times, order)).max(axis=0)
        fast = np.flatnonzero(peaks > 0.1 * peaks.max())
        joint = int(rng.choice(fast)) if fast.size else 0  # without a limit of the jerk there may be none
        if not fast.size or stage["robot"]["limits"][joint][order - 1] is None:
            return None
        stage["robot"]["limits"][joint][order - 1] = float(peaks[joint]) * (1.0 - LESS)
        return new

    return change


def narrower_range(case: Case, rng: np.random.Generator) -> Content | None:
    """A range ends just before the farthest angle."""
    (new, stage), most = _copy(case), case.motion.at(case.motion.extreme_times(0)).max(axis=0)
    joint = int(rng.integers(len(most)))
    if stage["robot"]["ranges"][joint][1] is None:
        return None
    stage["robot"]["ranges"][joint][1] = float(most[joint]) - LESS
    return new


def weaker_motor(case: Case, rng: np.random.Generator) -> Content | None:
    """A motor gives just less than what it has to give at some time."""
    (new, stage), times = _copy(case), np.linspace(0.0, case.motion.duration, TIMES)
    joint = int(rng.integers(case.criteria.robot.dof))
    if stage["robot"]["limits"][joint][3] is None:
        return None
    state = (ca.DM(case.motion.at(times, order)) for order in range(3))
    peak = np.abs(as_array(case.criteria.robot.dynamics.torques(*state))).max(axis=0)[joint]
    stage["robot"]["limits"][joint][3] = float(peak) * (1.0 - LESS)
    return new


def heavier_body(case: Case, rng: np.random.Generator) -> Content | None:
    """The last body is so heavy that a motor cannot hold it where it could hold it best."""
    new, stage = _copy(case)
    if not stage["robot"]["masses"]:
        return None
    stage["robot"]["masses"][-1][0] += 1e4
    return new


@dataclass(frozen=True)
class Nearest:
    """Which ball comes nearest to which obstacle, by samples: the room left, and the way from the obstacle to it."""

    ball: int
    obstacle: int
    room: float
    way: FloatArray


def nearest(case: Case) -> Nearest | None:
    """Of all pairs that have to keep clear, by positions and distances of the models; none in the plane."""
    robot, given, obstacles = case.criteria.robot, case.content["stages"][0], case.criteria.obstacles
    if robot.dim == 2:
        return None
    times = np.linspace(0.0, case.motion.duration, LOOKS)
    frames = robot.body_frames(case.motion.at(times))
    allowed = set(zip(given["may_touch"]["links"], given["may_touch"]["obstacles"], strict=True))
    balls, numbers = np.array(given["robot"]["balls"]), np.arange(len(given["robot"]["balls"]))
    links = np.cumsum(numbers == given["robot"]["ball_parents"]) - 1
    inner = np.isin(numbers, np.array(given["robot"]["ball_parents"])[given["robot"]["ball_parents"] != numbers])
    best: tuple[float, int, int, FloatArray, FloatArray] | None = None
    for i, body in enumerate(given["robot"]["link_bodies"]):
        own = np.flatnonzero((links == i) & ~inner)
        turn, place = frames[:, body, 1:], frames[:, body, 0]
        points = place[:, None] + np.einsum("bj,njk->nbk", balls[own, :3], turn)
        for n, obstacle in enumerate(obstacles):
            if (i, n) not in allowed:
                far = _distances(obstacle, points.reshape(-1, 3), np.repeat(times, len(own))).reshape(LOOKS, -1)
                rooms = far - balls[own, 3] - given["margins"][0]
                t, k = (int(part) for part in np.unravel_index(np.argmin(rooms), rooms.shape))
                if best is None or rooms[t, k] < best[0]:
                    best = float(rooms[t, k]), int(own[k]), n, points[t, k], times[t : t + 1]
    if best is None:
        return None
    room, k, n, point, when = best
    ends = [[_distances(obstacles[n], (point + s * step)[None], when)[0] for step in 1e-6 * np.eye(3)] for s in (1, -1)]
    way = np.subtract(*ends)
    return Nearest(k, n, room, way / np.linalg.norm(way))


def _distances(obstacle: Any, points: FloatArray, times: FloatArray) -> FloatArray:
    view = obstacle.frames(times)
    seen = points if view is None else points - view.origins
    exact = obstacle.unmoved.exact_distances(seen)
    found = as_array(obstacle.unmoved.point_clearance(ca.DM(seen))).ravel() if exact is None else exact
    return np.asarray(found - obstacle.growth_rate * times)


def larger_margin(case: Case, rng: np.random.Generator) -> Content | None:
    """More is to be kept than the least room."""
    if (near := nearest(case)) is None:
        return None
    new, stage = _copy(case)
    stage["margins"][0] += near.room + NEARER
    return new


def moved_obstacle(case: Case, rng: np.random.Generator) -> Content | None:
    """The obstacle that comes nearest is a little nearer than it may be."""
    if (near := nearest(case)) is None:
        return None
    new, stage = _copy(case)
    center = stage["obstacles"][near.obstacle]["center"]
    stage["obstacles"][near.obstacle]["center"] = (np.array(center) + (near.room + NEARER) * near.way).tolist()
    return new


def larger_ball(case: Case, rng: np.random.Generator) -> Content | None:
    """The ball that comes nearest is larger than there is room."""
    if (near := nearest(case)) is None:
        return None
    new, stage = _copy(case)
    stage["robot"]["balls"][near.ball][3] += near.room + NEARER
    return new


def other_coefficient(case: Case, rng: np.random.Generator) -> Content | None:
    """A piece begins elsewhere."""
    new, stage = _copy(case)
    pieces = stage["coefficients"]
    pieces[rng.integers(len(pieces))][rng.integers(case.criteria.robot.dof)][0] += 1e-7
    return new


def other_goal(case: Case, rng: np.random.Generator) -> Content | None:
    """A joint should end elsewhere."""
    new, stage = _copy(case)
    stage["goal"][0][rng.integers(case.criteria.robot.dof)] += 1e-7
    return new


def longer_motion(case: Case, rng: np.random.Generator) -> Content | None:
    """The last piece goes on for 0.1 ms."""
    new, stage = _copy(case)
    stage["breakpoints"][-1] += 1e-4
    return new


CHANGES: dict[str, Change] = {
    **{f"limit of {name} 1e-6 of it below the peak": lower_limit(n) for n, name in enumerate(checker.LIMITS[1:4], 1)},
    "range 1e-6 rad narrower than the motion": narrower_range,
    "torque 1e-6 of it below the peak of samples": weaker_motor,
    "last body 10 t heavier": heavier_body,
    "margin 0.01 mm above the room of samples": larger_margin,
    "obstacle moved, 0.01 mm too near": moved_obstacle,
    "ball grown, 0.01 mm too near": larger_ball,
    "coefficient changed by 1e-7 rad": other_coefficient,
    "goal moved by 1e-7 rad": other_goal,
    "last piece 0.1 ms longer": longer_motion,
}


def one_cell_less(case: Case, rng: np.random.Generator) -> Content | None:
    """One pair is not said to have room in one cell: the cell is halved, and nothing is said of the halves."""
    new, stage = _copy(case)
    held = [
        (levels, i, k)
        for levels in stage["proof"].values()
        for i, level in enumerate(levels)
        for k, digit in enumerate(level)
        if digit == "0"
    ]
    if not held:
        return None
    levels, i, k = held[rng.integers(len(held))]
    levels[i] = f"{levels[i][:k]}1{levels[i][k + 1 :]}"
    return new


def accepted(data: bytes) -> tuple[bool, float]:
    """Whether a certificate is, and the CPU seconds of reading and checking it."""
    began = time.process_time()
    try:
        checker.check(json.loads(data))
    except checker.RefusedError:
        return False, time.process_time() - began
    return True, time.process_time() - began


def measure(options: argparse.Namespace) -> None:
    """Make certificates, check them, and print tables."""
    counts: Counter[str] = Counter()
    refused: dict[str, Counter[bool]] = defaultdict(Counter)
    figures: list[tuple[float, ...]] = []
    slack: list[float] = []
    with suppress(KeyboardInterrupt):  # what there is by then is printed
        _count(options, counts, refused, figures, slack)
    _print(counts, refused, np.array(figures), np.array(slack))


def _count(
    options: argparse.Namespace,
    counts: Counter[str],
    refused: dict[str, Counter[bool]],
    figures: list[tuple[float, ...]],
    slack: list[float],
) -> None:
    kinds = list(CHANGES)
    for found in plans(options):
        if counts["plans"] == options.count:
            break
        counts["plans"] += 1
        began = time.process_time()
        limits = found.criteria.verify(found.trajectory)
        ours = time.process_time() - began
        try:
            began = time.process_time()
            content = certificate_of(found.criteria, found.trajectory)
        except InvalidProblem as error:
            print(f"no certificate: {error}", file=sys.stderr)
            counts["not written"] += 1
            continue
        written = time.process_time() - began
        data = json.dumps(content).encode()
        holds, seconds = accepted(data)
        counts["accepted"] += holds
        counts["verdicts"] += len(limits)
        case, rng = Case(found.criteria, found.trajectory, content), np.random.default_rng(counts["plans"])
        compact = json.dumps(content, separators=(",", ":")).encode()
        figures.append((ours, written, seconds, len(compact) / 1e3, len(gzip.compress(compact)) / 1e3))
        for turn in range(len(kinds)):  # the next kind that there is in this certificate
            kind = kinds[(counts["plans"] + turn) % len(kinds)]
            if (new := CHANGES[kind](case, rng)) is not None:
                refused[kind][not accepted(json.dumps(new).encode())[0]] += 1
                break
        if (new := one_cell_less(case, rng)) is not None:
            refused["one cell of time left out"][not accepted(json.dumps(new).encode())[0]] += 1
        if counts["plans"] % 20 == 1:
            slack += [share for share in [_slack(case)] if share is not None]
        if counts["plans"] % 50 == 0:
            print(counts["plans"], file=sys.stderr, flush=True)


def _slack(case: Case) -> float | None:
    """Of the room left, which share more of a margin is refused: by halving, from the room on."""
    if (near := nearest(case)) is None or near.room <= 0.0:
        return None
    low, high = 0.0, 1.0
    for _ in range(12):
        (new, stage), middle = _copy(case), (low + high) / 2.0
        stage["margins"][0] += middle * near.room
        low, high = (middle, high) if accepted(json.dumps(new).encode())[0] else (low, middle)
    return high


def _print(counts: Counter[str], refused: dict[str, Counter[bool]], figures: FloatArray, slack: FloatArray) -> None:
    print(f"\n{counts['plans']} plans, {counts['not written']} without a certificate, {counts['accepted']} accepted")
    print("\n| changed | certificates | refused | accepted |\n|---|---|---|---|")
    for kind, found in sorted(refused.items()):
        print(f"| {kind} | {found.total()} | {found[True]} | {found[False]} |")
    print("\n| | median | 98 % | worst |\n|---|---|---|---|")
    names = ("our verdicts, CPU s", "certificate made, CPU s", "read and checked, CPU s", "JSON, kB", "zipped, kB")
    for name, column in zip(names, figures.T, strict=True):
        print(f"| {name} | {np.median(column):.3g} | {np.quantile(column, 0.98):.3g} | {column.max():.3g} |")
    if slack.size:
        print(f"\nshare of the room left by which a margin has to grow to be refused: median {np.median(slack):.2f}, "
              f"from {slack.min():.2f} to {slack.max():.2f}, of {slack.size}")  # fmt: skip


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", type=Path, nargs="?", metavar="FILE", help="of problems of MotionBenchMaker")
    add_problem_options(parser, Path("runs/certificate-files"))
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0, help="of the first random move")
    parser.add_argument("--plane", action="store_true", help="random moves of planar arms")
    measure(parser.parse_args())


if __name__ == "__main__":
    main()

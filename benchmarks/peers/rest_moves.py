"""Joint-to-joint moves at rest: our closed form and Ruckig, which is optimal there."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

import numpy as np
import ruckig

from benchmarks.peers.report import Report, Size, certified, excess, in_parallel, milliseconds
from problems.robots import JointLimits
from problems.timing.free_space import rest_to_rest


@dataclass(frozen=True)
class Move:
    """One move: our duration over Ruckig's, seconds of both, our excess and certificate."""

    ratio: float
    ours: float
    peer: float
    excess: float
    certified: bool


def random_limits(rng: np.random.Generator, k: int) -> JointLimits:
    """Of k joints: any branch of the closed form may be the one."""
    return JointLimits(
        speed=tuple(rng.uniform(0.5, 4.0, k).tolist()),
        acceleration=tuple(rng.uniform(1.0, 20.0, k).tolist()),
        jerk=tuple((10.0 ** rng.uniform(0.5, 3.5, k)).tolist()),
    )


def move(seed: int) -> Move:
    rng = np.random.default_rng(seed)
    k = int(rng.integers(2, 8))
    limits = random_limits(rng, k)
    start = rng.uniform(-3.0, 3.0, k)
    goal = start + rng.uniform(-3.0, 3.0, k) * 10.0 ** rng.uniform(-2.0, 0.0)
    began = time.process_time()
    ours = rest_to_rest(start, goal, limits)
    between = time.process_time()
    question, answer = ruckig.InputParameter(k), ruckig.Trajectory(k)
    question.current_position, question.target_position = start.tolist(), goal.tolist()
    question.max_velocity, question.max_acceleration, question.max_jerk = (
        list(bound or ()) for bound in (limits.speed, limits.acceleration, limits.jerk)
    )
    ruckig.Ruckig(k).calculate(question, answer)
    ended = time.process_time()
    too_much = excess(partial(ours.at), ours.duration, limits)
    ratio = ours.duration / answer.duration
    return Move(ratio, between - began, ended - between, too_much, certified(ours, limits))


def rest_moves(size: Size) -> Report:
    moves = in_parallel(move, size.moves, size.workers)
    ratios = np.array([one.ratio for one in moves])
    proven = [one for one in moves if one.certified]
    row = [
        str(len(moves)),
        f"{np.median(ratios):.9f}",
        f"{ratios.min() - 1.0:+.1e}",
        f"{ratios.max() - 1.0:+.1e}",
        milliseconds(one.ours for one in moves),
        milliseconds(one.peer for one in moves),
        f"{max(one.excess for one in moves):.1e}",
        f"{len(proven)}, {sum(one.excess > 0.0 for one in proven)}",
    ]
    header = [
        "moves",
        "ours / Ruckig",
        "least",
        "most",
        "ours, CPU ms",
        "Ruckig, CPU ms",
        "our excess",
        "certified, falsely",
    ]
    title = "Moves from rest to rest, 2 to 7 joints, random limits (times: median / worst)"
    return Report(title, header, [row])

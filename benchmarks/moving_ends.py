"""Moves whose start or goal is in motion against the fastest motions in free space, by Ruckig: durations and seconds.

A Panda with limits of jerk moves between random postures in the middle of its ranges; joints arrive with up to 30 % of
their speeds, and half of the moves begin so. With ``--boxes`` it does so among random boxes of 15 cm, with
``--accelerations`` the ends that move have accelerations of up to so large a share of the limits. Moves are passed over
whose ends are not clear, or that Ruckig does not find.

    python -m benchmarks.moving_ends --moves 100
    python -m benchmarks.moving_ends --moves 100 --accelerations 0.3
    python -m benchmarks.moving_ends --moves 30 --boxes 10
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

import tpbso_casadi as tp
from problems.timing import MotionState, fastest_move

MIDDLE = 0.6  # share of the ranges from which postures are drawn
FASTEST = 0.3  # share of the speeds with which joints move at an end
SIDE, AWAY = 0.15, 0.7  # m: of a box; how far its centre may be from a point above the base, along each axis
ABOVE = 0.5  # m


@dataclass(frozen=True)
class Outcome:
    """One move.

    Attributes:
        certified: whether all limits are proven.
        ratio: the duration over that of the fastest motion in free space.
        seconds: of the processor, of the call.
    """

    certified: bool
    ratio: float
    seconds: float


def outcomes(robot: tp.StatedRobot, boxes: int, seed: int, accelerations: float) -> Iterator[Outcome]:
    """One outcome after another, of moves drawn at random."""
    limits, rng = robot.model.limits, np.random.default_rng(seed)
    low, high = np.array(limits.position).T
    speed = np.array(limits.speed)
    while True:
        start, goal = (low + high) / 2.0 + MIDDLE * rng.uniform(-0.5, 0.5, (2, speed.size)) * (high - low)
        leaving, arriving = FASTEST * rng.uniform(-1.0, 1.0, (2, speed.size)) * speed
        moves = rng.integers(0, 2)
        leaving, changes = leaving * moves, np.zeros((2, speed.size))
        if accelerations:
            changes = accelerations * rng.uniform(-1.0, 1.0, (2, speed.size)) * np.array(limits.acceleration)
            changes[0] *= moves
        states = MotionState(start, leaving, changes[0]), MotionState(goal, arriving, changes[1])
        around = [random_box(rng) for _ in range(boxes)]
        with suppress(tp.ScenarioError, tp.InvalidProblem):
            least = fastest_move(*states, limits).duration
            keys = {"start_acceleration": changes[0], "goal_acceleration": changes[1]} if accelerations else {}
            began = time.process_time()
            plan = tp.plan(
                robot, start=start, goal=goal, start_velocity=leaving, goal_velocity=arriving, obstacles=around, **keys
            )
            yield Outcome(plan.certified, plan.duration / least, time.process_time() - began)


def random_box(rng: np.random.Generator) -> tp.Box:
    """A box somewhere around the arm."""
    x, y, z = rng.uniform(-AWAY, AWAY, 3).tolist()
    return tp.Box(center=(x, y, ABOVE + z), size=(SIDE, SIDE, SIDE))


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=100)
    parser.add_argument("--boxes", type=int, default=0)
    parser.add_argument("--accelerations", type=float, default=0.0, help="share of the limits")
    parser.add_argument("--jerk", type=float, default=100.0, help="rad/s^3")
    parser.add_argument("--acceleration", type=float, default=7.0, help="rad/s^2")
    parser.add_argument("--seed", type=int, default=7)
    given = parser.parse_args()
    robot = tp.robot("panda", max_jerk=given.jerk, max_acceleration=given.acceleration)
    drawn = outcomes(robot, given.boxes, given.seed, given.accelerations)
    found = [next(drawn) for _ in range(given.moves)]
    ratios, seconds = ([getattr(one, name) for one in found if one.certified] for name in ("ratio", "seconds"))
    print(f"certified {len(ratios)} of {len(found)}")
    for name, values in (("duration over Ruckig's", ratios), ("CPU s", seconds)):
        print(f"{name}, median/90 %/worst: " + "/".join(f"{each:.3f}" for each in np.percentile(values, (50, 90, 100))))


if __name__ == "__main__":
    main()

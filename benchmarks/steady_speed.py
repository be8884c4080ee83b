"""Steady speeds of the tool along five ways, measured by kinematics in NumPy: where they are kept, and how well.

The speed is that of differences between 20,000 times, beyond the distances from ends and corners that a plan states.

    python -m benchmarks.steady_speed
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.lines import tool
from problems.base import FloatArray

TIMES = 20_000
PANDA, UR5E = [0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.8], [0.2, -1.4, 1.6, -1.6, -1.6, 0.3]
IIWA = [0.3, 0.6, 0.0, -1.4, 0.0, 1.1, 0.0]
SQUARE = [[0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.0]]  # m, from the start
HEADER = ("way", "speed m/s", "T s", "CPU s", "least beyond", "most", "at ends mm", "at corners mm", "share of the way")


def line(at: FloatArray) -> tp.Line:
    """A line of 0.27 m."""
    return tp.Line(by=[0.0, 0.25, 0.1], tool_speed=0.1)


def arc(at: FloatArray) -> tp.Line:
    """An arc of 0.22 m."""
    goal, through = (at + np.array(by) for by in ([0.0, 0.2, 0.0], [0.08, 0.1, 0.0]))
    return tp.Line(goal.tolist(), through=through.tolist(), tool_speed=0.05)


def square(at: FloatArray) -> tp.Along:
    """A square of 0.1 m, whose corners are rounded."""
    return tp.Along((at + np.array(SQUARE)).tolist(), accuracy=0.005, tool_speed=0.2)


def slow_square(at: FloatArray) -> tp.Along:
    """The square at a quarter of the speed, which is kept more exactly."""
    return replace(square(at), tool_speed={"speed": 0.05, "tolerance": 0.02})


WAYS: tuple[tuple[str, list[float], Callable[[FloatArray], tp.Line | tp.Along]], ...] = (
    ("panda", PANDA, line),
    ("ur5e", UR5E, line),
    ("iiwa14", IIWA, arc),
    ("panda", PANDA, square),
    ("ur5e", UR5E, slow_square),
)


def measured(arm: str, start: list[float], stage: Any) -> list[str]:
    """The figures of one way."""
    stated = tp.robot(arm)
    (at,) = tool(stated.model, np.array([start]))[0]
    began = time.process_time()
    plan = tp.sequence(stated, start=start, stages=[stage(at)])
    seconds = time.process_time() - began
    kept = plan.scenario.task.stages[0].tool_speed
    times = np.linspace(0.0, plan.duration, TIMES + 1)
    places = tool(stated.model, plan.trajectory.at(times))[0]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    beyond = _beyond(places, kept, stage(at))
    speeds = steps / np.diff(times) / kept.speed
    figures = [f"{speeds[beyond].min():.4f}", f"{speeds.max():.4f}"]
    distances = ["" if far is None else f"{1e3 * far:.1f}" for far in (kept.at_ends, kept.at_corners)]
    share = f"{steps[beyond].sum() / steps.sum():.3f}"
    return [f"{kept.speed:g}", f"{plan.duration:.4f}", f"{seconds:.2f}", *figures, *distances, share]


def _beyond(places: FloatArray, kept: Any, stage: Any) -> FloatArray:
    """Whether the steps between places (n, 3) are farther from ends and corners than is stated, (n - 1,)."""
    corners = np.array(stage.points)[:-1] if isinstance(stage, tp.Along) else np.empty((0, 3))
    marks = np.concatenate([places[[0, -1]], corners])
    within = np.array([kept.at_ends] * 2 + [kept.at_corners or 0.0] * len(corners))
    far = (np.linalg.norm(places[:, None] - marks, axis=2) > within).all(axis=1)
    return np.asarray(far[1:] & far[:-1])


def main() -> None:
    print(f"| {' | '.join(HEADER)} |\n" + "|---" * len(HEADER) + "|")
    for arm, start, stage in WAYS:
        print(f"| {stage.__name__.replace('_', ' ')}, {arm} | {' | '.join(measured(arm, start, stage))} |", flush=True)


if __name__ == "__main__":
    main()

"""Tables of a motion past given postures: interval times, peaks of the joints, the fastest motion and a bound."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from problems import Trajectory
from problems.base import FloatArray
from problems.timing import fastest_through
from tpbso_casadi.display.console import OutputConsole, number, prose, table_of, word
from tpbso_casadi.planning import JudgedMotion

PEAKS = ("speed", "acceleration", "jerk", "mean |jerk|")
SAME = 1e-6  # relative: a duration that differs by less is the same


def print_passing(motion: JudgedMotion, console: OutputConsole) -> None:
    """The tables of a motion that passes given postures; nothing of another one."""
    if motion.criteria.task.passed_postures is None:
        return
    table = table_of(prose("through the given postures"), number("duration, s"), number("this motion takes"))
    for name, duration in durations_through(motion):
        table.add_row(name, f"{duration:.6g}", f"{motion.trajectory.duration / duration - 1.0:+.2%}")
    console.print_table(f"interval times: {'  '.join(f'{time:.4g}' for time in interval_times(motion))} s", table)
    joints, trajectory = motion.criteria.robot.joints, motion.trajectory
    columns = PEAKS if motion.criteria.robot.limits.jerk is not None else PEAKS[:2]  # else jerks are infinite
    peaks = table_of(word("joint"), *map(number, columns))
    for name, unit, row in zip(joints.names, joints.units, joint_peaks(trajectory), strict=True):
        peaks.add_row(f"{name}, {unit}", *(f"{value:.4g}" for value in row[: len(columns)]))
    console.print_table("largest absolute values of the joints, with time in s", peaks)


def interval_times(motion: JudgedMotion) -> FloatArray:
    """The times between the postures, and other knots that the motion has, s."""
    passed = [milestone.time for milestone in motion.criteria.milestones(motion.trajectory)]
    return np.diff([0.0, *passed, motion.trajectory.duration])


def durations_through(motion: JudgedMotion) -> Iterator[tuple[str, float]]:
    """The duration of the motion, of the fastest that is found where nothing else is in the way, and a lower bound."""
    duration, task, limits = motion.trajectory.duration, motion.criteria.task, motion.criteria.robot.limits
    yield "this motion", duration
    postures, least = task.passed_postures, motion.least_duration
    fastest = None if postures is None else fastest_through(postures, limits, task.end_rates)
    if fastest is not None and abs(fastest.duration - duration) > SAME * duration:
        yield "the fastest that is found in free space, at free times", fastest.duration
    if least is not None:
        yield "none is faster: a bound in floating point, not proven", least


def joint_peaks(trajectory: Trajectory) -> FloatArray:
    """Largest absolute speed, acceleration and jerk of each joint, and its mean absolute jerk, (k, 4)."""
    peaks = [np.abs(trajectory.at(trajectory.extreme_times(order), order)).max(axis=0) for order in (1, 2, 3)]
    accelerations = trajectory.at(trajectory.extreme_times(2), 2)
    turned = np.abs(np.diff(accelerations, axis=0)).sum(axis=0)
    return np.column_stack([*peaks, turned / trajectory.duration])

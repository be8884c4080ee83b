"""A motion for a robot controller: at equal steps of time, as a ROS message in JSON, CSV or NPZ."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.files import OutputError, write_text, write_with, writing
from tpbso_casadi.storage.motion_table import write_motion

DEFAULT_RATE = 100.0  # Hz
HIGHEST_RATE = 10_000.0  # Hz
MOST_ROWS = 200_000  # which take some hundred MB
NANOSECONDS = 1_000_000_000  # in a second


def export_motion(folder: Path, motion: Motion, kind: str, rate: float = DEFAULT_RATE) -> Path:
    """Write a motion at equal steps of time; the last step is shorter if it must be.

    Args:
        folder: to write to.
        motion: to be written.
        kind: a key of ``EXPORTS``.
        rate: steps per second, Hz.

    Raises:
        OutputError: it cannot be written, or is too long for this rate.
    """
    with writing(folder):
        return EXPORTS[kind](folder, motion, equal_steps(motion, rate))


def equal_steps(motion: Motion, rate: float) -> FloatArray:
    """Times in s from 0 to the end of the motion, at least two.

    Raises:
        OutputError: they are more than ``MOST_ROWS``.
    """
    duration = motion.trajectory.duration
    if not duration * rate <= MOST_ROWS:
        raise OutputError(
            f"--rate {rate:g}: makes more than {MOST_ROWS} rows of a motion of {duration:.4g} s; "
            f"at most {MOST_ROWS / duration:.4g} Hz"
        )
    times = np.arange(np.ceil(duration * rate * (1.0 - 1e-9))) / rate
    return np.append(times, duration)


def ros_message(motion: Motion, times: FloatArray) -> dict[str, Any]:
    """The fields of a ``trajectory_msgs/msg/JointTrajectory``; rad, rad/s, rad/s^2."""
    samples = motion.trajectory.samples(times)
    columns = (as_array(matrix).tolist() for matrix in (samples.theta, samples.speed, samples.acceleration))
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "base"},
        "joint_names": [f"joint_{joint + 1}" for joint in range(motion.problem.robot.dof)],
        "points": [
            {
                "positions": theta,
                "velocities": speed,
                "accelerations": acceleration,
                "effort": [],
                "time_from_start": dict(
                    zip(("sec", "nanosec"), divmod(round(time * NANOSECONDS), NANOSECONDS), strict=True)
                ),
            }
            for time, theta, speed, acceleration in zip(times.tolist(), *columns, strict=True)
        ],
    }


def _ros_json(folder: Path, motion: Motion, times: FloatArray) -> Path:
    text = json.dumps(ros_message(motion, times), indent=1, allow_nan=False)
    return write_text(folder / "joint_trajectory.json", lambda file: file.write(text + "\n"))


def _csv(folder: Path, motion: Motion, times: FloatArray) -> Path:
    return write_motion(folder / "joint_trajectory.csv", motion, times)


def _npz(folder: Path, motion: Motion, times: FloatArray) -> Path:
    samples = motion.trajectory.samples(times, motion.problem.robot)
    arrays = {
        "t": times,
        "q": as_array(samples.theta),
        "qd": as_array(samples.speed),
        "qdd": as_array(samples.acceleration),
        "tip": as_array(samples.tool),
        "breakpoints": motion.trajectory.breakpoints,
        "coefficients": motion.trajectory.coefficients,
    }
    return write_with(folder / "joint_trajectory.npz", lambda temporary: np.savez(temporary, **arrays))  # type: ignore[arg-type]


EXPORTS: dict[str, Callable[[Path, Motion, FloatArray], Path]] = {"ros-json": _ros_json, "csv": _csv, "npz": _npz}

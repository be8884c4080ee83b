"""A motion for a robot controller: at equal steps of time, as a ROS message in JSON or YAML, as CSV or NPZ."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.files import OutputError, write_text, write_with, writing
from tpbso_casadi.storage.motion_table import write_motion
from tpbso_casadi.storage.ros import message_json, message_yaml

DEFAULT_RATE = 100.0  # Hz
HIGHEST_RATE = 10_000.0  # Hz
MOST_ROWS = 200_000  # which take some hundred MB


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


def _ros_json(folder: Path, motion: Motion, times: FloatArray) -> Path:
    return write_text(folder / "joint_trajectory.json", lambda file: file.write(message_json(motion, times)))


def _ros_yaml(folder: Path, motion: Motion, times: FloatArray) -> Path:
    return write_text(folder / "joint_trajectory.yaml", lambda file: file.writelines(message_yaml(motion, times)))


def _csv(folder: Path, motion: Motion, times: FloatArray) -> Path:
    return write_motion(folder / "joint_trajectory.csv", motion, times)


def _npz(folder: Path, motion: Motion, times: FloatArray) -> Path:
    robot, samples = motion.problem.robot, motion.trajectory.samples(times)
    pose = np.column_stack([*robot.pose(as_array(samples.theta)).values()])
    arrays = {
        "t": times,
        "q": as_array(samples.theta),
        "qd": as_array(samples.speed),
        "qdd": as_array(samples.acceleration),
        "tip": pose[:, : robot.dim],
        "breakpoints": motion.trajectory.breakpoints,
        "coefficients": motion.trajectory.coefficients,
    }
    torques = motion.torques(times)
    if torques is not None:
        arrays["tau"] = torques
    if pose.shape[1] > robot.dim:
        arrays |= {"quaternion": pose[:, robot.dim :], "joint_names": np.array(robot.joint_identifiers)}
    return write_with(folder / "joint_trajectory.npz", lambda temporary: np.savez(temporary, **arrays))  # type: ignore[arg-type]


EXPORTS: dict[str, Callable[[Path, Motion, FloatArray], Path]] = {
    "ros-json": _ros_json, "ros-yaml": _ros_yaml, "csv": _csv, "npz": _npz
}  # fmt: skip

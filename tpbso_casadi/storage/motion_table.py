"""``trajectory.csv``: a motion as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.files import write_csv

TORQUE = "tau"  # of a joint: how the names of such columns begin


def write_motion(path: Path, motion: Motion, times: FloatArray) -> Path:
    """Write the table of a motion at times (n,) in s.

    Raises:
        OSError: it cannot be written.
    """
    header, table = table_of(motion, times)
    return write_csv(path, header, table.tolist())


def table_of(motion: Motion, times: FloatArray) -> tuple[list[str], FloatArray]:
    """``t, q1..qk, qd1..qdk, qdd1..qddk`` and the tool's pose at times (n,) in s: the header and a row for each.

    The pose is ``x, y`` in the plane, ``x, y, z, qx, qy, qz, qw`` in space; s, rad and m. Where masses are known,
    torques ``tau1..tauk`` follow, N m (N where a joint slides).
    """
    robot, samples = motion.problem.robot, motion.trajectory.samples(times)
    pose = robot.pose(as_array(samples.theta))
    joints = range(1, robot.dof + 1)
    header = ["t", *(f"{symbol}{joint}" for symbol in ("q", "qd", "qdd") for joint in joints), *pose]
    parts = (as_array(matrix) for matrix in (samples.theta, samples.speed, samples.acceleration))
    columns, torques = [times, *parts, *pose.values()], motion.torques(times)
    if torques is not None:
        header += [f"{TORQUE}{joint}" for joint in joints]
        columns.append(torques)
    return header, np.column_stack(columns)

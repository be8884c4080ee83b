"""``trajectory.csv``: a motion as a table."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.storage.files import write_csv


def write_motion(path: Path, motion: Motion, times: FloatArray) -> Path:
    """Write the table of a motion at times (n,) in s.

    Raises:
        OSError: it cannot be written.
    """
    header, table = table_of(motion, times)
    return write_csv(path, header, table.tolist())


def table_of(motion: Motion, times: FloatArray) -> tuple[list[str], FloatArray]:
    """``t, q1..qk, qd1..qdk, qdd1..qddk, x, y`` in s, rad and m: the header and a row for each of the times (n,)."""
    samples = motion.trajectory.samples(times, motion.problem.robot)
    joints, axes = range(1, motion.problem.robot.dof + 1), "xyz"[: motion.problem.robot.dim]
    header = ["t", *(f"{symbol}{joint}" for symbol in ("q", "qd", "qdd") for joint in joints), *axes]
    parts = (samples.theta, samples.speed, samples.acceleration, samples.tool)
    return header, np.column_stack([times, *(as_array(matrix) for matrix in parts)])

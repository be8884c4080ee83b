"""Motions as tables: rows, exact pieces, stages."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems import Trajectory
from problems.base import FloatArray, as_array
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.storage.files import write_csv, write_with

TORQUE = "tau"  # of a joint: how the names of such columns begin


def write_motion(path: Path, motion: JudgedMotion, times: FloatArray) -> Path:
    """Write the table of a motion at times (n,) in s.

    Raises:
        OSError: it cannot be written.
    """
    header, table = table_of(motion, times)
    return write_csv(path, header, table.tolist())


PIECES = "motion.npz"  # in the folder of a sequence: breakpoints and coefficients, as of a solution


def write_pieces(path: Path, trajectory: Trajectory) -> Path:
    """Write the polynomials of a motion, exact.

    Raises:
        OSError: it cannot be written.
    """
    arrays = {"breakpoints": trajectory.breakpoints, "coefficients": trajectory.coefficients}
    return write_with(path, lambda temporary: np.savez(temporary, **arrays))  # type: ignore[arg-type]


def write_stages(path: Path, motion: JudgedMotion) -> Path:
    """Write when each stage begins and ends, s, and what is told at its beginning.

    Raises:
        OSError: it cannot be written.
    """
    rows = [
        [stage.label, stage.kind, stage.start, stage.end, *(("", "") if stage.signal is None else stage.signal)]
        for stage in motion.stages
    ]
    return write_csv(path, ["stage", "kind", "start", "end", "signal", "value"], rows)


def table_of(motion: JudgedMotion, times: FloatArray) -> tuple[list[str], FloatArray]:
    """``t, q1..qk, qd1..qdk, qdd1..qddk`` and the tool's pose at times (n,) in s: the header and a row for each.

    The pose is ``x, y`` in the plane, ``x, y, z, qx, qy, qz, qw`` in space; s, rad and m. Where masses are known,
    torques ``tau1..tauk`` follow, N m (N where a joint slides).
    """
    robot, samples = motion.criteria.robot, motion.trajectory.samples(times)
    pose = robot.tool.coordinates(as_array(samples.theta))
    joints = range(1, robot.dof + 1)
    header = ["t", *(f"{symbol}{joint}" for symbol in ("q", "qd", "qdd") for joint in joints), *pose]
    parts = (as_array(matrix) for matrix in (samples.theta, samples.speed, samples.acceleration))
    columns, torques = [times, *parts, *pose.values()], motion.torques(times)
    if torques is not None:
        header += [f"{TORQUE}{joint}" for joint in joints]
        columns.append(torques)
    return header, np.column_stack(columns)

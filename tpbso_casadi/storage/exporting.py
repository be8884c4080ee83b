"""Motions as tables and messages: CSV, NPZ, ROS."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from problems import Trajectory
from problems.base import FloatArray, as_array
from tpbso_casadi.planning import ControllerRows, JudgedMotion, PlannedMotion
from tpbso_casadi.storage.files import OutputError, write_csv, write_text, write_with, writing

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


NANOSECONDS = 1_000_000_000  # in a second
VALUES = ("positions", "velocities", "accelerations", "effort")  # of a point


def ros_message(rows: ControllerRows) -> dict[str, Any]:
    """The fields of the message, a point for each row.

    In rad, rad/s, rad/s^2, N m; m and N where a joint slides. There is no effort where masses are not known.
    """
    robot, torques = rows.source.criteria.robot, rows.source.torques(rows.times)
    none: list[list[float]] = [[]] * len(rows.times)
    states = [state.tolist() for state in rows.states]
    effort = none if torques is None else torques.tolist()
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": robot.joints.base},
        "joint_names": list(robot.joints.identifiers),
        "points": [
            {
                **dict(zip(VALUES, values, strict=True)),
                "time_from_start": dict(
                    zip(("sec", "nanosec"), divmod(round(time * NANOSECONDS), NANOSECONDS), strict=True)
                ),
            }
            for time, *values in zip(rows.times.tolist(), *[*states, none][:3], effort, strict=True)
        ],
    }


def message_json(rows: ControllerRows) -> str:
    """A trajectory message of ROS in JSON, made of the rows for a controller."""
    return json.dumps(ros_message(rows), indent=1, allow_nan=False) + "\n"


def message_yaml(rows: ControllerRows) -> Iterator[str]:
    """The lines of the message in YAML, as ``ros2 topic pub`` and ``rosmsg`` read it."""
    message = ros_message(rows)
    stamp, names = message["header"]["stamp"], message["joint_names"]
    yield "header:\n"
    yield f"  stamp: {_time(stamp)}\n"
    yield f"  frame_id: {_text(message['header']['frame_id'])}\n"
    yield f"joint_names: [{', '.join(map(_text, names))}]\n"
    yield "points:\n"
    for point in message["points"]:
        for key, lead in zip(VALUES, ("- ", "  ", "  ", "  "), strict=True):
            yield f"{lead}{key}: {_numbers(point[key])}\n"
        yield f"  time_from_start: {_time(point['time_from_start'])}\n"


def _time(stamp: dict[str, int]) -> str:
    return f"{{sec: {stamp['sec']}, nanosec: {stamp['nanosec']}}}"


def _text(name: str) -> str:
    """A scalar in double quotes, which are those of JSON."""
    return json.dumps(name, ensure_ascii=False)


def _numbers(values: Sequence[float]) -> str:
    return f"[{', '.join(map(_number, values))}]"


def _number(value: float) -> str:
    """Without a point, YAML 1.1 would take 1e-05 for a word."""
    digits, exponent, power = repr(value).partition("e")
    return f"{digits if '.' in digits else digits + '.0'}{exponent}{power}"


DEFAULT_RATE = 100.0  # Hz, of tables
HIGHEST_RATE = 10_000.0  # Hz
MOST_ROWS = 200_000  # which take some hundred MB


def export_plan(folder: Path, plan: PlannedMotion, kind: str, rate: float | None = None) -> Path:
    """Write a plan as a file for robots.

    Args:
        folder: to write to.
        plan: to be written.
        kind: a key of ``EXPORTS``.
        rate: of rows at equal steps of time, Hz, the last one shorter if it must be. Where None, those for a controller
            are such that what it makes of them is proven; others have the usual rate.

    Raises:
        OutputError: it cannot be written, or is too long for this rate.
    """
    with writing(folder):
        return EXPORTS[kind](folder, exported_rows(plan, kind, rate))


def exported_rows(plan: PlannedMotion, kind: str, rate: float | None = None) -> ControllerRows:
    """The rows of an export: at equal steps where a rate in Hz is stated, or it is no message.

    Raises:
        OutputError: they are too many.
    """
    if rate is None and kind in MESSAGES:
        return plan.controller_rows
    return ControllerRows(plan.motion, equal_steps(plan.motion, rate or DEFAULT_RATE))


def equal_steps(motion: JudgedMotion, rate: float) -> FloatArray:
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


def _ros_json(folder: Path, rows: ControllerRows) -> Path:
    return write_text(folder / "joint_trajectory.json", lambda file: file.write(message_json(rows)))


def _ros_yaml(folder: Path, rows: ControllerRows) -> Path:
    return write_text(folder / "joint_trajectory.yaml", lambda file: file.writelines(message_yaml(rows)))


def _csv(folder: Path, rows: ControllerRows) -> Path:
    return write_motion(folder / "joint_trajectory.csv", rows.source, rows.times)


def _npz(folder: Path, rows: ControllerRows) -> Path:
    motion, times = rows.source, rows.times
    robot, samples = motion.criteria.robot, motion.trajectory.samples(times)
    pose = np.column_stack([*robot.tool.coordinates(as_array(samples.theta)).values()])
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
        arrays |= {"quaternion": pose[:, robot.dim :], "joint_names": np.array(robot.joints.identifiers)}
    return write_with(folder / "joint_trajectory.npz", lambda temporary: np.savez(temporary, **arrays))  # type: ignore[arg-type]


MESSAGES: dict[str, Callable[[Path, ControllerRows], Path]] = {"ros-json": _ros_json, "ros-yaml": _ros_yaml}
EXPORTS = {**MESSAGES, "csv": _csv, "npz": _npz}

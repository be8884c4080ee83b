"""A motion as a ROS message ``trajectory_msgs/msg/JointTrajectory``, in JSON and in YAML."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion

NANOSECONDS = 1_000_000_000  # in a second
VALUES = ("positions", "velocities", "accelerations", "effort")  # of a point


def ros_message(motion: Motion, times: FloatArray) -> dict[str, Any]:
    """The fields of the message, a point for each of the times (n,) in s.

    In rad, rad/s, rad/s^2, N m; m and N where a joint slides. There is no effort where masses are not known.
    """
    robot, samples = motion.problem.robot, motion.trajectory.samples(times)
    torques = motion.torques(times)
    columns = (as_array(matrix).tolist() for matrix in (samples.theta, samples.speed, samples.acceleration))
    effort = [[]] * len(times) if torques is None else torques.tolist()
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": robot.base_name},
        "joint_names": list(robot.joint_identifiers),
        "points": [
            {
                **dict(zip(VALUES, values, strict=True)),
                "time_from_start": dict(
                    zip(("sec", "nanosec"), divmod(round(time * NANOSECONDS), NANOSECONDS), strict=True)
                ),
            }
            for time, *values in zip(times.tolist(), *columns, effort, strict=True)
        ],
    }


def message_json(motion: Motion, times: FloatArray) -> str:
    """The message in JSON."""
    return json.dumps(ros_message(motion, times), indent=1, allow_nan=False) + "\n"


def message_yaml(motion: Motion, times: FloatArray) -> Iterator[str]:
    """The lines of the message in YAML, as ``ros2 topic pub`` and ``rosmsg`` read it."""
    message = ros_message(motion, times)
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

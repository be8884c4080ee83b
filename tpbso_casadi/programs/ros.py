"""Messages for the joint trajectory controller of ROS: as few rows as an accuracy needs, as JSON or YAML.

[1] https://control.ros.org, joint_trajectory_controller, "Trajectory Representation": rows are joined by cubics where
they state velocities, by quintics where they state accelerations too.
"""

from __future__ import annotations

import json
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np

from problems.base import Range
from problems.robots import own_name
from tpbso_casadi.planning import ACCURACY, ControllerRows, JudgedMotion, PlannedMotion
from tpbso_casadi.programs.program import Exporter, Program, Proof
from tpbso_casadi.programs.tables import Rate, equal_steps

NANOSECONDS = 1_000_000_000  # in a second
VALUES = ("positions", "velocities", "accelerations", "effort")  # of a point


def ros_message(rows: ControllerRows, arm: str | None = None) -> dict[str, Any]:
    """The fields of the message, a point for each row.

    In rad, rad/s, rad/s^2, N m; m and N where a joint slides. There is no effort where masses are not known.

    Args:
        rows: of all joints.
        arm: whose joints are listed, under the names of their own controller; all where None.
    """
    robot, torques = rows.source.criteria.robot, rows.source.torques(rows.times)
    names, own = robot.joints.identifiers, list(range(robot.dof) if arm is None else robot.arms[arm])
    none: list[list[float]] = [[]] * len(rows.times)
    states = [state[:, own].tolist() for state in rows.states]
    effort = none if torques is None else torques[:, own].tolist()
    return {
        "header": {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": robot.joints.base},
        "joint_names": [names[joint] if arm is None else own_name(names[joint], arm) for joint in own],
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


def message_yaml(message: dict[str, Any]) -> Iterator[str]:
    """The lines of a message in YAML, as ``ros2 topic pub`` and ``rosmsg`` read it."""
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


class Message(Exporter):
    """A writer of trajectory messages.

    Attributes:
        accuracy: how far the controller's motion may be from the plan, rad or m.
        rate: of rows at equal steps of time, Hz; None for rows such that what the controller makes of them is proven.
    """

    file: ClassVar[str]

    accuracy: Annotated[float, Range(least=1e-9, most=1.0)] = ACCURACY
    rate: Rate | None = None

    @abstractmethod
    def text(self, message: dict[str, Any]) -> str:
        """The text of a message."""

    def rows(self, plan: PlannedMotion) -> ControllerRows:
        """The rows of a plan.

        Raises:
            OutputError: they are too many.
        """
        if self.rate is not None:
            return ControllerRows(plan.motion, equal_steps(plan.motion, self.rate))
        return plan.controller_rows if self.accuracy == ACCURACY else ControllerRows.of(plan.motion, self.accuracy)

    def program(self, plan: PlannedMotion) -> Program:
        rows, stages = self.rows(plan), plan.motion.stages
        return Program(
            content=f"joint_trajectory: {rows.described}",
            proofs=(Proof("what the controller's splines make of the rows", rows.joined.status),),
            assumptions=("the robot is at the first row, as fast as it says", *_of_clocks(plan.motion)),
            unstated=tuple(f"signal {each.signal[0]}={each.signal[1]}" for each in stages if each.signal),
            planned=plan.motion.status,
            files={name: self.text(ros_message(rows, arm)) for name, arm in self._files(plan.motion)},
        )

    def _files(self, motion: JudgedMotion) -> Iterator[tuple[str, str | None]]:
        """The names of the files, and the arm of which each is: of all joints together, and of each arm of several."""
        yield self.file, None
        stem, dot, suffix = self.file.rpartition(".")
        yield from ((f"{stem}_{arm}{dot}{suffix}", arm) for arm in motion.criteria.robot.arms)


LATE = 1e-3  # s, by which one controller may start after another


def _of_clocks(motion: JudgedMotion) -> Iterator[str]:
    """A line on what it costs that the controllers of several arms do not start together."""
    robot = motion.criteria.robot
    if not robot.arms:
        return
    fastest = np.abs(motion.trajectory.at(motion.trajectory.extreme_times(1), 1)).max(axis=0)
    most = LATE * max(float(fastest[list(own)].max()) for own in robot.arms.values())
    yield (
        f"the controllers of {' and '.join(robot.arms)} start together: {1e3 * LATE:g} ms late is up to {most:.2g} rad "
        "of a joint, which tracking_error covers if it states so much"
    )


class RosJson(Message):
    """The fields of a ``trajectory_msgs/JointTrajectory`` as JSON."""

    title: ClassVar[str] = "ROS, JSON"
    file: ClassVar[str] = "joint_trajectory.json"

    def text(self, message: dict[str, Any]) -> str:
        return json.dumps(message, indent=1, allow_nan=False) + "\n"


class RosYaml(Message):
    """The message as YAML, as ``ros2 topic pub`` reads it."""

    title: ClassVar[str] = "ROS, YAML"
    file: ClassVar[str] = "joint_trajectory.yaml"

    def text(self, message: dict[str, Any]) -> str:
        return "".join(message_yaml(message))

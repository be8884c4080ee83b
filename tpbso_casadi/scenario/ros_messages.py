"""Motions in the messages of ROS, as JSON or as what YAML holds."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

from problems.base import number_of, shown_value
from tpbso_casadi.plain import one_line
from tpbso_casadi.scenario.input_files import InputFolder
from tpbso_casadi.scenario.recorded_rows import LARGEST_STATE, RATES, BadRow, RecordedRows, Row, check_count
from tpbso_casadi.scenario.validation import MOST_LINKS


def read_json(folder: InputFolder, name: str) -> RecordedRows:
    """The rows of a message in JSON; errors as of one in YAML."""
    text = folder.read_text(name)
    try:
        return rows_of_message(json.loads(text, object_pairs_hook=_without_doubles))
    except BadRow:
        raise
    except json.JSONDecodeError as error:
        raise BadRow(f"not JSON in line {error.lineno}: {error.msg}") from error
    except (ValueError, RecursionError) as error:
        raise BadRow(f"not JSON: {error or 'nested too deeply'}") from error


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise BadRow(f"the key {shown_value(key)} is there twice")
        found[key] = value
    return found


WRAPPERS = ("joint_trajectory", "trajectory", "planned_trajectory", "goal", "motion_plan_response", "solution")
MOST_WRAPPERS = 8  # within each other
STARTS = ("trajectory_start", "start_state", "sequence_start")
MOST_LISTED = 5  # objects
SAME_STATE = 1e-3  # rad or m: what encoders and text of a few digits may differ by


def rows_of_message(document: Any) -> RecordedRows:
    """The rows of a JointTrajectory, or of a message that holds one.

    Raises:
        BadRow: it does not.
    """
    key, message, starts = _joint_trajectory(document)
    names = message["joint_names"]
    if (
        not isinstance(names, list)
        or not names
        or not all(isinstance(each, str) and each.isprintable() for each in names)
    ):
        raise BadRow(f"{key}joint_names: a list of words is needed")
    if len(names) > MOST_LINKS:
        raise BadRow(f"{key}joint_names: {len(names)} joints; at most {MOST_LINKS}")
    points = message["points"]
    if not isinstance(points, list):
        raise BadRow(f"{key}points: a list is needed")
    check_count(len(points))
    times: list[float] = []
    states: dict[str, list[Row]] = {state: [] for state in ("positions", *RATES)}
    for number, point in enumerate(points):
        place = f"{key}points[{number}]"
        if not isinstance(point, dict):
            raise BadRow(f"{place}: a table is needed, not {shown_value(point)}")
        times.append(_seconds(point.get("time_from_start"), f"{place}.time_from_start"))
        for state, rows in states.items():
            rows.append(_values(point.get(state), len(names), f"{place}.{state}", state == "positions"))
    stated = {state: rows if any(rows) else [] for state, rows in states.items()}
    first = dict(zip(names, stated["positions"][0], strict=True))
    remarks = [line for place, start in starts for line in _start_remarks(place, start, first)]
    return RecordedRows(
        times, stated["positions"], stated["velocities"], stated["accelerations"], names, remarks=remarks
    )


COMMANDED, MEASURED = ("reference", "desired"), ("feedback", "actual")  # of new versions of ROS, and of former ones


def rows_of_states(messages: list[tuple[dict[str, Any], float]]) -> RecordedRows:
    """The rows of a recording of ``sensor_msgs/JointState``: of the joints of the largest message, from t = 0.

    Args:
        messages: each with the time at which it was written, s, which counts where none has a stamp.

    Raises:
        BadRow: a message is none, or they are too many.
    """
    return _rows_of(messages, "name", {"positions": "position", "velocities": "velocity"}, "JointState")


def rows_of_controller(messages: list[tuple[dict[str, Any], float]]) -> RecordedRows:
    """The rows of a recording of ``control_msgs/JointTrajectoryControllerState``, as commanded and as measured.

    Args:
        messages: each with the time at which it was written, s.

    Raises:
        BadRow: a message is none, or they are too many.
    """
    kind = "JointTrajectoryControllerState"
    sides = {"positions": COMMANDED, "measured": MEASURED}
    told = [
        ({**message, **{key: _positions_of(message, names) for key, names in sides.items()}}, time)
        for message, time in messages
    ]
    rows = _rows_of(told, "joint_names", {"positions": "positions", "measured": "measured"}, kind)
    if not rows.measured or not all(rows.measured):
        raise BadRow(f"a {kind} has no positions as measured")
    return rows


def _positions_of(message: dict[str, Any], names: tuple[str, ...]) -> Any:
    """The positions of the first of several points of a message that states any."""
    points = [message[name] for name in names if isinstance(message.get(name), dict)]
    return next((point["positions"] for point in points if point.get("positions")), [])


def _rows_of(messages: list[tuple[dict[str, Any], float]], named: str, keys: dict[str, str], kind: str) -> RecordedRows:
    """The rows of messages: of the joints of the largest one, from t = 0.

    Args:
        messages: each with the time at which it was written, s, which counts where none has a stamp.
        named: the key of the names of joints.
        keys: of the values, by what they are in rows; positions are needed.
        kind: of the messages.

    Raises:
        BadRow: a message is none, or they are too many.
    """
    try:
        names = Counter(tuple(map(str, message[named])) for message, _ in messages)
        chosen = max(names, key=lambda each: (len(each), names[each]))
        kept = [(message, time) for message, time in messages if set(message[named]) >= set(chosen)]
        stamps = [message["header"]["stamp"] for message, _ in kept]
        since = [(each["sec"] - stamps[0]["sec"]) + 1e-9 * (each["nanosec"] - stamps[0]["nanosec"]) for each in stamps]
        stamped = any(each["sec"] or each["nanosec"] for each in stamps)
        told = [(message[named], {state: message[key] for state, key in keys.items()}) for message, _ in kept]
    except (KeyError, TypeError) as error:
        raise BadRow(f"a message is no {kind}: {type(error).__name__}, {error}") from error
    check_count(len(kept))
    times = since if stamped else [time - kept[0][1] for _, time in kept]
    states: dict[str, Any] = {state: [] for state in keys}
    for number, (joints, values) in enumerate(told, start=1):
        columns = [joints.index(name) for name in chosen]
        for state, value in values.items():
            row = _values(value, len(joints), f"message {number}: {state}", state == "positions")
            states[state].append([row[column] for column in columns] if row else [])
    stated = {state: rows for state, rows in states.items() if any(rows)}
    left_out = len(messages) - len(kept)
    note = f"{left_out} message{'s' * (left_out > 1)} of other joints left out"
    return RecordedRows(times, **stated, joint_names=list(chosen), notes=[note] if left_out else [])


def _start_remarks(place: str, start: dict[str, Any], first: dict[str, float]) -> Iterator[str]:
    """Remarks on the state in which a motion begins, as far as rows of joints do not say it."""
    attached = start.get("attached_collision_objects")
    if isinstance(attached, list) and attached:
        objects = (each.get("object") if isinstance(each, dict) else None for each in attached)
        names = [str(each.get("id", "")) if isinstance(each, dict) else "" for each in objects]
        listed = ", ".join(one_line(name) or "one without a name" for name in names[:MOST_LISTED])
        yield f"what is attached in {place} ({listed}); [[carried]] of a scene states it"
    joints = start.get("joint_state")
    known, values = ([] if not isinstance(joints, dict) else joints.get(each) or [] for each in ("name", "position"))
    if not isinstance(known, list) or not isinstance(values, list) or len(known) != len(values):
        raise BadRow(f"{place}.joint_state: as many positions as names are needed")
    given = {
        str(name): _number(value, f"{place}.joint_state.position") for name, value in zip(known, values, strict=True)
    }
    away = {name: abs(given[name] - value) for name, value in first.items() if name in given}
    if away and max(away.values()) > SAME_STATE:
        joint = max(away, key=away.__getitem__)
        yield f"how the arm gets from {place} to the first row: {shown_value(joint)} is off by {away[joint]:.6g}"


Starts = list[tuple[str, dict[str, Any]]]


def _joint_trajectory(document: Any) -> tuple[str, dict[str, Any], Starts]:
    """The message with ``joint_names`` and ``points``, the key under which it is, and states that it begins in."""
    key = ""
    starts: Starts = []
    for _ in range(MOST_WRAPPERS):
        if isinstance(document, list) and len(document) == 1:
            key, document = f"{key[:-1]}[0].", document[0]
        if isinstance(document, list):
            raise BadRow(f"{key[:-1] or 'the file'}: {len(document)} trajectories; one is judged at a time")
        if not isinstance(document, dict):
            break
        others = document.get("multi_dof_joint_trajectory")
        if isinstance(others, dict) and others.get("points"):
            raise BadRow(f"{key}multi_dof_joint_trajectory: joints of several degrees of freedom are not judged")
        if {"joint_names", "points"} <= document.keys():
            return key, document, starts
        starts += [(f"{key}{name}", document[name]) for name in STARTS if isinstance(document.get(name), dict)]
        inner = [name for name in WRAPPERS if document.get(name)]
        if len(inner) > 1:
            raise BadRow(f"{key}{inner[1]}: a second motion beside {key}{inner[0]}; one is judged at a time")
        if not inner:
            break
        key, document = f"{key}{inner[0]}.", document[inner[0]]
    raise BadRow("no JointTrajectory with joint_names and points is in it, nor a message of MoveIt that holds one")


SECONDS, NANOSECONDS = ("sec", "secs"), ("nanosec", "nsecs", "nsec")  # of ROS 2, of ROS 1, and of some tools


def _seconds(value: Any, place: str) -> float:
    if isinstance(value, dict):
        seconds, nanoseconds = (_part_of_time(value, names, place) for names in (SECONDS, NANOSECONDS))
        if not 0.0 <= nanoseconds < 1e9:
            raise BadRow(f"{place}: nanoseconds from 0 to 999999999 are needed, not {nanoseconds:.10g}")
        return seconds + 1e-9 * nanoseconds
    if value is None:
        raise BadRow(f"{place}: missing key")
    return _number(value, place)


def _part_of_time(value: dict[str, Any], names: tuple[str, ...], place: str) -> float:
    stated = [name for name in names if value.get(name) is not None]
    if len(stated) > 1:
        raise BadRow(f"{place}: {stated[0]} beside {stated[1]}, which are the same; one is needed")
    if not stated:
        raise BadRow(f"{place}: sec and nanosec are needed")
    return _number(value[stated[0]], place)


def _values(value: Any, width: int, place: str, needed: bool) -> Row:
    if value is None or value == []:
        if needed:
            raise BadRow(f"{place}: {width} numbers are needed")
        return []
    if not isinstance(value, list) or len(value) != width:
        count = len(value) if isinstance(value, list) else shown_value(value)
        raise BadRow(f"{place}: {width} numbers are needed, one for each of joint_names, not {count}")
    return [_number(each, place) for each in value]


def _number(value: Any, place: str) -> float:
    """A number, or a word that is one."""
    try:
        number = number_of(value) if isinstance(value, str) else float(math.nan if isinstance(value, bool) else value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not abs(number) <= LARGEST_STATE:
        raise BadRow(f"{place}: a number of at most {LARGEST_STATE:g} is needed, not {shown_value(value)}")
    return number

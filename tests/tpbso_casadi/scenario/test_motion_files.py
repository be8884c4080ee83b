"""Motions of other programs: every format read, and one line for what is wrong with a file."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from helpers.running import line_of

from tpbso_casadi.scenario import InputFolder, RecordedRows, read_recorded
from tpbso_casadi.scenario.row_tasks import joint_order

TIMES = [0.0, 0.25, 1.0]
POSITIONS = [[0.0, 0.5], [0.1, 0.6], [0.4, 0.2]]
VELOCITIES = [[0.0, 0.0], [0.4, -0.1], [0.0, 0.0]]
ACCELERATIONS = [[0.0, 0.0], [1.0, -1.0], [0.0, 0.0]]
NAMES = ["shoulder", "elbow"]
PIECES = (np.array([np.diff(POSITIONS, axis=0) / np.diff(TIMES)[:, None], POSITIONS[:2]])).tolist()  # straight lines
NPZ = {"t": TIMES, "q": POSITIONS, "qd": VELOCITIES, "qdd": ACCELERATIONS}


def point(row: int, **keys: Any) -> dict[str, Any]:
    second, part = divmod(round(TIMES[row] * 1e9), 10**9)
    return {
        "positions": POSITIONS[row],
        "velocities": VELOCITIES[row],
        "accelerations": ACCELERATIONS[row],
        "effort": [],
        "time_from_start": {"sec": second, "nanosec": part},
    } | keys


def message(**keys: Any) -> dict[str, Any]:
    header = {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    return {"header": header, "joint_names": NAMES, "points": [point(row) for row in range(3)]} | keys


def second(dump: Callable[[Any], str] = json.dumps, **keys: Any) -> str:
    """A message of two rows, the second with other keys."""
    return dump(message(points=[point(0), point(1, **keys)]))


def written(name: str, content: str | bytes) -> InputFolder:
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    return InputFolder(Path())


def npz(**arrays: Any) -> bytes:
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    return buffer.getvalue()


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    """Files lie in an empty folder."""


def check_rows(rows: RecordedRows, names: list[str], rates: int = 2) -> None:
    assert rows.times == TIMES
    assert rows.positions == POSITIONS
    assert rows.velocities == (VELOCITIES if rates > 0 else [])
    assert rows.accelerations == (ACCELERATIONS if rates > 1 else [])
    assert rows.joint_names == names


@pytest.mark.parametrize(
    "header",
    ["t,q1,q2,qd1,qd2,qdd1,qdd2", "time, q1, q2, qd1, qd2, qdd1, qdd2", "t,q1,q2,qd1,qd2,qdd1,qdd2,x,y,tau1,tau2"],
)
def test_tables_of_numbered_joints(header: str) -> None:
    width = header.count(",") + 1
    table = np.column_stack([TIMES, POSITIONS, VELOCITIES, ACCELERATIONS, np.zeros((3, 4))])[:, :width]
    lines = [",".join(map(repr, map(float, row))) for row in table]
    check_rows(read_recorded(written("m.csv", "\n".join([header, *lines, ""])), "m.csv"), [])


def test_tables_of_named_joints_in_any_order() -> None:
    rows = [f"{t},{q[0]},{v[1]},{q[1]},{v[0]}" for t, q, v in zip(TIMES, POSITIONS, VELOCITIES, strict=True)]
    header = "t,shoulder,elbow_velocity,elbow,shoulder_velocity"
    check_rows(read_recorded(written("m.csv", "\n".join([header, *rows])), "m.csv"), NAMES, rates=1)


def test_arrays_and_exact_pieces() -> None:
    check_rows(read_recorded(written("m.npz", npz(**NPZ)), "m.npz"), [])
    pieces = {"breakpoints": TIMES, "coefficients": PIECES}
    rows = read_recorded(written("m.npz", npz(**NPZ, **pieces, joint_names=NAMES)), "m.npz")
    check_rows(rows, NAMES)
    assert rows.breakpoints == TIMES
    assert rows.coefficients == PIECES


START = {
    "joint_state": {"name": ["finger", "elbow"], "position": [0.04, 0.45]},
    "attached_collision_objects": [{"link_name": "hand", "object": {"id": "part"}}],
}


def test_what_a_message_says_of_its_start_and_no_row_does_is_remarked() -> None:
    whole = {"trajectory_start": START, "trajectory": [{"joint_trajectory": message()}]}
    rows = read_recorded(written("m.json", json.dumps(whole)), "m.json")
    check_rows(rows, NAMES)
    assert rows.remarks == [
        "what is attached in trajectory_start (part); [[carried]] of a scene states it",
        "how the arm gets from trajectory_start to the first row: 'elbow' is off by 0.05",
    ]
    there = {"joint_state": {"name": NAMES, "position": POSITIONS[0]}, "attached_collision_objects": []}
    whole = {"trajectory_start": there, "trajectory": [{"joint_trajectory": message()}]}
    assert not read_recorded(written("m.yaml", yaml.safe_dump(whole)), "m.yaml").remarks


def test_numbers_of_yaml_are_those_of_its_version_1_2() -> None:
    text = yaml.safe_dump(message(points=[point(0), point(1, positions=["A", "B"])]))
    rows = read_recorded(written("m.yaml", text.replace("- A", "- 010").replace("- B", "- 1e-05")), "m.yaml")
    assert rows.positions[1] == [10.0, 1e-05]
    line = line_of(lambda: read_recorded(written("m.yaml", text.replace("- A", "- 1:30")), "m.yaml"))
    assert line == "m.yaml: points[1].positions: a number of at most 1e+09 is needed, not '1:30'"


WRAPPED = {
    "itself": lambda inner: inner,
    "RobotTrajectory": lambda inner: {"joint_trajectory": inner, "multi_dof_joint_trajectory": {"points": []}},
    "DisplayTrajectory": lambda inner: {"model_id": "arm", "trajectory": [{"joint_trajectory": inner}]},
    "a goal": lambda inner: {"trajectory": inner},
    "a response": lambda inner: {"motion_plan_response": {"trajectory": {"joint_trajectory": inner}}},
}


@pytest.mark.parametrize("wrap", WRAPPED.values(), ids=WRAPPED)
def test_messages_in_json_and_yaml(wrap: Any) -> None:
    text = yaml.safe_dump(wrap(message()))
    check_rows(read_recorded(written("m.json", json.dumps(wrap(message()))), "m.json"), NAMES)
    check_rows(read_recorded(written("m.yaml", text), "m.yaml"), NAMES)
    check_rows(read_recorded(written("m.yml", f"---\n{text}---\n"), "m.yml"), NAMES)


def test_times_of_both_ros_and_rows_without_rates() -> None:
    points = [point(0), point(1, time_from_start={"secs": 0, "nsecs": 250_000_000}), point(2, time_from_start=1)]
    points[2]["velocities"] = []
    del points[2]["accelerations"]
    rows = read_recorded(written("m.json", json.dumps(message(points=points))), "m.json")
    assert rows.times == TIMES
    assert rows.velocities == [*VELOCITIES[:2], []]
    assert rows.accelerations == [*ACCELERATIONS[:2], []]


def test_yaml_of_tools_that_write_exponents_without_a_point_and_aliases() -> None:
    text = yaml.safe_dump(message()).replace("0.4\n", "4e-1\n").replace("nanosec: 250000000", "nanosec: 250000000")
    zeros = "&zeros [0.0, 0.0]"
    aliased = (
        f"joint_names: [shoulder, elbow]\npoints:\n- positions: {zeros}\n  time_from_start: {{sec: 0, nanosec: 0}}\n"
        "- positions: *zeros\n  time_from_start: {sec: 1, nanosec: 0}\n"
    )
    check_rows(read_recorded(written("m.yaml", text), "m.yaml"), NAMES)
    assert read_recorded(written("m.yaml", aliased), "m.yaml").positions == [[0.0, 0.0], [0.0, 0.0]]


def bomb() -> bytes:
    """A small archive of an array of 300 MB of zeros, made where it is needed: that takes a second."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("t.npy", bytes(300_000_000))
    return buffer.getvalue()


LEVELS = [f"{k}: &{k} [{', '.join([f'*{j}'] * 9)}]" for j, k in pairwise("abcdefghijklmnop")]
LAUGHS = "\n".join(["a: &a [1, 1]", *LEVELS])
MERGES = "a: &a {x: 1}\n" + "b: &b\n  <<: [*a, *a]\n"
WRONG: dict[str, tuple[str, str | bytes | Callable[[], bytes], str]] = {
    "ending": ("m.txt", "t,q1\n", "a motion is read from *.csv, *.npz, *.json, *.yaml, *.yml or *.mcap"),
    "empty table": ("m.csv", "\n\n", "is empty; the header t,q1,q2,... is needed, or t and the names of joints"),
    "no header": ("m.csv", "0.0,1.0\n", "line 1: the header t,q1,q2,... is needed, or t and the names of joints"),
    "gap in joints": ("m.csv", "t,q1,q3\n0,1,2\n", "line 1: the columns of all joints are needed; q of 2 is missing"),
    "gap in rates": ("m.csv", "t,q1,q2,qd1\n", "line 1: the columns of all joints are needed; qd of 2 is missing"),
    "no such joint": ("m.csv", "t,a,b_velocity\n", "line 1: the columns of all joints are needed; qd of a is missing"),
    "twice": ("m.csv", "t,a,a\n0,1,2\n", "line 1: the column 'a' is there twice"),
    "other column": ("m.csv", "t,q1,speed\n0,1,2\n", "line 1: 'speed' is no column of t,q1..qk,qd1..qdk,qdd1..qddk"),
    "one row": ("m.csv", "t,q1\n0,1\n", "1 row; a motion needs two at least; start says where it begins"),
    "ragged": ("m.csv", "t,q1\n0,1\n1,2,3\n", "line 3: 3 numbers where the header has 2 names"),
    "word": ("m.csv", "t,q1\n0,1\n1,x\n", "line 3: a number is needed in column 'q1'"),
    "nan": ("m.csv", "t,q1\n0,1\n1,nan\n", "line 3: a number is not finite, or larger than 1e+09"),
    "huge": ("m.csv", "t,q1\n0,1\n1,1e300\n", "line 3: a number is not finite, or larger than 1e+09"),
    "many rows": ("m.csv", "t,q1\n" + "0,1\n" * 20_001, "line 20002: more than 20000 rows"),
    "binary table": ("m.csv", b"\xff\xfe\x00\x81", "not a text file: invalid start byte at byte 0"),
    "binary yaml": ("m.yaml", "\0\1\2", "not YAML: ReaderError"),
    "no archive": ("m.npz", b"PK garbage", "is no NPZ of arrays of numbers: "),
    "pickle": ("m.npz", npz(t=np.array([{}, {}], dtype=object), q=POSITIONS), "is no NPZ of arrays of numbers: "),
    "zip bomb": ("m.npz", bomb, "its arrays are larger than 200 MB"),
    "no times": ("m.npz", npz(q=POSITIONS), "has no array 't' or 'times'"),
    "flat": ("m.npz", npz(t=TIMES, q=TIMES), "positions: an array of numbers of 2 dimensions is needed, not "),
    "words": ("m.npz", npz(t=TIMES, q=[["a", "b"]] * 3), "positions: an array of numbers of 2 dimensions is needed, "),
    "names": ("m.npz", npz(t=TIMES, q=POSITIONS, joint_names=[1, 2]), "joint_names: a list of words is needed"),
    "infinite": ("m.npz", npz(t=[0.0, np.inf], q=POSITIONS[:2]), "times: a number is not finite, or larger than 1e+09"),
    "an unknown array": ("m.npz", npz(**NPZ, velocity=TIMES), "has no use for the array 'velocity'; did you mean vel"),
    "half of pieces": ("m.npz", npz(**NPZ, breakpoints=TIMES), "has breakpoints alone; exact pieces are "),
    "other ends": ("m.npz", npz(**NPZ, breakpoints=[0.0, 0.25, 1.1], coefficients=PIECES),
        "times: from 0 to 1 s where breakpoints are from 0 to 1.1 s; they are two motions"),
    "two motions": ("m.npz", npz(**NPZ, breakpoints=TIMES, coefficients=np.add(PIECES, [[[0.0]], [[1e-3]]])),
        "positions: row 0 is not on the pieces of breakpoints and coefficients; they are two motions"),
    "a huge coefficient": ("m.npz", npz(**NPZ, breakpoints=TIMES, coefficients=1e200 * np.array(PIECES)),
        "coefficients: a number is not finite, or larger than 1e+100"),
    "a key twice in json": ("m.json", '{"points": [], "points": []}', "the key 'points' is there twice"),
    "a key twice in yaml": ("m.yaml", "a: []\na: []\n", "not YAML in line 2: the key 'a' is there twice"),
    "two motions in a message": ("m.json", json.dumps({"joint_trajectory": message(), "trajectory": message()}),
        "trajectory: a second motion beside joint_trajectory; one is judged at a time"),
    "half a start": ("m.json",
        json.dumps({"start_state": {"joint_state": {"name": ["a"], "position": []}}, "trajectory": message()}),
        "start_state.joint_state: as many positions as names are needed"),
    "not json": ("m.json", "{", "not JSON in line 1: Expecting property name enclosed in double quotes"),
    "deep json": ("m.json", "[" * 100_000, "not JSON: "),
    "digits": ("m.json", "[" + "1" * 10_000 + "]", "not JSON: "),
    "not yaml": ("m.yaml", "points: [1, 2\njoint_names: ]", "not YAML in line 2: "),
    "tag": ("m.yaml", "!!python/object/apply:os.system ['true']", "not YAML in line 1: could not"),
    "merge": ("m.yaml", MERGES, "not YAML in line 2: merge keys (<<) are not read"),
    "laughs": ("m.yaml", LAUGHS, "no JointTrajectory with joint_names and points is in it, nor a message of MoveIt"),
    "laughing points": ("m.yaml", f"{LAUGHS}\njoint_names: [x]\npoints: *i", "points[0]: a table is needed, not "),
    "documents": ("m.yaml", "a: 1\n---\nb: 2\n", "one document is needed, not 2"),
    "no document": ("m.yaml", "", "one document is needed, not 0"),
    "a number": ("m.json", "3", "no JointTrajectory with joint_names and points is in it"),
    "several": ("m.json", json.dumps({"trajectory": [message(), message()]}), "trajectory: 2 trajectories; one is"),
    "planar base": ("m.json",
        json.dumps({"joint_trajectory": message(), "multi_dof_joint_trajectory": {"points": [{}]}}),
        "multi_dof_joint_trajectory: joints of several degrees of freedom are not judged"),
    "no names": ("m.json", json.dumps(message(joint_names=[])), "joint_names: a list of words is needed"),
    "half a letter": ("m.json", json.dumps(message(joint_names=["\ud800", "b"])), "joint_names: a list of words is"),
    "no list": ("m.json", json.dumps(message(points={})), "points: a list is needed"),
    "no points": ("m.json", json.dumps(message(points=[])), "0 rows; a motion needs two at least"),
    "no time": ("m.json", second(time_from_start=None), "points[1].time_from_start: missing key"),
    "half a time": ("m.json", second(time_from_start={"sec": 1}),
        "points[1].time_from_start: sec and nanosec are needed"),
    "no positions": ("m.json", second(positions=[]), "points[1].positions: 2 numbers are needed"),
    "too few": ("m.json", json.dumps({"trajectory": message(points=[point(0), point(1, velocities=[0.1])])}),
        "trajectory.points[1].velocities: 2 numbers are needed, one for each of joint_names, not 1"),
    "a truth": ("m.json", second(velocities=[True, 0.0]),
        "points[1].velocities: a number of at most 1e+09 is needed, not True"),
    "an underscore in a cell": ("m.csv", "t,q1\n0,1\n1_0,2\n", "line 3: a number is needed in column 't'"),
    "an underscore": ("m.yaml", yaml.safe_dump(message()).replace("- 0.4\n", "- 1_0\n"),
        "points[1].velocities: a number of at most 1e+09 is needed, not '1_0'"),
    "a word with an underscore": ("m.json", second(positions=["1_0", 0.0]),
        "points[1].positions: a number of at most 1e+09 is needed, not '1_0'"),
    "a tag and an underscore": ("m.yaml",
        yaml.safe_dump(message()).replace("nanosec: 250000000", "nanosec: !!int 250_000_000"),
        "not YAML in line "),
    "a tag and minutes": ("m.yaml", yaml.safe_dump(message()).replace("- 0.4\n", "- !!float 1:30\n"),
        "not YAML in line "),
    **{
        f"{key} {value}": (
            "m.json",
            json.dumps(message(points=[point(0), point(1, time_from_start={"sec": 1, key: value})])),
            f"points[1].time_from_start: nanoseconds from 0 to 999999999 are needed, not {value}",
        )
        for key, value in (("nanosec", -1), ("nsecs", 1000000000), ("nsec", -5))
    },
    "seconds of both": ("m.json", second(time_from_start={"sec": 1, "secs": 1, "nanosec": 0}),
        "points[1].time_from_start: sec beside secs, which are the same; one is needed"),
    "nanoseconds of both": ("m.yaml", second(yaml.safe_dump, time_from_start={"sec": 1, "nsecs": 0, "nanosec": 0}),
        "points[1].time_from_start: nanosec beside nsecs, which are the same; one is needed"),
    "not finite": ("m.yaml", second(yaml.safe_dump, positions=[float("nan"), 0.0]),
        "points[1].positions: a number of at most 1e+09 is needed, not '.nan'"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "content", "reason"), WRONG.values(), ids=WRONG)
def test_what_is_wrong_is_said_in_one_line(name: str, content: str | bytes | Callable[[], bytes], reason: str) -> None:
    folder = written(name, content() if callable(content) else content)
    line = line_of(lambda: read_recorded(folder, name))
    assert line.startswith(f"{name}: {reason}"), line


def test_numbers_of_yaml_may_have_their_tags() -> None:
    text = yaml.safe_dump(message()).replace("- 0.4\n", "- !!float 0.4\n").replace("sec: 1\n", "sec: !!int 1\n")
    assert "!!" in text
    check_rows(read_recorded(written("m.yaml", text), "m.yaml"), NAMES)


def test_columns_are_brought_into_the_order_of_the_robot() -> None:
    robot, rows = ("a", "b", "c"), np.array([[0.1, 0.2, 0.3, 0.04], [0.4, 0.5, 0.6, 0.0395]])

    def order(*names: str, known: tuple[tuple[str, ...], ...] = (robot,), locked: float = 0.04) -> Any:
        return joint_order([*names], known, rows[:, : len(names)], {"finger": locked})

    assert order("c", "a", "b") == ([1, 2, 0], [])
    assert order("joint 1", "joint 2", known=(("j_1", "j_2"), ("joint 1", "joint 2"))) == ([0, 1], [])
    left_out = "joints that stay where they are locked are left out: finger"
    assert order("a", "b", "c", "finger") == ([0, 1, 2], [left_out])
    assert line_of(lambda: order("a", "b")) == "joint_names: 'c' is missing"
    assert line_of(lambda: order("a", "b", "b")) == "joint_names: 'b' is there twice"
    unknown = line_of(lambda: order("a", "b", "hand"))
    assert unknown == "joint_names: the robot has no joint 'hand'; it has a, b, c"
    moves = "joint_names: 'finger' goes from 0.0395 to 0.04 and is locked at 0; locked says where it is"
    assert line_of(lambda: order("a", "b", "c", "finger", locked=0.0)) == moves

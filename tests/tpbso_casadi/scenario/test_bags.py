"""Trajectories in bags of ROS 2: the same motion as in other files; what is none is one line."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of, refusal, status

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.certify import main
from tpbso_casadi.cli.commands.tracking import main as tracking
from tpbso_casadi.scenario import InputFolder, bags, read_tracking_log

pytest.importorskip("mcap_ros2")
from mcap.writer import CompressionType, Writer as PlainWriter  # noqa: I001
from mcap_ros2.writer import Writer

DURATION = "================\nMSG: builtin_interfaces/Duration\nint32 sec\nuint32 nanosec\n"
JOINTS = "string[] joint_names\ntrajectory_msgs/JointTrajectoryPoint[] points\n"
POINT = (
    "================\nMSG: trajectory_msgs/JointTrajectoryPoint\nfloat64[] positions\nfloat64[] velocities\n"
    "float64[] accelerations\nfloat64[] effort\nbuiltin_interfaces/Duration time_from_start\n" + DURATION
)
OF_JOINTS = "trajectory_msgs/JointTrajectory joint_trajectory\n"
INNER = "================\nMSG: trajectory_msgs/JointTrajectory\n" + JOINTS + POINT
SCHEMAS = {
    "trajectory_msgs/msg/JointTrajectory": JOINTS + POINT,
    "moveit_msgs/msg/RobotTrajectory": OF_JOINTS + INNER,
    "moveit_msgs/msg/DisplayTrajectory": "string model_id\nmoveit_msgs/RobotTrajectory[] trajectory\n"
    "================\nMSG: moveit_msgs/RobotTrajectory\n" + OF_JOINTS + INNER,
    "std_msgs/msg/String": "string data\n",
    "sensor_msgs/msg/JointState": "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\n"
    "float64[] effort\n================\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    "================\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
}
ARM = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0))
TIMES = np.linspace(0.0, 2.0, 9)

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def states(way: tuple[float, float] = (1.0, -0.4)) -> tuple[np.ndarray, np.ndarray]:
    u = TIMES / 2.0
    return np.outer(10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, way), np.outer(15.0 * (u * (1.0 - u)) ** 2, way)


def joint_trajectory(way: tuple[float, float] = (1.0, -0.4)) -> dict[str, Any]:
    q, v = states(way)
    points = [
        {
            "positions": position[::-1].tolist(),
            "velocities": velocity[::-1].tolist(),
            "accelerations": [],
            "effort": [],
            "time_from_start": {"sec": int(time), "nanosec": round(1e9 * (time % 1.0))},
        }
        for time, position, velocity in zip(TIMES, q, v, strict=True)
    ]
    return {"joint_names": ["joint_2", "joint_1"], "points": points}


WRAPPED: dict[str, Callable[[dict[str, Any]], dict[str, Any]]] = {
    "trajectory_msgs/msg/JointTrajectory": lambda inner: inner,
    "moveit_msgs/msg/RobotTrajectory": lambda inner: {"joint_trajectory": inner},
    "moveit_msgs/msg/DisplayTrajectory": lambda inner: {"model_id": "", "trajectory": [{"joint_trajectory": inner}]},
}


def write_bag(name: str, messages: list[tuple[str, str, dict[str, Any]]], **options: Any) -> None:
    """A bag of messages, each with its topic and type."""
    with Path(name).open("wb") as file:
        writer = Writer(file, **options)
        schemas = {kind: writer.register_msgdef(kind, SCHEMAS[kind]) for _, kind, _ in messages}
        for time, (topic, kind, message) in enumerate(messages):
            writer.write_message(topic, schemas[kind], message, log_time=time, publish_time=time)
        writer.finish()


@pytest.mark.parametrize("compression", list(CompressionType), ids=str)
@pytest.mark.parametrize("kind", WRAPPED)
def test_a_trajectory_of_a_bag_is_that_of_arrays(kind: str, compression: CompressionType) -> None:
    chatter = [("/chatter", "std_msgs/msg/String", {"data": "hello"})] * 3
    write_bag("b.mcap", [*chatter, ("/plan", kind, WRAPPED[kind](joint_trajectory()))], compression=compression)
    plan, expected = tp.certify("b.mcap", ARM), tp.certify((TIMES, *states()), ARM)
    assert plan.certified
    np.testing.assert_array_equal(plan.trajectory.coefficients, expected.trajectory.coefficients)


def test_one_of_several_is_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    kind = "trajectory_msgs/msg/JointTrajectory"
    ways = [(1.0, -0.4), (0.5, 0.5), (9.0, 0.0)]
    write_bag("b.mcap", [(topic, kind, joint_trajectory(way)) for topic, way in zip("xyx", ways, strict=True)])
    for number, way in enumerate(ways, start=1):
        found = tp.certify("b.mcap", ARM, message=number)
        np.testing.assert_allclose(found.trajectory.at(np.array([2.0])), [way], atol=1e-12)
    several = "b.mcap: 3 trajectories (2 of 'x', 1 of 'y'); one is judged at a time: say which message, 1 to 3"
    assert line_of(lambda: tp.certify("b.mcap", ARM)) == several
    assert line_of(lambda: tp.certify("b.mcap", ARM, message=4)) == "b.mcap: message 4 of 3 trajectories"
    Path("arm.toml").write_text("[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 2.0\nmax_acceleration = 10.0\n")
    shared = ("b.mcap", "--robot", "arm.toml", "--no-plots", "--quiet", "--out", "out")
    assert status(main, *shared, "--message", "2") == 0
    assert status(main, *shared, "--message", "3") == 1
    assert refusal(capsys, main, *shared).startswith("b.mcap: 3 trajectories")
    task = '[task]\nkind = "recorded-motion"\nfile = "b.mcap"\nmessage = 2\n'
    Path("s.toml").write_text(Path("arm.toml").read_text() + task)
    plan = tp.plan("s.toml")
    np.testing.assert_allclose(plan.trajectory.at(np.array([2.0])), [ways[1]], atol=1e-12)


def joint_states(topic: str = "/joint_states", stamped: bool = True) -> list[tuple[str, str, dict[str, Any]]]:
    """A recording of the arm, and of a hand that tells its joint on the same topic."""
    messages = []
    for time, q, v in zip(TIMES, *states(), strict=True):
        stamp = {"sec": 1700000000 * stamped + int(time) * stamped, "nanosec": round(1e9 * (time % 1.0)) * stamped}
        header = {"stamp": stamp, "frame_id": ""}
        arm = {"name": ["joint_2", "joint_1"], "position": q[::-1].tolist(), "velocity": v[::-1].tolist(), "effort": []}
        hand = {"name": ["finger"], "position": [0.04], "velocity": [], "effort": []}
        messages += [(topic, "sensor_msgs/msg/JointState", {"header": header, **each}) for each in (arm, hand)]
    return messages


def test_states_of_joints_are_a_motion() -> None:
    write_bag("b.mcap", joint_states())
    plan, expected = tp.certify("b.mcap", ARM), tp.certify((TIMES, *states()), ARM)
    assert plan.certified and plan.motion.criteria.task.notes == ("9 messages of other joints left out",)
    np.testing.assert_allclose(plan.trajectory.coefficients, expected.trajectory.coefficients, atol=1e-6)
    write_bag("b.mcap", joint_states(stamped=False))  # then the times of writing count, 2 ns apart here
    assert tp.certify("b.mcap", ARM).trajectory.duration == pytest.approx(16e-9, rel=1e-3)


CONTROLLER = "control_msgs/msg/JointTrajectoryControllerState"
HEADER = SCHEMAS["sensor_msgs/msg/JointState"].partition("================\n")[2]
SCHEMAS[CONTROLLER] = (
    "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint reference\n"
    f"trajectory_msgs/JointTrajectoryPoint feedback\n================\n{HEADER}" + POINT
)


def controller_states(lag: float, measured: bool = True) -> list[tuple[str, str, dict[str, Any]]]:
    """A recording of a controller whose joints are behind by so many seconds of their speed."""
    none = {"velocities": [], "accelerations": [], "effort": [], "time_from_start": {"sec": 0, "nanosec": 0}}
    messages = []
    for time, q, v in zip(TIMES, *states(), strict=True):
        header = {"stamp": {"sec": int(time), "nanosec": round(1e9 * (time % 1.0))}, "frame_id": ""}
        points = {"reference": none | {"positions": q.tolist()}}
        points["feedback"] = none | {"positions": (q - lag * v).tolist() if measured else []}
        messages.append(("/state", CONTROLLER, {"header": header, "joint_names": ["joint_1", "joint_2"], **points}))
    return messages


def test_states_of_a_controller_are_commands_and_a_log(capsys: pytest.CaptureFixture[str]) -> None:
    write_bag("b.mcap", [*controller_states(0.01), *joint_states()])
    assert tp.certify("b.mcap", ARM, topic="/state").motion.criteria.task.notes == ()
    log = read_tracking_log(InputFolder(Path()), "b.mcap")
    np.testing.assert_allclose(log.errors, -0.01 * states()[1], atol=1e-12)
    assert log.joint_names == ("joint_1", "joint_2")
    assert status(tracking, "b.mcap") == 0
    assert capsys.readouterr().out.startswith("tracking_error = ")
    write_bag("b.mcap", controller_states(0.01, measured=False))
    assert "has no positions as measured" in refusal(capsys, tracking, "b.mcap")
    write_bag("b.mcap", joint_states())
    line = "no message of control_msgs/msg/JointTrajectoryControllerState is in it"
    assert line in refusal(capsys, tracking, "b.mcap")


def test_a_topic_is_chosen() -> None:
    plan = ("/plan", "trajectory_msgs/msg/JointTrajectory", joint_trajectory((0.5, 0.5)))
    write_bag("b.mcap", [*joint_states(), *joint_states("/other"), plan])
    np.testing.assert_allclose(tp.certify("b.mcap", ARM).trajectory.at(np.array([2.0])), [(0.5, 0.5)], atol=1e-9)
    chosen = tp.certify("b.mcap", ARM, topic="/joint_states")
    np.testing.assert_allclose(chosen.trajectory.at(np.array([2.0])), [(1.0, -0.4)], atol=1e-9)
    unknown = "b.mcap: topic: no motion of '/x' is in it; there are '/joint_states', '/other', '/plan'"
    assert line_of(lambda: tp.certify("b.mcap", ARM, topic="/x")) == unknown
    write_bag("b.mcap", [*joint_states(), *joint_states("/other")])
    several = "b.mcap: topic: states of joints of 2 topics ('/joint_states', '/other'); say which is read"
    assert line_of(lambda: tp.certify("b.mcap", ARM)) == several
    assert tp.retime("b.mcap", ARM, topic="/other").certified


def test_a_bag_that_was_cut_short_has_what_is_in_it() -> None:
    kind = "trajectory_msgs/msg/JointTrajectory"
    write_bag("b.mcap", [("/plan", kind, joint_trajectory())] * 2, chunk_size=1, compression=CompressionType.NONE)
    content = Path("b.mcap").read_bytes()
    Path("cut.mcap").write_bytes(content[: content.rindex(b"joint_2")])  # in the second message
    assert line_of(lambda: tp.certify("b.mcap", ARM)).startswith("b.mcap: 2 trajectories")
    assert tp.certify("cut.mcap", ARM).certified


def other_encoding(schema: bytes, data: bytes, encoding: str = "cdr") -> bytes:
    file = io.BytesIO()
    writer = PlainWriter(file)
    writer.start()
    number = writer.register_schema("trajectory_msgs/msg/JointTrajectory", "ros2msg", schema)
    channel = writer.register_channel("/plan", encoding, number)
    writer.add_message(channel, 0, data, 0)
    writer.finish()
    return file.getvalue()


WRONG: dict[str, tuple[Callable[[], bytes], str]] = {
    "no bag": (lambda: b"not a bag at all", "is no MCAP bag: InvalidMagic, "),
    "empty": (lambda: b"", "no message of trajectory_msgs/msg/JointTrajectory, "),
    "another encoding": (
        lambda: other_encoding(JOINTS.encode(), b"", "json"),
        "/plan: json with ros2msg is no encoding",
    ),
    "no schema": (lambda: other_encoding(b"nothing", b"\0\1\0\0"), "/plan: cannot be decoded: "),
    "no message": (
        lambda: other_encoding((JOINTS + POINT).encode(), b"\0\1\0\0\xff\xff\xff\x7f"),
        "/plan: cannot be decoded: ",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_said_in_one_line(case: str) -> None:
    content, reason = WRONG[case]
    Path("b.mcap").write_bytes(content())
    line = line_of(lambda: tp.certify("b.mcap", ARM))
    assert line.startswith(f"b.mcap: {reason}"), line


def test_a_bag_that_is_too_large_unpacked_is_not_unpacked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bags, "LARGEST_BAG", 500)
    write_bag("b.mcap", [("/plan", "trajectory_msgs/msg/JointTrajectory", joint_trajectory())])
    assert line_of(lambda: tp.certify("b.mcap", ARM)) == "b.mcap: more than 0.0005 MB are in it"
    monkeypatch.setattr(bags, "LARGEST_BAG", 1_000_000)
    assert tp.certify("b.mcap", ARM).certified

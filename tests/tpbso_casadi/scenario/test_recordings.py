"""Recordings as other programs write them: separators, columns, units, prefixes; one line for what is none."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import line_of, status

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import retime, tracking
from tpbso_casadi.scenario import InputFolder, RecordedRows, read_recorded, read_tracking_log
from tpbso_casadi.scenario.columns import LOG
from tpbso_casadi.scenario.recorded_rows import Reading

TIMES = [0.0, 0.5, 1.0]
POSITIONS = [[0.0, 0.5], [0.1, 0.6], [0.4, 0.2]]
VELOCITIES = [[0.0, 0.0], [0.4, -0.1], [0.0, 0.0]]
ARM = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0), joint_limits=((-3.0, 3.0), (-3.0, 3.0)))

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def table(header: str, *columns: Any, separator: str = ",", comma: str = ".") -> str:
    lines = [separator.join(f"{value:.12g}".replace(".", comma) for value in row) for row in np.column_stack(columns)]
    return "\n".join([header, *lines, ""])


def read(text: str, **reading: Any) -> RecordedRows:
    Path("m.csv").write_text(text)
    return read_recorded(InputFolder(Path()), "m.csv", Reading(**reading))


CLOCK = np.array(TIMES) + 1.7e9  # s since 1970: counted from the first row on
UR = "timestamp{0}target_q_0{0}target_q_1{0}actual_q_0{0}actual_q_1{0}actual_qd_0{0}actual_qd_1{0}mode"
SIGNALS = ",".join(f"/joint_states/{joint}/{what}" for what in ("position", "velocity") for joint in ("b", "a"))
STATES = (POSITIONS, VELOCITIES)
ALIKE: dict[str, tuple[str, dict[str, str]]] = {
    "UR, blanks": (table(UR.format(" "), CLOCK, np.ones((3, 2)), *STATES, [7, 7, 7], separator=" "), {}),
    "UR, commas": (table(UR.format(","), CLOCK, np.ones((3, 2)), *STATES, [7, 7, 7]), {}),
    "a spreadsheet": (table("t;q1;q2;qd1;qd2", TIMES, *STATES, separator=";", comma=","), {}),
    "tabs": (table("t\tq1\tq2\tqd1\tqd2", TIMES, *STATES, separator="\t"), {}),
    "a mapping": (table('"clock, s",A0,A1,V0,V1', CLOCK, *STATES).replace('"clock, s"', "clock"),
        {"columns": "clock=t, A*=q*, V*=qd*"}),
    "milliseconds": (table("t,q1,q2,qd1,qd2", np.multiply(TIMES, 1e3), *STATES), {"time_unit": "ms"}),
    "repeats": (table("t,q1,q2,qd1,qd2", TIMES, *STATES) + "1,0.4,0.2,0,0\n", {}),
    "PlotJuggler": (table(f"__time,{SIGNALS},/io/x", CLOCK, *STATES, [1, 1, 1]) + "1700000001.1,,,,,3\n", {}),
    "a prefix": (table("t,l_b,l_a,r_x,l_b_velocity,l_a_velocity,r_x_velocity", TIMES,
        *(np.column_stack([state, [9, 9, 9]]) for state in STATES)), {"prefix": "l_"}),
}  # fmt: skip


@pytest.mark.parametrize("case", ALIKE)
def test_one_motion_is_read_from_tables_of_all_kinds(case: str) -> None:
    rows = read(ALIKE[case][0], **ALIKE[case][1])
    np.testing.assert_allclose(rows.times, TIMES, atol=1e-6)
    assert (rows.positions, rows.velocities) == (POSITIONS, VELOCITIES)
    assert rows.joint_names == (["b", "a"] if case in ("PlotJuggler", "a prefix") else [])
    left_out = {"repeats": "1 row that repeat the row before, time included, left out",
                "PlotJuggler": "1 row without a number of these joints left out"}  # fmt: skip
    assert rows.notes == ([left_out[case]] if case in left_out else [])


def test_commanded_joints_of_a_ur_are_read_where_no_others_are() -> None:
    header = "timestamp target_q_0 target_q_1 target_qd_0 target_qd_1"
    assert read(table(header, TIMES, *STATES, separator=" ")).velocities == VELOCITIES


OWN = table("t,q1,q2", TIMES, POSITIONS)
TOPICS = table("__time,/x/a/position,/y/a/position", TIMES, POSITIONS)
WRONG: dict[str, tuple[str, dict[str, Any], str]] = {
    "no mapping": (OWN, {"columns": "t"}, "columns: COLUMN=t, COLUMN=q1 or COLUMN_*=q* is needed (qd, qdd, or m of "),
    "a star alone": (OWN, {"columns": "t=t,q*=q1"}, "columns: COLUMN=t, COLUMN=q1 or COLUMN_*=q* is needed"),
    "no such column": (OWN, {"columns": "t=t,pos*=q*"}, "columns: no column 'pos*'; there are 't', 'q1', 'q2'"),
    "twice": (OWN, {"columns": "t=t,q1=q1,q*=q*"}, "columns: 'q1' as q1: the column, or what it is said to hold, is"),
    "no time": (OWN, {"columns": "q*=q*"}, "line 1: the header t,q1,q2,... is needed, or t and the names of joints"),
    "no joints": (OWN, {"columns": "t=t"}, "line 1: the header t,q1,q2,... is needed"),
    "a gap": (OWN, {"columns": "t=t,q1=q1,q2=q3"}, "line 1: the columns of all joints are needed; q of 2 is missing"),
    "two topics": (TOPICS, {}, "columns: positions of 2 topics ('/x', '/y'); say which are read: __time=t,/x/"),
    "no topic": (table("__time,a,b", TIMES, POSITIONS), {}, "columns: no column TOPIC/JOINT/position; say which are"),
    "no prefix": (table("t,a,b", TIMES, POSITIONS), {"prefix": "l_"},
        "prefix: no joint's name begins with 'l_'; there are 'a', 'b'"),
    "no names": (OWN, {"prefix": "l_"}, "prefix: no joint's name begins with 'l_'; there are numbers alone"),
    "a topic": (OWN, {"topic": "/x"}, "topic: says which trajectory of a bag; this is none"),
    "half a row": ("t,q1,q2\n0,1,2\n1,,2\n", {}, "line 3: a number is needed in column 'q1'"),
    "a comma": ("t,q1\n0,1\n1,2,5\n", {}, "line 3: 3 numbers where the header has 2 names"),
}  # fmt: skip


@pytest.mark.parametrize(("text", "reading", "reason"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_read_is_one_line(text: str, reading: dict[str, Any], reason: str) -> None:
    line = line_of(lambda: read(text, **reading))
    assert line.startswith(f"m.csv: {reason}"), line


def test_columns_and_time_units_are_of_tables() -> None:
    np.savez("m.npz", t=TIMES, q=np.zeros((3, 2)), breakpoints=TIMES[::2], coefficients=np.zeros((1, 1, 2)))
    for reading, reason in (
        (Reading(columns="t=t"), "columns: says what columns of a table of text hold; this is none"),
        (Reading(time_unit="ms"), "time_unit: is for rows; polynomial pieces are in s"),
    ):
        assert line_of(partial(read_recorded, InputFolder(Path()), "m.npz", reading)) == f"m.npz: {reason}"


def quintic(degrees: bool = False, slower: float = 1.0) -> str:
    u = np.linspace(0.0, 1.0, 21)
    way = np.outer(10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5, (1.5, -0.8))
    return table("t,q1,q2", 2.0 * slower * u, np.degrees(way) if degrees else way)


def notes(text: str, **keys: Any) -> tuple[str, ...]:
    Path("m.csv").write_text(text)
    return tp.certify("m.csv", ARM, **keys).motion.criteria.task.notes


def test_what_looks_like_degrees_or_milliseconds_is_said_in_a_line() -> None:
    degrees, milliseconds = quintic(degrees=True), quintic(slower=1e3)
    assert notes(quintic()) == notes(degrees, unit="deg") == notes(milliseconds, time_unit="ms") == ()
    (line,) = notes(degrees)
    assert (
        line
        == "positions look like degrees (joint 1 up to 85.94, with a range up to 171.9 degrees): unit deg reads them so"
    )
    (line,) = notes(milliseconds)
    assert line.startswith("times look like milliseconds (rows 100 s apart, ") and line.endswith("reads them so")
    assert len(notes(quintic(degrees=True, slower=1e3))) == 2
    Path("m.csv").write_text(degrees)
    Path("arm.toml").write_text("[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 2.0\nmax_acceleration = 10.0\n")
    scenario = '[task]\nkind = "recorded-motion"\nfile = "m.csv"\ncolumns = "t=t,q*=q*"\nunit = "deg"\n'
    Path("s.toml").write_text(Path("arm.toml").read_text() + scenario)
    np.testing.assert_allclose(tp.plan("s.toml").trajectory.at(np.array([2.0])), [[1.5, -0.8]], atol=1e-9)


def test_one_row_is_a_motion_from_a_stated_start() -> None:
    goal, names = (0.5, -0.3), ["joint_2", "joint_1"]
    Path("m.csv").write_text(table(",".join(["t", *names]), [1.0], [goal[::-1]]))
    plan = tp.certify("m.csv", ARM, start=[0.1, 0.2], interpolation="linear")
    np.testing.assert_allclose(plan.trajectory.at(np.array([0.0, 1.0])), [(0.1, 0.2), goal])
    begin = "start: the first row is at t = 0 or before: it is where the motion begins"
    assert line_of(lambda: tp.certify(([0.0, 1.0], [goal, goal]), ARM, start=[0.0, 0.0])) == begin
    assert line_of(lambda: tp.certify("m.csv", ARM, start=[0.1])) == "start: 1 numbers for 2 joints"
    alone = "m.csv: 1 row; a motion needs two at least; start says where it begins"
    assert line_of(lambda: tp.certify("m.csv", ARM)) == alone
    path = tp.retime("m.csv", ARM, start=[0.1, 0.2])
    np.testing.assert_allclose(path.trajectory.at(path.trajectory.breakpoints[[0, -1]]), [(0.1, 0.2), goal], atol=1e-12)
    assert (
        line_of(lambda: tp.retime(POSITIONS, ARM, columns="q*=q*")) == "columns: says how a file is read; this is none"
    )


def test_a_path_of_degrees_is_timed_whatever_the_unit_of_the_robot(capsys: pytest.CaptureFixture[str]) -> None:
    Path("log.csv").write_text(table("A 1;A 2;x", np.degrees(POSITIONS), [1, 1, 1], separator=";", comma=","))
    arm = "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = {0}\nmax_acceleration = {1}\n"
    ends = []
    for unit, factor in (("rad", 1.0), ("deg", np.degrees(1.0))):
        Path("arm.toml").write_text(f'unit = "{unit}"\n' + arm.format(2.0 * factor, 10.0 * factor))
        options = (
            "--robot",
            "arm.toml",
            "--columns",
            "A *=q*",
            "--unit",
            "deg",
            "--no-plots",
            "--quiet",
            "--out",
            unit,
        )
        assert status(retime.main, "log.csv", *options) == 0, capsys.readouterr().err
        ends.append(tp.read_run(unit).trajectory)
    assert ends[0].duration == pytest.approx(ends[1].duration, rel=1e-9)
    for motion in ends:
        np.testing.assert_allclose(motion.at(motion.breakpoints[[0, -1]]), [POSITIONS[0], POSITIONS[-1]], atol=1e-9)


@pytest.mark.parametrize(
    ("header", "options"),
    [
        ("timestamp target_q_0 target_q_1 actual_q_0 actual_q_1", []),
        ("clock ref_a ref_b pos_a pos_b", ["--columns", "clock=t,ref_*=q*,pos_*=m*"]),
    ],
)
def test_logs_of_tracking_are_read_as_other_tables(
    header: str, options: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    times = np.linspace(0.0, 2.0, 50)
    commanded = np.degrees(np.column_stack([np.sin(times), np.cos(times)]))
    Path("log.csv").write_text(table(header, times + 5e5, commanded, commanded + np.degrees(0.002), separator=" "))
    assert tracking.main(["log.csv", "--unit", "deg", "--constant", *options]) == 0
    out = capsys.readouterr().out
    assert out.startswith("tracking_error = 0.002") and ("# of a, b, in this order" in out) == bool(options)
    log = read_tracking_log(InputFolder(Path()), "log.csv", Reading(columns=options[1] if options else ""))
    np.testing.assert_allclose(log.errors, np.degrees(0.002), atol=1e-9)


def test_a_log_needs_measured_joints() -> None:
    Path("m.csv").write_text(OWN)
    line = line_of(lambda: read_recorded(InputFolder(Path()), "m.csv", kind=LOG))
    assert line == f"m.csv: line 1: {LOG.header}"


def test_joints_that_stand_where_they_are_locked_are_left_out() -> None:
    names = [f"panda_joint{number}" for number in range(1, 8)]
    posture = np.array([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
    rows: Callable[[float], str] = lambda width: table(  # noqa: E731
        ",".join(["t", "panda_finger_joint1", *names]), [0.0, 1.0], [width] * 2, [posture, posture]
    )
    Path("m.csv").write_text(rows(0.0005))
    plan = tp.certify("m.csv", "panda")
    left_out = "joints that stay where they are locked are left out: panda_finger_joint1"
    assert plan.motion.criteria.task.notes == (left_out,)
    Path("m.csv").write_text(rows(0.04))
    moved = "joint_names: 'panda_finger_joint1' goes from 0.04 to 0.04 and is locked at 0; locked says where it is"
    assert line_of(lambda: tp.certify("m.csv", "panda")).endswith(moved)

"""Programs for controllers, read back by readers of their grammars, interpolated, and held against limits and a box."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, status
from oracles import controllers
from oracles.controllers import Read

import tpbso_casadi as tp
from problems.motions import control_points, fewest, from_line, held_and_joined
from tpbso_casadi.cli.commands.export import main
from tpbso_casadi.programs import EXPORTERS, StreamExporter
from tpbso_casadi.storage import OutputError

PULSES = [1341.4, -1341.4, 1000.0, 911.2, -911.2, 455.6]  # a degree
SETTINGS: dict[str, dict[str, Any]] = {"inform": {"pulses_per_degree": PULSES}}
READERS: dict[str, Any] = {
    "urscript": controllers.urscript,
    "urscript-movej": controllers.urscript,
    "krl": controllers.krl,
    "rsi": partial(controllers.table, in_degrees=True),
    "rapid": partial(controllers.rapid, outputs={"gripper": 3, "lamp": 4}),
    "egm": partial(controllers.table, in_degrees=True),
    "fanuc": controllers.fanuc,
    "franka": partial(controllers.table, in_degrees=False),
    "inform": partial(controllers.inform, pulses=PULSES),
}
POINTS = [kind for kind in READERS if not issubclass(EXPORTERS.find(kind), StreamExporter)]
OTHERS = ("ros-json", "ros-yaml", "csv", "npz")  # which tests of messages and tables read back
EACH = pytest.mark.parametrize("kind", READERS)
CENTER, SIZE, MARGIN = np.array([0.35, 0.45, 0.5]), np.array([0.1, 0.1, 0.7]), 0.005
D, A, ALPHA = (  # of a UR5e, m and quarter turns, as Universal Robots publishes them
    (0.1625, 0.0, 0.0, 0.1333, 0.0997, 0.0996),
    (0.0, -0.425, -0.3922, 0.0, 0.0, 0.0),
    (1, 0, 0, 1, -1, 0),
)


@cache
def plan() -> tp.Plan:
    """A UR5e goes around a column, with a limit of the jerk."""
    robot = tp.robot("ur5e", max_acceleration=8.0, max_jerk=300.0)
    box = tp.Box(center=tuple(CENTER), size=tuple(SIZE))
    start, goal = [0.0, -1.57, 1.2, -1.2, -1.57, 0.0], [1.9, -1.2, 1.4, -1.6, -1.57, 0.5]
    return tp.plan(robot, start=start, goal=goal, obstacles=[box], margin=MARGIN)


@cache
def sequence() -> tp.Plan:
    stages = [
        tp.MoveTo(tp.Joints((0.3, -1.5, 1.3, -1.3, -1.5, 0.1))),
        tp.Output("gripper", True),
        tp.Wait(0.25),
        tp.Output("lamp", "red"),
        tp.MoveTo(tp.Joints((0.0, -1.57, 1.2, -1.2, -1.57, 0.0))),
        tp.Output("gripper", False),
    ]
    return tp.sequence("ur5e", start=[0.0, -1.57, 1.2, -1.2, -1.57, 0.0], stages=stages)


def written(kind: str, of: tp.Plan, **settings: Any) -> tuple[Any, Read]:
    program = of.program(kind, **SETTINGS.get(kind, {}), **settings)
    return program, READERS[kind](program.files)


def interpolated(rows: np.ndarray, count: int) -> np.ndarray:
    """Postures along the straight lines between rows, the ends of lines among them."""
    each = max(2, count // (len(rows) - 1))
    shares = np.linspace(0.0, 1.0, each)[:, None]
    return np.concatenate([a + shares * (b - a) for a, b in pairwise(rows)])


def origins(theta: np.ndarray) -> np.ndarray:
    """Origins of the wrist's frames and the flange, (n, 3, 3), m, by the published table; they lie in the arm."""
    frame = np.broadcast_to(np.diag([-1.0, -1.0, 1.0, 1.0]), (len(theta), 4, 4))  # the base stands turned by half
    found = []
    for joint, (d, a, quarter) in enumerate(zip(D, A, ALPHA, strict=True)):
        c, s, zero = np.cos(theta[:, joint]), np.sin(theta[:, joint]), np.zeros(len(theta))
        ca, sa = np.round(np.cos(quarter * np.pi / 2)), np.round(np.sin(quarter * np.pi / 2))
        rows = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [zero, zero + sa, zero + ca, zero + d]]
        last = [zero, zero, zero, zero + 1.0]
        frame = frame @ np.moveaxis(np.array([*rows, last]), -1, 0)
        found.append(frame[:, :3, 3])
    return np.stack(found[3:], axis=1)


def clear(theta: np.ndarray) -> bool:
    outside = np.maximum(np.abs(origins(theta) - CENTER) - SIZE / 2.0, 0.0)
    return bool((np.linalg.norm(outside, axis=-1) > MARGIN).all())


def to_path(rows: np.ndarray, path: np.ndarray) -> float:
    """The largest distance of rows from their nearest postures of a path, in the largest difference of a joint."""
    return float(max(np.abs(path - row).max(axis=1).min() for row in rows))


def test_the_table_of_the_arm_is_that_of_the_plan() -> None:
    times = np.linspace(0.0, plan().duration, 50)
    tool = plan().to_numpy(times)
    np.testing.assert_allclose(
        origins(plan().trajectory(times))[:, -1], np.column_stack([tool[axis] for axis in "xyz"]), atol=2e-3
    )


def test_no_two_kinds_write_the_same_file() -> None:
    files = [name.lower() for kind in READERS for name in plan().program(kind, **SETTINGS.get(kind, {})).files]
    assert len(set(files)) == len(files)


def test_there_is_a_reader_of_every_kind() -> None:
    assert {*READERS, *OTHERS} == {*EXPORTERS.registry}


@pytest.mark.parametrize("count", [2_000, pytest.param(100_000, marks=pytest.mark.slow)])
@EACH
def test_what_is_read_back_keeps_limits_and_distances(kind: str, count: int) -> None:
    program, read = written(kind, plan())
    assert plan().certified
    limits, postures = plan().motion.criteria.robot.limits, interpolated(read.rows, count)
    low, high = np.array(limits.position).T
    assert ((postures >= low - 1e-9) & (postures <= high + 1e-9)).all()
    assert clear(postures)
    ends = plan().trajectory(np.array([0.0, plan().duration]))
    np.testing.assert_allclose(read.rows[[0, -1]], ends, atol=2e-5)
    assert f"{len(read.rows)} " in program.content
    if read.period is not None:
        assert program.proven, program.lines
        rows = np.concatenate([read.rows[:1], read.rows[:1], read.rows, read.rows[-1:], read.rows[-1:]])
        for order, most in enumerate(limits.by_order[:2], start=1):
            assert (np.abs(np.diff(rows, order, axis=0)) / read.period**order <= np.array(most) * (1 + 1e-3)).all()
        times = np.linspace(0.0, plan().duration, count)
        joined = np.column_stack(
            [np.interp(times, read.period * np.arange(len(read.rows)), joint) for joint in read.rows.T]
        )
        assert np.abs(joined - plan().trajectory(times)).max() < 2e-5
    else:
        assert len(read.rows) < 20
        path = plan().trajectory(np.linspace(0.0, plan().duration, 2000))
        assert to_path(postures[:: len(postures) // 100], path) < 0.006


@EACH
def test_signals_and_waits_are_where_the_plan_has_them(kind: str) -> None:
    outputs = {"gripper": 3, "lamp=red": -4}
    _, read = written(kind, sequence(), outputs=outputs)
    start, end = (stage.start for stage in sequence().stages if stage.signal and stage.signal[0] == "gripper")
    if kind in POINTS:
        first = read.events[0][0]
        expected = [(first, "output", (3, True)), (first, "wait", 0.25), (first, "output", (4, False))]
        last = (len(read.rows), "output", (3, False))
        assert read.events == [*expected, last]
        np.testing.assert_allclose(read.rows[first - 1], [0.3, -1.5, 1.3, -1.3, -1.5, 0.1], atol=2e-5)
    else:
        assert read.period is not None
        on, *_, off = (row * read.period for row, *_ in read.events)
        assert start <= on + 1e-9 < start + 1.01 * read.period
        assert end <= off + 1e-9 < end + 1.01 * read.period


def test_a_signal_without_an_output_is_named() -> None:
    program = sequence().program("krl", outputs={"gripper": 3})
    assert "not in the program: signal lamp=red: outputs names no output for it" in program.lines
    assert ";lamp=red" in program.files["tpbso.src"]


@EACH
def test_no_name_of_a_signal_ends_a_comment(kind: str) -> None:
    planned, hostile = sequence().planned, 'x\n  movej([0,0,0,0,0,0])\nSPTP XP9 ;"\x07' * 3
    stages = tuple(
        replace(each, signal=None if each.signal is None else (hostile, each.signal[1]))
        for each in planned.motion.stages
    )
    motion = replace(planned.motion, criteria=replace(planned.criteria, stages=stages))
    _, read = written(kind, tp.Plan(replace(planned, motion=motion)))
    _, usual = written(kind, sequence())
    np.testing.assert_array_equal(read.rows, usual.rows)


def test_a_class_by_its_path_is_an_exporter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lab_arm.py").write_text(
        "from tpbso_casadi.programs import RowTable\n\n\nclass LabArm(RowTable):\n"
        '    title, axes, columns, joined = "our controller", 6, "axis{}", "lines between rows"\n'
    )
    monkeypatch.syspath_prepend(tmp_path)
    program = plan().program("lab_arm:LabArm", period=0.01)
    assert program.proven and program.lines[0].startswith("our controller: ")
    assert "assumed: lines between rows" in program.lines


@pytest.mark.parametrize("kind", ["krl", "fanuc"])
def test_near_points_prove_joints_that_go_on_their_own(kind: str) -> None:
    coarse, (fine, read) = plan().program(kind), written(kind, plan(), longest=0.01)
    assert not coarse.proven and fine.proven
    assert np.abs(np.diff(read.rows, axis=0)).max() <= 0.0101
    rng = np.random.default_rng(1)
    lower, upper = np.minimum(read.rows[:-1], read.rows[1:]), np.maximum(read.rows[:-1], read.rows[1:])
    assert clear(np.concatenate([lower + rng.random(lower.shape) * (upper - lower) for _ in range(10)]))


ROUNDED = {"urscript-movej": ", r=0.", "krl": " C_PTP\n", "rapid": "z10", "fanuc": "CNT100", "inform": "PL=1"}


@pytest.mark.parametrize("kind", POINTS)
def test_rounded_corners_stay_clear_where_they_are_proven(kind: str) -> None:
    program, read = written(kind, plan(), corners="round")
    (proof,) = (proof for proof in program.proofs if "corners cut" in proof.statement)
    assert str(proof.status) == "certified"
    assert "".join(map(str, program.files.values())).count(ROUNDED[kind]) == len(read.rows) - 2
    middles = (read.rows[:-1] + read.rows[1:]) / 2.0
    weights = np.random.default_rng(2).dirichlet((1.0, 1.0, 1.0), 500)
    triangles = np.stack([middles[:-1], read.rows[1:-1], middles[1:]])
    assert clear(np.einsum("nc,cij->nij", weights, triangles).reshape(-1, 6))


def test_radii_end_before_the_middles_of_lines() -> None:
    program, read = written("urscript-movej", plan(), corners="round")
    radii = [float(text) for text in re.findall(r"r=(\S+)\)", "".join(map(str, program.files.values())))]
    tool = origins(np.concatenate([read.rows, (read.rows[:-1] + read.rows[1:]) / 2.0]))[:, -1]
    points, middles = tool[: len(read.rows)], tool[len(read.rows) :]
    before, after = (np.linalg.norm(points[1:-1] - ends, axis=1) for ends in (middles[:-1], middles[1:]))
    assert (radii <= 0.91 * np.minimum(before, after)).all() and min(radii) > 0.01


def test_points_among_obstacles_that_move_are_not_proven_and_rows_are() -> None:
    cart = {"shape": "box", "center": [0.9, -0.9, 0.3], "size": [0.2, 0.2, 0.2], "velocity": [0.05, 0.0, 0.0]}
    judged = tp.certify(plan(), obstacles=[cart])
    assert judged.certified
    assert judged.program("rsi").proven
    points = judged.program("urscript-movej")
    assert not points.proven
    assert (
        "undecided: clearances from obstacles that move: the controller decides when the robot is where" in points.lines
    )


def test_a_program_of_a_plan_that_is_too_near_is_not_proven() -> None:
    program = plan().program("urscript-movej", accuracy=0.2)
    assert not program.proven
    assert any(line.startswith(("violated: path", "undecided: path")) for line in program.lines)


def test_fanuc_counts_its_third_axis_from_the_horizontal() -> None:
    plain, coupled = (written("fanuc", plan(), j23=j23)[1].rows for j23 in (0, 1))
    np.testing.assert_allclose(coupled[[0, -1], 2], plain[[0, -1], 2] + plain[[0, -1], 1], atol=1e-6)
    np.testing.assert_allclose(coupled[[0, -1], 3:], plain[[0, -1], 3:], atol=1e-6)


def test_deviations_by_hand() -> None:
    """A parabola t^2 of one joint over a second, rows every half: joined, 1/16 off; held, 3/4."""
    motion = tp.Trajectory(np.array([0.0, 1.0]), np.array([[[1.0]], [[0.0]], [[0.0]]]))
    held, lines = held_and_joined(motion, np.array([0.0, 0.5, 1.0]), np.array([[0.0], [0.25], [1.0]]))
    assert held == pytest.approx(0.75, abs=1e-9)
    assert lines == pytest.approx(0.0625, abs=1e-9)
    both = tp.Trajectory(np.array([0.0, 1.0]), np.array([[[1.0, 0.0]], [[0.0, 1.0]], [[0.0, 0.0]]]))
    _, points = control_points(both, np.linspace(0.0, 1.0, 101))
    times = np.linspace(0.0, 1.0, 1001)[:, None]
    path, way = np.hstack([times**2, times]), np.array([1.0, 1.0])
    across = np.abs(path - (path @ way / 2.0)[:, None] * way).max(axis=0)
    np.testing.assert_allclose(from_line(points, np.zeros(2), np.ones(2)), across, atol=1e-4)
    assert fewest(10, lambda first, last: last - first <= 3) == [0, 3, 6, 9]
    assert fewest(2, lambda first, last: False) == [0, 1]


@pytest.mark.parametrize(
    ("kind", "settings", "line"),
    [
        ("urscrpt", {}, "no export 'urscrpt'; did you mean urscript?"),
        ("krl", {"accurracy": 1.0}, "accurracy: unknown key; did you mean accuracy?"),
        ("krl", {"accuracy": 2.0}, "accuracy: input should be less than or equal to 1, not 2.0"),
        ("krl", {"name": "my-job"}, "name: at most 24 letters, digits and underscores are needed, a letter first"),
        ("inform", {}, "pulses_per_degree: 6 numbers other than zero are needed, of each axis, from the controller's"),
    ],
)
def test_what_is_wrong_is_one_line(kind: str, settings: dict[str, Any], line: str) -> None:
    with pytest.raises(OutputError) as caught:
        plan().program(kind, **settings)
    assert str(caught.value).startswith(line) and "\n" not in str(caught.value)


def test_robots_that_a_controller_does_not_have_are_refused() -> None:
    flat = tp.plan("time-3", solver="pso", evaluations=200)
    with pytest.raises(OutputError, match="a robot in space is needed"):
        flat.program("krl")
    panda = tp.certify(([0.0, 1.0], [[0.0] * 7] * 2, [[0.0] * 7] * 2), "panda")
    with pytest.raises(OutputError, match="URScript, servoj: 6 axes at most, not 7"):
        panda.program("urscript")


def test_the_command_writes_the_files_and_says_what_is_proven(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = plan().save(tmp_path / "run", figures=())
    assert status(main, str(run), "--as", "urscript", "--set", "period=0.008") == 0
    said = capsys.readouterr().out
    assert "rows, one every 8 ms" in said and "certified: clearances where rows are joined by lines" in said
    assert (tmp_path / "run-urscript" / "tpbso.script").read_text() == plan().program("urscript", period=0.008).files[
        "tpbso.script"
    ]
    assert status(main, str(run), "--as", "krl", "--json", "--out", str(tmp_path / "krl")) == 1
    content = json.loads(capsys.readouterr().out)
    assert content["proven"] is False and [Path(file).name for file in content["files"]] == ["tpbso.src", "tpbso.dat"]
    said = refusal(capsys, main, str(run), "--as", "krl", "--set", "accuracy")
    assert said.startswith("--set accuracy: KEY=VALUE as in TOML is needed")

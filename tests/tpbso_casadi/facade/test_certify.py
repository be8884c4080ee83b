"""``tp.certify``: motions of every origin judged alike; exports read back; libraries' own objects taken exactly."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import ruckig
from helpers.recorded import ARM as TABLE
from helpers.recorded import TIMES, states
from helpers.running import line_of
from scipy.interpolate import CubicSpline, PPoly, make_interp_spline

import tpbso_casadi as tp
from tpbso_casadi.display.plan_tables import effort_of

ARM = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0))
VIOLATED, CERTIFIED = tp.CertificateStatus.VIOLATED, tp.CertificateStatus.CERTIFIED
BOX = tp.Rectangle((-0.6, 0.7), (0.1, 0.1))


def judged(plan: tp.Plan) -> dict[str, tuple[str, float]]:
    return {verdict.name: (str(verdict.status), verdict.worst) for verdict in plan.verdicts}


def same(one: tp.Plan, other: tp.Plan, tolerance: float = 1e-9) -> None:
    assert judged(one).keys() == judged(other).keys()
    for name, (status, worst) in judged(one).items():
        assert judged(other)[name][0] == status, name
        assert judged(other)[name][1] == pytest.approx(worst, abs=tolerance, rel=tolerance), name


def test_rows_mappings_files_and_trajectories_are_judged_alike(in_an_empty_folder: None) -> None:
    q, v, a = states()
    plan = tp.certify((TIMES, q, v, a), ARM, obstacles=[BOX])
    assert plan.certified
    dense = np.linspace(0.0, 2.0, 1001)
    np.testing.assert_allclose(plan.trajectory.at(dense), states(times=dense)[0], atol=1e-12)
    np.savetxt(
        "m.csv", np.column_stack([TIMES, q, v, a]), delimiter=",", comments="", header="t,q1,q2,qd1,qd2,qdd1,qdd2"
    )
    np.savez("m.npz", t=TIMES, q=q, qd=v, qdd=a)
    named = {"t": TIMES, "q": q[:, ::-1], "qd": v[:, ::-1], "qdd": a[:, ::-1], "joint_names": ["joint_2", "joint_1"]}
    others = ([TIMES.tolist(), q.tolist(), v, a], "m.csv", Path("m.npz"), plan.trajectory, named)
    for other in others:
        same(plan, tp.certify(other, ARM, obstacles=[BOX]))
    same(plan, tp.certify(plan))  # with its own robot and obstacles
    plan.save("run", figures=())
    same(plan, tp.certify("run"))
    assert tp.read_run("run").certified
    Path("arm.toml").write_text(TABLE)
    elsewhere = tp.certify("run", "arm.toml")  # a file states what is around its robot, here nothing
    assert elsewhere.certified and elsewhere.scenario.obstacles == []
    assert tp.retime("run").certified


def test_auto_does_as_the_controller_and_says_so() -> None:
    q, v, a = states()
    kinds = [((q,), "linear"), ((q, v), "cubic"), ((q, v, a), "quintic")]
    for rows, kind in kinds:
        auto, stated = tp.certify((TIMES, *rows), ARM), tp.certify((TIMES, q, v, a), ARM, interpolation=kind)  # type: ignore[arg-type]
        same(auto, stated)
        assert effort_of(auto.planned) == f"a motion as it is stated: {kind} between 9 rows"
    linear = judged(tp.certify((TIMES, q), ARM))
    assert linear["acceleration"] == ("violated", np.inf)
    assert linear["start velocity"][0] == "violated"


def test_a_late_first_row_and_ends_that_move() -> None:
    q, v, a = states()
    late = tp.certify((TIMES + 0.5, q, v, a), ARM)
    assert late.certified
    left_open = ("how the arm gets to where the motion begins, at 0.5 s",)
    assert late.not_judged == left_open
    cubic = CubicSpline(TIMES + 0.5, q, bc_type="clamped")
    assert tp.certify(cubic, ARM).not_judged == left_open
    assert tp.certify(late).not_judged == left_open
    hasty = tp.certify((0.2 * (TIMES + 0.5), q, 5.0 * v, 25.0 * a), ARM)
    slowed = tp.repair(hasty).slowed
    assert slowed is not None and slowed.not_judged == hasty.not_judged != ()
    moving = judged(tp.certify((TIMES[:5], q[:5], v[:5], a[:5]), ARM))
    assert moving["goal velocity"][0] == "violated"
    assert moving["start velocity"][0] == "certified"


def test_payloads_margins_constraints_and_limits_are_judged() -> None:
    q, v, a = states()
    strong = tp.robot([0.5, 0.5], max_speed=2.0, max_acceleration=10.0, link_masses=[1.0, 1.0], max_torque=[20.0, 8.0])
    assert tp.certify((TIMES, q, v, a), strong).certified
    loaded = judged(tp.certify((TIMES, q, v, a), strong, payload=5.0))
    assert loaded["torque"][0] == "violated"
    nearest = tp.certify((TIMES, q, v, a), ARM, obstacles=[BOX]).motion.closest_approach
    assert nearest is not None
    narrow = tp.certify((TIMES, q, v, a), ARM, obstacles=[BOX], margin=nearest.distance + 1e-3)
    assert judged(narrow)["clearance"][0] == "violated"
    high = tp.Constraint(lambda m: m.tool[1], lower=0.4, name="height", unit="m")
    assert judged(tp.certify((TIMES, q, v, a), ARM, constraints=high))["height"][0] == "violated"


def test_a_limit_that_is_left_out_stands_beside_the_status(in_an_empty_folder: None) -> None:
    arm = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0), max_jerk=(500.0, 500.0))
    q, v, a = states()
    cubic = tp.certify((TIMES, q, v), arm)  # accelerations jump from one cubic to the next
    assert judged(cubic)["jerk"] == ("violated", np.inf)
    plan = tp.certify((TIMES, q, v), arm, without="jerk")
    assert plan.certified and "jerk" not in judged(plan)
    assert repr(plan) == "<plan: time 2 s, certified without a verdict on jerk, T = 2 s>"
    assert plan.not_judged == ("jerk, as asked",)
    plan.save("run", figures=())
    assert tp.read_run("run").motion.status_in_words == "certified without a verdict on jerk"
    assert not tp.certify("run").certified  # judged by all again
    assert tp.certify("run", without=["jerk"]).certified
    quick = tp.certify((TIMES / 4.0, q, 4.0 * v), arm, without=["jerk", "acceleration"])
    assert judged(quick)["speed"][0] == "violated"
    slowed = tp.repair(quick).slowed
    assert slowed is not None and slowed.certified
    assert slowed.not_judged == quick.not_judged == ("jerk, as asked", "acceleration, as asked")
    assert tp.certify((TIMES, q, v, a), ARM, without=["jerk"]).certified  # this one has no such limit
    near = tp.certify((TIMES, q, v, a), ARM, obstacles=[BOX], margin=0.3, without=["clearance"])
    assert near.certified and "clearance" not in judged(near)


def test_a_scene_is_put_around_the_robot(in_an_empty_folder: None) -> None:
    q, v, a = states()
    Path("arm.toml").write_text(
        'unit = "deg"\n[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 114.591559\nmax_acceleration = 572.957795\n'
        '[[obstacles]]\nshape = "ellipse"\ncenter = [0.5, 0.5]\nsemi_axes = [0.1, 0.1]\n'
    )
    Path("cell.toml").write_text(
        '[[obstacles]]\nshape = "polygon"\npoints = [[-0.5, 0.5], [-0.4, 0.5], [-0.4, 0.6], [-0.5, 0.6]]\n'
        '[model]\nmargin = 0.01\n[[constraints]]\nname = "height"\nunit = "m"\nupper = 5.0\nexpression = "= tool[1]"\n'
    )
    plan = tp.certify((TIMES, q, v, a), "arm.toml", scene="cell.toml")
    assert len(plan.scenario.obstacles) == 1
    assert plan.scenario.model.margin == 0.01
    assert [verdict.bound for verdict in plan.verdicts if verdict.name == "clearance"] == [0.01]
    assert "height" in judged(plan)
    Path("whole.toml").write_text(TABLE + Path("cell.toml").read_text())
    same(plan, tp.certify((TIMES, q, v, a), scene="whole.toml"), 1e-6)


def test_the_least_slowing_is_the_least() -> None:
    q, v, a = states(times=np.linspace(0.0, 0.6, 9))
    checked = tp.certify((np.linspace(0.0, 0.6, 9), q, v, a), ARM)
    found = tp.repair(checked)
    assert found.plan is found.retimed is not None and found.slowed is not None
    assert found.slowed.certified and found.plan.certified
    assert found.factor == pytest.approx(30.0 / 16.0 / 0.6 / 2.0, rel=1e-9)  # the largest speed over its limit
    faster = checked.trajectory.time_scaled(found.factor * (1.0 - 1e-6))
    assert not tp.certify(faster, ARM).certified
    along = found.plan.trajectory.at(np.linspace(0.0, found.plan.duration, 501))
    line = np.array([1.0, -0.4])
    away = (along - q[0]) - np.outer((along - q[0]) @ line / (line @ line), line)
    assert np.abs(away).max() < 1e-9  # on the same path
    assert tp.repair(found.plan).plan is found.plan


def test_corners_and_obstacles_are_no_matter_of_time() -> None:
    q = states()[0]
    corners = tp.repair(tp.certify((TIMES, q), ARM))
    assert corners.slowed is None and corners.plan is corners.retimed is not None
    assert corners.plan.certified
    times = np.linspace(0.0, 2.0, 401)  # as many rows are near a smooth path, which needs no stops
    smooth = tp.repair(tp.certify((times, states(times=times)[0]), ARM))
    assert smooth.plan is not None and smooth.plan.certified
    assert smooth.plan.duration == pytest.approx(tp.retime(states()[0][[0, -1]], ARM).duration, rel=1e-3)
    assert "rad from the lines between them at most, proven" in smooth.words[1]
    bent = tp.certify(([0.0, 1.0, 2.0], [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]), ARM)
    stops, near = tp.repair(bent), tp.repair(bent, accuracy=0.2)
    assert "another accuracy may do" in stops.words[1] and stops.plan is not None and near.plan is not None
    assert near.plan.duration < stops.plan.duration
    blocked = tp.repair(tp.certify((TIMES, *states()), ARM, obstacles=[tp.Ellipse((0.6, 0.6), (0.1, 0.1))]))
    assert blocked.plan is None
    [line] = blocked.to_move
    assert line.startswith("clearance: link 2, obstacle 1, t = ")
    depth = float(line.partition(", by ")[2].partition(" m")[0])
    assert 0.05 < depth <= 0.1 + 1e-9  # the tip runs through the middle, or near


def ruckig_motion() -> ruckig.Trajectory:
    given, found = ruckig.InputParameter(2), ruckig.Trajectory(2)
    given.current_position, given.target_position = [0.1, 0.3], [1.1, -0.1]
    given.max_velocity, given.max_acceleration, given.max_jerk = [1.0] * 2, [3.0] * 2, [20.0] * 2
    assert ruckig.Ruckig(2).calculate(given, found) == ruckig.Result.Working
    return found


class DrakeLaw:
    """A parameter over time, as Drake's Toppra returns it: 0.25 t^2, then on at its speed."""

    def get_segment_times(self) -> list[float]:
        return [0.0, 1.0, 1.5]

    def getPolynomialMatrix(self, piece: int) -> np.ndarray:  # noqa: N802 (Drake's name)
        coefficients = ([0.0, 0.0, 0.25], [0.25, 0.5])[piece]
        return np.array([[SimpleNamespace(GetCoefficients=lambda: np.array(coefficients))]], dtype=object)


def drake_path_over_time() -> Any:
    """A B-spline over [0, 0.5] run by a law."""
    spline = make_interp_spline(np.linspace(0.0, 0.5, 9), states()[0], 3)
    basis = SimpleNamespace(knots=lambda: spline.t, order=lambda: 4)
    path = SimpleNamespace(basis=lambda: basis, control_points=lambda: [point[:, None] for point in spline.c])

    def value(t: float) -> np.ndarray:
        return np.asarray(spline(0.25 * t**2 if t < 1.0 else 0.25 + 0.5 * (t - 1.0)))[:, None]

    ends = {"start_time": lambda: 0.0, "end_time": lambda: 1.5}
    return SimpleNamespace(path=lambda: path, time_scaling=DrakeLaw, value=value, **ends)


def foreign() -> dict[str, Any]:
    q = states()[0]
    spline = make_interp_spline(TIMES, q, 5, bc_type=([(1, [0, 0]), (2, [0, 0])], [(1, [0, 0]), (2, [0, 0])]))
    cubic = CubicSpline(TIMES, q, bc_type="clamped")
    path = type("Path", (), {"cspl": cubic, "duration": 2.0, "__call__": lambda self, t: cubic(t)})()
    return {
        "ruckig": ruckig_motion(),
        "b-spline": spline,
        "cubic": cubic,
        "pieces": PPoly(cubic.c, cubic.x),
        "toppra": path,
        "drake": drake_path_over_time(),
    }


@pytest.mark.parametrize("kind", ["ruckig", "b-spline", "cubic", "pieces", "toppra", "drake"])
def test_pieces_of_libraries_are_taken_exactly(kind: str) -> None:
    motion = foreign()[kind]
    trajectory = tp.certify(motion, ARM).trajectory
    at = np.linspace(0.0, trajectory.duration, 300)[1:-1]
    values = {"ruckig": lambda t: motion.at_time(t)[0], "drake": lambda t: motion.value(t)[:, 0]}
    expected = [values.get(kind, motion)(t) for t in at]
    np.testing.assert_allclose(trajectory.at(at), expected, atol=1e-12)


def test_ruckigs_own_motion_is_certified_with_its_limits_and_not_with_smaller_ones() -> None:
    arm = tp.PlanarArm((0.5, 0.5), (1.0, 1.0), (3.0, 3.0), max_jerk=(20.0, 20.0))
    assert tp.certify(ruckig_motion(), arm).certified
    slower = tp.PlanarArm((0.5, 0.5), (1.0 - 1e-6, 1.0), (3.0, 3.0), max_jerk=(20.0, 20.0))
    assert judged(tp.certify(ruckig_motion(), slower))["speed"][0] == "violated"


class Skewed:
    """An object whose inside is not what it evaluates to."""

    def __init__(self) -> None:
        self.c, self.x = np.ones((2, 1, 2)), np.array([0.0, 1.0])

    def __call__(self, time: float) -> np.ndarray:
        return np.zeros(2)


def test_what_a_scene_does_not_state_is_kept(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(
        TABLE + '[[obstacles]]\nshape = "ellipse"\ncenter = [0.5, 0.9]\nsemi_axes = [0.1, 0.1]\n'
        '[[constraints]]\nkind = "tool speed"\nname = "slow"\nmax = 1e-3\n[model]\nmargin = 0.02\n'
    )
    Path("cell.toml").write_text("[model]\nself_collision = false\n")
    alone = tp.certify((TIMES, *states()), "arm.toml")
    within = tp.certify((TIMES, *states()), "arm.toml", scene="cell.toml")
    assert judged(alone)["slow"][0] == str(VIOLATED)
    same(alone, within)
    assert within.scenario.model.margin == 0.02


def test_a_run_keeps_how_long_it_stays() -> None:
    moving = tp.MovingObstacle(tp.Rectangle((0.9, -0.9), (0.05, 0.05)), tp.ConstantVelocity((0.0, 0.1)))
    quick: dict[str, Any] = {"evaluations": 100, "polish": False, "retime": False}
    plan = tp.plan(ARM, start=[0.0, 0.5], goal=[0.8, 0.2], obstacles=[moving], stay=3.0, **quick)
    again = tp.certify(plan)
    assert again.certified and judged(plan).keys() - {"start", "goal"} <= judged(again).keys()
    assert again.motion.criteria.task.stay == 3.0
    assert judged(again)["clearance at the goal"][0] == str(CERTIFIED)


WRONG: list[tuple[Any, dict[str, Any], str]] = [
    (3, {}, "trajectory: (times, positions[, velocities[, accelerations]]), a file, a folder, a plan or a piecewise"),
    (lambda t: t, {}, "trajectory: the pieces of <function"),
    ({"t": TIMES}, {}, "trajectory: positions are needed"),
    ({"t": TIMES, "q": states()[0], "speed": 1}, {}, "trajectory: has no use for 'speed'"),
    ((TIMES, states()[0] + 0j), {}, "positions: an array of numbers is needed, none of them masked or complex"),
    ((TIMES, np.ma.masked_less(states()[0], 0.2)), {}, "positions: an array of numbers is needed, none of them masked"),
    ("", {}, "trajectory: the name of a file or a folder is needed, not ''"),
    ((TIMES, "abc"), {}, "positions: an array of numbers is needed"),
    ((TIMES, TIMES), {}, "positions: an array (n, k) is needed, not (9,)"),
    ((TIMES, np.zeros((9, 3))), {}, "positions: rows of 3 joints for a robot of 2"),
    ((TIMES, np.zeros((8, 2))), {}, "positions: 9 rows of joints are needed, not an array (8, 2)"),
    ((TIMES[::-1], np.zeros((9, 2))), {}, "times: have to increase; row 2 is at 1.75 s"),
    ((TIMES, np.zeros((9, 2))), {"interpolation": "cubic"}, "velocities: row 1 states none; cubic pieces need them"),
    ((TIMES, np.zeros((9, 2))), {"joint_names": ["a", "b"]}, "joint_names: the robot has no joint 'a'; it has joint_1"),
    ((TIMES, np.zeros((9, 2))), {"joint_names": ["joint_1"]}, "positions: 2 numbers in a row for 1 joint_names"),
    ((TIMES, np.zeros((9, 2))), {"without": "hurry"}, "without: 'hurry' is no limit; there are speed, "),
    ((TIMES, np.zeros((9, 2))), {"without": 3}, "without: names of limits are needed, not 3"),
    ((TIMES, np.zeros((9, 2))), {"message": 1}, "message: says how a file is read; this is none"),
    ("missing.csv", {"message": 1}, "missing.csv: message: says which trajectory of a bag; this is none"),
    ("missing.mcap", {"message": 1.5}, "message: a whole number is needed, not 1.5"),
    ("missing.csv", {}, "missing.csv: cannot be read: No such file or directory"),
    ("missing.scene", {}, "missing.scene: a motion is read from *.csv, *.npz, *.json, *.yaml, *.yml or *.mcap"),
    (Skewed(), {}, "trajectory: the pieces of this Skewed are 2 away from what it evaluates to"),
    (PPoly(np.zeros((2, 1)), [0.0, 1.0]), {}, "trajectory: a PPoly of finite values (joints,) is needed, not ()"),
    (CubicSpline(TIMES, np.zeros((9, 2))), {"interpolation": "linear"}, "interpolation: the motion is complete"),
]  # fmt: skip


@pytest.mark.parametrize(("motion", "keys", "reason"), WRONG)
def test_what_is_no_motion_is_said_in_one_line(motion: Any, keys: dict[str, Any], reason: str) -> None:
    line = line_of(lambda: tp.certify(motion, ARM, **keys))
    assert line.startswith(reason), line


def test_bags_need_an_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.scenario.bags.find_spec", lambda name: None)
    line = line_of(lambda: tp.certify("plan.mcap", ARM))
    assert line == "plan.mcap: bags need the extra mcap: pip install 'tpbso-casadi[mcap]'"


def test_constraints_and_limits_hold_besides_those_of_the_file(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(TABLE + '[[model.constraints]]\nname = "slow"\nkind = "tool speed"\nmax = 1e-3\n')
    beside = tp.Constraint(lambda m: m.tool[1], upper=10.0, name="mine", unit="m")
    for own in ({}, {"constraints": beside}):
        assert judged(tp.certify((TIMES, *states()), "arm.toml", **own))["slow"][0] == str(VIOLATED)

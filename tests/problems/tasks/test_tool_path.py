"""Ways of the tool: by hand, against SciPy's rotations, and followed by a Panda."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.slow import slow_except
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from problems import InvalidProblem, PlanarArm
from problems.base import FloatArray, as_array
from problems.certify import CertificateStatus, limit_verdicts
from problems.robots import SpatialArm, built_in
from problems.tasks import Arc, Corners, Following, StraightLine, ToolCurve, ToolPath
from problems.timing import retime

PANDA = built_in("panda", None).arm()
READY = np.array([0.0, -0.5, 0.0, -2.2, 0.0, 1.8, 0.8])


def away(way: ToolCurve, point: FloatArray) -> float:
    symbol = ca.SX.sym("tool", len(point))
    return float(ca.Function("away", [symbol], [way.away(symbol)])(point))


def along(way: ToolCurve, point: FloatArray) -> float:
    symbol = ca.SX.sym("tool", len(point))
    return float(ca.Function("along", [symbol], [way.along(symbol)])(point))


def tool(robot: SpatialArm, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
    positions, rotations = robot.tool.pose(ca.DM(np.atleast_2d(theta)))
    return as_array(positions), as_array(rotations).reshape(-1, 3, 3)


def test_a_line_by_hand() -> None:
    way = StraightLine(np.array([1.0, 0.0, 0.0]), np.array([1.0, 2.0, 0.0]))
    assert way.length == 2.0
    assert np.allclose(way.points(np.array([0.25])), [[1.0, 0.5, 0.0]])
    assert away(way, np.array([1.3, 0.7, 0.4])) == pytest.approx(0.5)
    assert along(way, np.array([1.3, 0.7, 0.4])) == pytest.approx(0.7)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 9))
@example((0.0, 1.0, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0))  # through the end of a diameter
def test_an_arc_passes_its_three_points_in_their_order(numbers: tuple[float, ...]) -> None:
    start, through, goal = np.array(numbers).reshape(3, 3)
    legs = through - start, goal - through
    if min(map(np.linalg.norm, legs)) < 0.1 or np.linalg.norm(np.cross(*legs)) < 0.05:
        return
    way = Arc(start, through, goal)
    found = way.points(np.linspace(0.0, 1.0, 2001))
    assert np.allclose(found[[0, -1]], [start, goal], atol=1e-9)
    assert np.linalg.norm(found - through, axis=1).min() <= way.length / 2000.0
    assert np.linalg.norm(np.diff(found, axis=0), axis=1).sum() == pytest.approx(way.length, rel=1e-5)
    for number in (0, 700, 2000):
        assert away(way, found[number]) <= 1e-7
        assert along(way, found[number]) == pytest.approx(number / 2000.0 * way.length, abs=1e-6)


def test_corners_are_rounded_as_far_as_said() -> None:
    way = Corners(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]]), 0.01)
    found = way.points(np.linspace(0.0, 1.0, 4001))
    corner = np.linalg.norm(found - [1.0, 0.0], axis=1).min()
    assert 0.009 <= corner <= 0.0101
    assert max(away(way, point) for point in found[::20]) <= 0.01
    assert way.length < 2.0


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: StraightLine(np.ones(3), np.ones(3)), "goal"),
        (lambda: Arc(np.zeros(3), np.ones(3), 2.0 * np.ones(3)), "through"),
        (lambda: Arc(np.zeros(3), np.zeros(3), np.ones(3)), "through"),
        (lambda: Corners(np.zeros((2, 3)), 0.01), "points"),
        (lambda: Corners(np.array([[0.0, 0.0], [1.0, 0.0], [0.2, 0.0]]), 0.01), "points"),
    ],
)
def test_impossible_ways(make: object, field: str) -> None:
    with pytest.raises(InvalidProblem) as error:
        make()  # type: ignore[operator]
    assert error.value.field == field


@pytest.mark.parametrize("kind", slow_except(["three quarters", "turning", "arc", "line", "corners"], 2))
def test_a_panda_follows(kind: str) -> None:
    (start,), (turned,) = tool(PANDA, READY)
    goal, turn = start + np.array([0.05, 0.2, -0.1]), turned
    if kind == "three quarters":
        goal = start + np.array([0.0, 0.1, -0.1])
    ways: dict[str, ToolCurve] = {
        "line": StraightLine(start, goal),
        "arc": Arc(start, start + np.array([0.0, 0.1, 0.05]), goal),
        "three quarters": Arc(start, start + np.array([0.0, 0.1, 0.1]), goal),
        "corners": Corners(np.array([start, start + np.array([0.0, 0.2, 0.0]), goal]), 3e-4),
        "turning": StraightLine(start, goal),
    }
    if kind == "turning":
        turn = turned @ Rotation.from_rotvec([0.3, 0.2, -0.4]).as_matrix()
    path = ToolPath(ways[kind], (turned, turn))
    joints = Following(path, PANDA).joints(READY, 1e-3, 0.01)
    trajectory = retime(joints, PANDA.limits)
    positions, rotations = tool(PANDA, trajectory.at(np.linspace(0.0, trajectory.duration, 500)))
    assert np.allclose(positions[-1], goal, atol=1e-8)
    assert np.allclose(rotations[-1], turn, atol=1e-7)
    assert max(away(ways[kind], position) for position in positions[::10]) <= 1e-3
    if kind == "turning":
        for position, rotation in zip(positions[::50], rotations[::50], strict=True):
            share = along(ways[kind], position) / ways[kind].length
            expected = turned @ Rotation.from_rotvec(share * np.array([0.3, 0.2, -0.4])).as_matrix()
            assert Rotation.from_matrix(expected.T @ rotation).magnitude() <= 0.01
    for stated in path.constraints(PANDA, 1e-3, 0.01):
        for verdict in limit_verdicts([stated.for_robot(PANDA, ())], trajectory):
            assert verdict.status is CertificateStatus.CERTIFIED, verdict


def test_another_way_or_another_turn_is_no_following() -> None:
    (start,), (turned,) = tool(PANDA, READY)
    path = ToolPath(StraightLine(start, start + np.array([0.0, 0.2, 0.0])), (turned, turned))
    joints = Following(path, PANDA).joints(READY, 1e-3, 0.01)
    trajectory = retime(joints, PANDA.limits)
    beside = ToolPath(StraightLine(start, start + np.array([0.0, 0.2, 0.01])), (turned, turned))
    upside_down = turned @ np.diag([1.0, -1.0, -1.0])
    for other, broken in ((beside, "path accuracy"), (ToolPath(path.way, (upside_down,) * 2), "angular accuracy")):
        limits = [stated.for_robot(PANDA, ()) for stated in other.constraints(PANDA, 1e-3, 0.01)]
        verdicts = {verdict.name: verdict for verdict in limit_verdicts(limits, trajectory)}
        assert verdicts[broken].status is CertificateStatus.VIOLATED


def test_what_cannot_be_reached_is_said() -> None:
    (start,), (turned,) = tool(PANDA, READY)
    path = ToolPath(StraightLine(start, start + np.array([1.0, 0.0, 0.0])), (turned, turned))
    with pytest.raises(InvalidProblem, match=r"cannot be led to \(0\.\d+, .*\), 0\.\d+ m along the way: "):
        Following(path, PANDA).joints(READY, 1e-3, 0.01)


@pytest.mark.parametrize("toward", [None, READY + 0.3])
def test_several_starts_are_followed_as_each_alone(toward: FloatArray | None) -> None:
    """One of them is at the end of a joint's range, where less of a margin is kept, and one is led out of its reach."""
    (start,), (turned,) = tool(PANDA, READY)
    path = ToolPath(StraightLine(start, start + np.array([0.1, 0.15, 0.0])), (turned, turned))
    at_the_end, elsewhere = READY.copy(), READY + np.array([0.0, 0.4, 0.0, 1.8, 0.0, 0.0, 0.0])
    at_the_end[1] = PANDA.limits.position[1][0] if PANDA.limits.position else 0.0
    starts = np.array([READY, at_the_end, elsewhere, READY + 1e-3])
    following = Following(path, PANDA, toward)
    together = following.followed(starts, 9)
    for number, each in enumerate(starts):
        alone = following.followed(each[None], 9)
        assert np.array_equal(together.postures[number], alone.postures[0])
        assert (together.points[number], together.jumped[number]) == (alone.points[0], alone.jumped[0])
    assert together.complete[0]


def test_a_finer_path_passes_the_points_of_a_coarser_one() -> None:
    (start,), (turned,) = tool(PANDA, READY)
    path = ToolPath(StraightLine(start, start + np.array([0.1, 0.4, 0.0])), (turned, turned))
    following = Following(path, PANDA)
    points = following.followed(READY[None], 5).postures[0]
    fine = following.refined(points, 1e-4, 1e-3)
    assert fine.breakpoints.size > 9
    passed = fine.at(fine.breakpoints[:: (fine.breakpoints.size - 1) // 4])
    assert passed == pytest.approx(points, abs=1e-12)
    assert max(away(path.way, point) for point in tool(PANDA, fine.at(fine.breakpoints))[0]) <= 1e-8


def test_an_arm_in_the_plane_follows_a_line() -> None:
    arm = PlanarArm((0.5, 0.4, 0.3), max_speed=(2.0,) * 3, max_acceleration=(10.0,) * 3)
    theta = np.array([0.3, 0.9, -0.4])
    start = as_array(arm.tool.position(ca.DM(theta).T))[0]
    way = StraightLine(start, start + np.array([-0.1, 0.15]))
    path = Following(ToolPath(way), arm).joints(theta, 1e-3, 0.01)
    found = as_array(arm.tool.position(ca.DM(path.at(np.linspace(*path.breakpoints[[0, -1]], 100)))))
    assert np.allclose(found[-1], way.goal, atol=1e-8)
    assert max(away(way, point) for point in found) <= 1e-3

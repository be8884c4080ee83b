"""Poses as places: misses by hand, candidates that arrive, branches that are clear and apart, refusals by name."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.space import small_arm
from scipy.spatial.transform import Rotation

from problems import Box, InvalidProblem, Joints, Move, PlanarArm
from problems.base import Arguments, FloatArray, as_array
from problems.families.splines.branches import branch_posture, branched, least_time, on_postures
from problems.robots import SpatialArm, Sphere
from problems.tasks import Pose
from problems.tasks.pose import SETTINGS
from problems.timing.free_space import least_durations

ARM = small_arm()
BENT = np.array([0.4, 0.7, -0.3, 0.9, 0.2, 0.8, 0.1])
UPRIGHT = (0.0, 0.0, 1.2)
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def tool_of(robot: SpatialArm, theta: FloatArray) -> tuple[FloatArray, Rotation]:
    position, rotation = robot.tool.pose(ca.DM(theta).T)
    return as_array(position).ravel(), Rotation.from_matrix(as_array(rotation).reshape(3, 3))


def pose_at(theta: FloatArray, robot: SpatialArm = ARM, turned: bool = True) -> Pose:
    position, rotation = tool_of(robot, theta)
    return Pose(tuple(position.tolist()), tuple(rotation.as_quat().tolist()) if turned else None)


def miss(place: Pose, theta: FloatArray) -> FloatArray:
    return as_array(place.miss(ARM, ca.DM(np.atleast_2d(theta))))


@pytest.mark.parametrize(("angle", "size"), [(0.3, np.sin(0.3)), (-0.3, -np.sin(0.3)), (2.0, 2.0 - np.sin(2.0))])
def test_turns_about_the_vertical_by_hand(angle: float, size: float) -> None:
    found = miss(Pose(UPRIGHT, NO_TURN), np.array([angle, *np.zeros(6)]))
    assert found == pytest.approx(np.array([[0.0, 0.0, 0.0, 0.0, 0.0, size]]), abs=2e-9)


def test_misses_grow_with_the_angle_about_any_axis() -> None:
    rng = np.random.default_rng(3)
    angles = np.linspace(0.0, np.pi, 12)
    for axis in rng.standard_normal((5, 3)):
        turns = [Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)) for angle in angles]
        sizes = [np.linalg.norm(miss(Pose(UPRIGHT, tuple(t.as_quat().tolist())), np.zeros(7))[0, 3:]) for t in turns]
        assert (np.diff(sizes) > 0.0).all()


def test_misses_of_positions_by_hand_and_many_rows() -> None:
    theta = np.array([np.zeros(7), [0.0, np.pi / 2, *np.zeros(5)]])
    assert miss(Pose((0.0, 0.1, 1.0)), theta) == pytest.approx(np.array([[0, -0.1, 0.2], [0.9, -0.1, -0.7]]), abs=1e-12)
    assert Pose(UPRIGHT).unit == "m"
    assert Pose(UPRIGHT, NO_TURN).unit == "m, rad"


@pytest.mark.parametrize("turned", [True, False])
def test_candidates_around_a_branch_arrive(turned: bool) -> None:
    place = replace(pose_at(BENT, turned=turned), branch=tuple(BENT.tolist()))
    x = ca.SX.sym("x", 7)
    function = ca.Function("posture", [x], list(place.posture(ARM, x, 1.0, None)))
    chosen = np.random.default_rng(1).uniform(-1.0, 1.0, (60, 7))
    postures, missed = (as_array(part) for part in function.map(len(chosen))(chosen.T))
    theta, arrived = postures.reshape(len(chosen), 7), missed.ravel() <= 1.0
    assert arrived.mean() > 0.97
    wanted, rotation = tool_of(ARM, BENT)
    for row in theta[arrived]:
        position, found = tool_of(ARM, row)
        assert position == pytest.approx(wanted, abs=2e-9)
        assert not turned or (rotation.inv() * found).magnitude() < 4e-9
    assert np.abs(theta).max() <= 2.8
    spread = np.ptp(theta[arrived], axis=0)
    assert spread.max() > SETTINGS.offset  # its freedom is made use of


def test_the_middle_of_the_choices_is_the_branch() -> None:
    place = replace(pose_at(BENT), branch=tuple(BENT.tolist()))
    assert branch_posture(ARM, place) == pytest.approx(BENT, abs=1e-12)
    assert place.projected(ARM, BENT + 0.05) != pytest.approx(BENT, abs=1e-3)
    assert np.abs(miss(place, place.projected(ARM, BENT + 0.05))).max() < 1e-12


def test_a_symbolic_twin_says_the_same() -> None:
    place = replace(pose_at(BENT), branch=tuple(BENT.tolist()))
    arguments = Arguments()
    robot, symbolic_copy = arguments.symbolic_copy(ARM), arguments.symbolic_copy(place)
    x = ca.SX.sym("x", 7)
    function = ca.Function("posture", [x, arguments.symbols], [symbolic_copy.posture(robot, x, 1.0, None)[0]])
    chosen = np.linspace(-0.5, 0.5, 7)
    found = as_array(function(chosen, arguments.values)).ravel()
    expected = as_array(place.posture(ARM, ca.DM(chosen), 1.0, None)[0]).ravel()
    assert found == pytest.approx(expected, abs=1e-12)


def test_branches_are_there_and_apart_the_nearest_comes_first_and_they_keep_clear() -> None:
    """A box around the elbow of the nearest branch takes that one away, and others that are like it."""
    arm, place = small_arm(spheres=(Sphere(4, (0.0, 0.0, 0.0), 0.05, "elbow"),)), pose_at(BENT)
    branches = place.branches(arm, (), BENT, "goal")
    found = np.array([each.branch for each in branches if isinstance(each, Pose)])
    assert len(found) > 3
    assert max(np.abs(miss(place, theta)).max() for theta in found) < 1e-8
    assert (np.abs(found[:, None] - found).max(axis=2) + np.eye(len(found))).min() > SETTINGS.least_difference
    assert (np.diff(np.abs(found - BENT).max(axis=1)) >= 0.0).all()
    elbow = as_array(arm.positions(ca.DM(BENT).T)[8]).ravel()
    kept = place.branches(arm, (Box(center=tuple(elbow.tolist()), size=(0.1, 0.1, 0.1)),), BENT, "goal")
    assert len(kept) > 0
    assert branches[0] not in kept


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        (Pose((0.5, 0.5)), "x, y, z are needed"),
        (Pose((9.0, 0.0, 0.0)), "goal[1]: (9.0, 0.0, 0.0) is 9 m from the base, out of reach"),
        (Pose((0.5, 0.0, 0.5), (0.0, 0.0, 1.0, 1.0)), "no quaternion x, y, z, w of length 1"),
        (Pose((0.5, 0.0, float("nan"))), "nan is not within"),
        (Pose((0.5, 0.0, 0.5), None, (1.0,)), "1 joints of a branch for a robot of 7"),
    ],
)
def test_poses_that_cannot_be_are_refused_in_one_line(place: Pose, reason: str) -> None:
    with pytest.raises(InvalidProblem) as caught:
        place.check(ARM, (), "goal", "goal[1]: ")
    assert str(caught.value).startswith("goal: ")
    assert reason in str(caught.value)


def test_what_is_for_arms_in_space_or_in_the_plane_alone() -> None:
    arm = PlanarArm((1.0, 1.0), (4.0, 4.0), (20.0, 20.0))
    with pytest.raises(InvalidProblem, match="goal: a pose in space is not for PlanarArm"):
        Move(arm, Joints((0.0, 0.0)), (Pose((1.0, 0.0, 0.0)),))
    with pytest.raises(InvalidProblem, match="elbow: 'up' does not apply to a robot in space"):
        Move(ARM, Joints((0.0,) * 7), (Joints((0.1,) * 7),), elbow="up")


def test_a_pose_that_nothing_reaches_or_that_is_walled_in_is_named() -> None:
    with pytest.raises(InvalidProblem, match=r"goal: no posture of 400 searches"):
        Pose((0.0, 0.0, 1.2), (1.0, 0.0, 0.0, 0.0)).branches(ARM, (), None, "goal")
    tool = Sphere(7, (0.0, 0.0, 0.15), 0.05, "hand")
    place = pose_at(BENT)
    wall = Box(center=tuple(place.point), size=(0.2, 0.2, 0.2))
    with pytest.raises(InvalidProblem, match=r"goal: none of \d+ postures .* is clear; hand.*Box"):
        place.branches(small_arm(spheres=(tool,)), (wall,), None, "goal")


def test_moves_to_branches_are_sorted_and_joined_by_one_start() -> None:
    task = Move(ARM, pose_at(0.5 * BENT), (pose_at(BENT), Joints(tuple((BENT + 0.1).tolist()))), (pose_at(0.8 * BENT),))
    found = branched(task)
    assert len(found) > 2
    assert len({(one.start, one.vias) for one in found}) == 1
    times = [least_time(one) for one in found]
    assert times == sorted(times)
    assert any(isinstance(one.goals[0], Joints) for one in found)
    start = branch_posture(ARM, found[0].start)
    middles = [np.abs(each.branch).max() for each in task.start.branches(ARM, (), None, "start")]
    assert np.abs(start).max() == pytest.approx(min(middles))
    stops = [start, branch_posture(ARM, found[0].vias[0]), branch_posture(ARM, found[0].goals[0])]
    assert times[0] == pytest.approx(least_durations(np.abs(np.diff(stops, axis=0)), ARM.limits).max(axis=1).sum())


def test_several_goals_in_space_are_branches_even_where_they_are_joints() -> None:
    task = Move(ARM, Joints((0.0,) * 7), (Joints(tuple(BENT.tolist())), Joints((0.1,) * 7)))
    assert [one.goals for one in branched(task)] == [(task.goals[1],), (task.goals[0],)]
    assert branched(replace(task, goals=task.goals[:1])) == (replace(task, goals=task.goals[:1]),)


def test_of_several_goals_one_may_be_out_of_the_question() -> None:
    impossible = Pose((0.0, 0.0, 1.2), (1.0, 0.0, 0.0, 0.0))
    task = Move(ARM, Joints((0.0,) * 7), (impossible, pose_at(BENT)))
    assert {one.goals[0].point for one in branched(task) if isinstance(one.goals[0], Pose)} == {pose_at(BENT).point}
    with pytest.raises(InvalidProblem, match=r"goal\[0\]: no posture"):
        branched(replace(task, goals=(impossible, impossible)))


def test_stored_branches_are_checked() -> None:
    task = Move(ARM, Joints((0.0,) * 7), (pose_at(BENT), pose_at(0.5 * BENT)))
    stated = on_postures(task, {"goal": 0.5 * BENT})
    assert stated.goals == (replace(task.goals[1], branch=tuple((0.5 * BENT).tolist())),)
    for theta, reason in ((BENT + 0.1, "misses it by"), (np.full(7, 3.0), "is not within"), (np.zeros(3), "3 joints")):
        with pytest.raises(InvalidProblem, match=reason):
            on_postures(task, {"goal": theta})

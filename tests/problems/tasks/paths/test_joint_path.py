"""A given path in joint space: what is refused, and what a motion along it is judged by."""

from __future__ import annotations

import numpy as np
import pytest

from problems import InvalidProblem, PlanarArm, Trajectory
from problems.assembly import joint_following
from problems.motions import JointPath
from problems.tasks import JointFollowing
from problems.timing import retime

ARM = PlanarArm((1.0, 1.0), (2.0, 3.0), (10.0, 8.0))
LINE = JointPath.through(np.array([[0.0, 0.0], [3.0, 4.0]]))  # 5 rad long
REST = JointPath(np.array([0.0, 1.0]), np.array([[[-2.0, 1.0]], [[3.0, -1.5]], [[0.0, 0.0]], [[0.0, 0.0]]]))


def status_of(task: JointFollowing, trajectory: Trajectory) -> dict[str, str]:
    return {v.name: str(v.status) for v in joint_following(task).verify(trajectory)}


@pytest.mark.parametrize(
    ("arguments", "field", "reason"),
    [
        (
            {"path": JointPath.through(np.repeat([[0.0], [1.0]], 3, axis=1))},
            "joints",
            "a path of 3 joints for a robot of 2",
        ),
        ({"start_speed": -1.0}, "start_speed", "negative"),
        ({"goal_speed": np.nan}, "goal_speed", "no number"),
        ({"start_speed": 4.0}, "start_speed", "joint 1 would have 2.4 rad/s, and may have 2 rad/s"),
        ({"path": REST, "goal_speed": 0.1}, "goal_speed", "standstill"),
        ({"total_time": (2.0, 1.0)}, "total_time", "does not hold"),
    ],
)
def test_what_cannot_be_is_named(arguments: dict[str, object], field: str, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason) as caught:
        JointFollowing(**({"robot": ARM, "path": LINE} | arguments))  # type: ignore[arg-type]
    assert caught.value.field == field


def test_a_speed_along_the_path_is_that_of_its_length() -> None:
    task = JointFollowing(ARM, LINE, start_speed=1.0, goal_speed=2.0)
    np.testing.assert_allclose(task.end_velocities, [[0.6, 0.8], [1.2, 1.6]])


@pytest.mark.parametrize(("start", "goal"), [(0.0, 0.0), (1.0, 0.0), (0.0, 1.5), (1.0, 2.0)])
def test_the_motion_along_it_is_certified(start: float, goal: float) -> None:
    task = JointFollowing(ARM, LINE, start_speed=start, goal_speed=goal)
    motion = joint_following(task).given_motion()
    assert set(status_of(task, motion).values()) == {"certified"}
    np.testing.assert_allclose(motion.at(motion.breakpoints[[0, -1]], 1), task.end_velocities, atol=1e-12)


def test_another_path_and_other_ends_are_seen() -> None:
    task = JointFollowing(ARM, LINE)
    other = retime(JointPath.through(np.array([[0.0, 0.0], [1.5, 2.1], [3.0, 4.0]])), ARM.limits)
    assert status_of(task, other)["path"] == "violated"
    moving = joint_following(JointFollowing(ARM, LINE, start_speed=1.0)).given_motion()
    assert status_of(task, moving)["start velocity"] == "violated"


def test_a_total_time_slows_it() -> None:
    task = JointFollowing(ARM, LINE, total_time=(5.0, 6.0))
    motion = joint_following(task).given_motion()
    assert motion.duration == pytest.approx(5.0)
    assert set(status_of(task, motion).values()) == {"certified"}

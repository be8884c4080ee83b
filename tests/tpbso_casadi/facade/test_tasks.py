"""Tasks given as objects: the scenario that states one has the same task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import tpbso_casadi as tp
from problems.tasks import JointFollowing, Task
from tpbso_casadi.scenario.tasks import STATED

ARM = tp.robot([0.7, 0.7, 0.6], max_speed=4.0, max_acceleration=20.0).model
OVAL = tp.Ellipse((1.6, 1.2), (0.1, 0.2))
PATH = tp.Path.through([(1.0, 0.2), (1.2, 0.6), (0.8, 0.8), (0.7, 0.8)])
HALF = (0.5**0.5, 0.0, 0.0, 0.5**0.5)
PANDA = tp.robot("panda").model
POSES = np.array([[0.4, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0], [0.5, 0.1, 0.5, 1.0, 0.0, 0.0, 0.0]])
TASKS: list[Task] = [
    tp.PointToPoint(ARM, (1.0, 0.0), (0.5, 1.5)),
    tp.PointToPoint(ARM, (1.0, 0.0), (0.5, 1.5), "up", (OVAL,), (0.2, 3.0)),
    tp.Move(ARM, tp.Position((1.0, 0.0)), (tp.Position((0.5, 1.5)), tp.Joints((0.1, 0.2, 0.3))), obstacles=(OVAL,)),
    tp.Move(
        ARM, tp.Joints((0.3, 0.2, 0.1)), (tp.Joints((1.0, 0.2, 0.1)),), (tp.Joints((0.5, 0.0, 0.0)),),
        start_velocity=(0.1, 0.0, 0.0), goal_velocity=(0.0, 0.1, 0.0), total_time=(0.1, 5.0),
    ),
    tp.Move(replace(ARM, margin=0.01), tp.Joints((0.3, 0.2, 0.1)), (tp.Joints((1.0, 0.2, 0.1)),), stay=0.5),
    tp.PathFollowing(ARM, PATH, 0.1, elbow="up", knots=3),
    tp.PathTracing(ARM, PATH, 0.02, obstacles=(OVAL,), total_time=(0.5, 9.0)),
    tp.SpaceTracing(replace(PANDA, self_collision=True), tp.Path.through(POSES), 0.01, 0.05),
]  # fmt: skip


def test_every_kind_is_tried() -> None:
    assert {type(task) for task in TASKS} | {JointFollowing} == set(STATED)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: type(task).__name__)
def test_the_scenario_has_the_task(task: Task) -> None:
    assert tp.scenario_of(task).problem().task == task


def test_a_path_in_joint_space_is_a_task_too() -> None:
    path = tp.JointPath.through(np.array([[0.0, 0.5, 0.0], [0.6, 0.9, 0.3], [1.0, 0.2, 0.1]]))
    task = JointFollowing(ARM, path, start_speed=0.5)
    plan = tp.plan(task)
    assert plan.certified
    assert plan.search is None
    assert plan.duration == pytest.approx(tp.retime(path, ARM, start_speed=0.5).duration, abs=1e-12)


def test_arguments_override_what_a_task_says() -> None:
    scenario = tp.scenario_of(TASKS[0], goal=np.array([0.6, 1.4]), motion="spline", obstacles=[OVAL], seed=np.int64(4))
    assert scenario.model.motion == "spline"
    assert scenario.solver.seed == 4
    assert scenario.problem().task.obstacles == (OVAL,)


def test_corners_of_ones_own_are_refused() -> None:
    bent = replace(PATH, corners=())
    with pytest.raises(tp.ScenarioError, match="path: its corners"):
        tp.scenario_of(tp.PathTracing(ARM, bent, 0.02))


class MyTask(tp.PointToPoint):
    """A task that no table states."""


def test_a_task_of_ones_own_needs_a_kind() -> None:
    with pytest.raises(tp.ScenarioError, match=r"robot, no scenario|needed|robot"):
        tp.scenario_of(MyTask(ARM, (1.0, 0.0), (0.5, 1.5)))


def test_a_robot_in_space_of_unknown_origin_is_refused() -> None:
    slower = replace(PANDA, max_speed=tuple(0.5 * speed for speed in PANDA.limits.speed))
    move = tp.Move(
        slower, tp.Joints((0.0, -0.5, 0.0, -2.0, 0.0, 1.5, 0.5)), (tp.Joints((0.3,) * 3 + (-2.0,) + (0.3,) * 3),)
    )
    with pytest.raises(tp.ScenarioError, match=r"robot: say tp\.robot\('panda'\)"):
        tp.scenario_of(move)

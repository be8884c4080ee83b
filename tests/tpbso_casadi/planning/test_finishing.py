"""The last stage: never worse, never uncertified in place of certified, and as fast as the path allows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.space_scenarios import GOAL, URDF, space_scenario

from problems.timing.free_space import rest_to_rest
from solvers.budget import Interruption
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.planning import POLISHED, SAME_PATH, PlannedMotion, Progress, Retiming, plan
from tpbso_casadi.planning.finishing import is_better, retimed
from tpbso_casadi.planning.plan import finished
from tpbso_casadi.planning.planning import Planning

SILENT = Progress()


@cache
def planned(case: str, *, retime: bool = False, **task: Any) -> PlannedMotion:
    content = builtin(case).table()
    content["model"] |= {"retime": retime, "formulation": "reduced"}
    content["task"] |= task
    content["solver"] |= {"name": "pso", "evaluations": 1000}
    return plan(parse_scenario(content))


def timed_anew(found: PlannedMotion) -> Retiming:
    assert found.problem is not None
    return retimed(found.motion, found.problem.direct, SILENT)


@cache
def retiming_of(case: str) -> Retiming:
    return timed_anew(planned(case))


@pytest.mark.parametrize(
    ("case", "candidate"),
    [
        ("time-3", "free space"),
        ("rotation-3", SAME_PATH),
        pytest.param("pentagram-time", SAME_PATH, marks=pytest.mark.slow),
    ],
)
def test_a_retimed_plan_is_certified_no_slower_and_keeps_what_it_is_bound_to(case: str, candidate: str) -> None:
    before, retiming = planned(case), retiming_of(case)
    assert retiming.accepted
    assert retiming.candidate == candidate
    assert retiming.chosen.feasible
    assert retiming.chosen.trajectory.duration < before.trajectory.duration
    assert retiming.chosen.objective <= before.objective * (1.0 + 1e-9)


def test_from_rest_to_rest_through_nothing_the_closed_form_is_fastest() -> None:
    trajectory = planned("time-3").trajectory
    theta = trajectory.at(trajectory.breakpoints[[0, -1]])
    way = np.abs(theta[1] - theta[0])
    alone = np.where(way > 0.8, way / 4.0 + 0.2, 2.0 * np.sqrt(way / 20.0))  # 4 rad/s, 20 rad/s^2
    assert retiming_of("time-3").chosen.objective == pytest.approx(alone.max(), rel=1e-9)


@pytest.mark.slow
def test_where_a_pose_leaves_the_posture_open_free_space_is_not_the_fastest() -> None:
    wrist = """<link name="wrist"/><joint name="nod" type="revolute"><parent link="lower"/><child link="wrist"/>
     <origin xyz="0 0 0.3"/><axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="10"/></joint>
     <joint name="grip" type="fixed"><parent link="wrist"/><child link="hand"/><origin xyz="0 0 0.1"/></joint>"""
    robot = {"urdf_text": URDF[: URDF.index('<joint name="grip"')] + wrist + "</robot>"}
    task = {"start": {"joints": [0.98, 0.8, 0.6, 0.2]}}
    scenario = space_scenario(
        robot=robot, task=task, obstacles=[], solver={"evaluations": 100}, model={"retime": False}
    )
    found = plan(parse_scenario(scenario))
    before, retiming = found.motion, timed_anew(found)
    first, last = before.trajectory.at(before.trajectory.breakpoints[[0, -1]])
    assert retiming.candidate == POLISHED
    assert retiming.chosen.feasible
    trajectory = retiming.chosen.trajectory
    assert trajectory.duration < rest_to_rest(first, last, before.criteria.robot.limits).duration
    tool = retiming.chosen.joint_positions(trajectory.breakpoints[-1:])[0, -1]
    assert tool == pytest.approx(GOAL["position"], abs=1e-8)


def test_in_the_plane_torques_are_kept_by_another_path_and_speed() -> None:
    arm = {"link_lengths": [0.5, 0.5], "max_speed": 4.0, "max_acceleration": 40.0, "link_masses": 2.0}
    content = {
        "arm": arm | {"max_torque": [35.0, 12.0]},
        "task": {"kind": "point-to-point", "start": [0.6, -0.3], "goal": [0.3, 0.6]},
        "model": {"retime": False},
        "solver": {"name": "lshade", "evaluations": 500},
    }
    found = plan(parse_scenario(content))
    before, retiming = found.motion, timed_anew(found)
    first, last = before.trajectory.at(before.trajectory.breakpoints[[0, -1]])
    free = rest_to_rest(first, last, before.criteria.robot.limits)
    slowed = free.duration * before.criteria.safe_time_scale(free)
    assert slowed > 1.2 * free.duration
    assert retiming.chosen.feasible
    assert retiming.chosen.trajectory.duration < 0.9 * slowed


def test_an_uncertified_motion_is_never_taken_for_a_certified_one() -> None:
    motion = planned("time-3").motion
    hasty = replace(motion, trajectory=motion.trajectory.time_scaled(0.5), retimed=True)
    assert not hasty.feasible
    assert not is_better(hasty, motion)
    assert is_better(motion, hasty)
    assert Retiming(motion, hasty, SAME_PATH, 0.0).chosen is motion


def test_with_the_same_objective_the_shorter_duration_counts_and_a_longer_path_never() -> None:
    motion = planned("rotation-3").motion
    slower = replace(motion, trajectory=motion.trajectory.time_scaled(1.5), retimed=True)
    assert is_better(motion, slower)
    assert not is_better(slower, motion)
    other = planned("rotation-3", goal=(0.6, 1.4)).motion
    assert is_better(other, motion) == (other.objective < motion.objective)


@pytest.mark.parametrize("spoil", [np.nan, 0.0])
def test_a_motion_that_cannot_be_timed_is_left_alone(spoil: float) -> None:
    found = planned("time-3")
    broken = replace(found.trajectory, coefficients=found.trajectory.coefficients * spoil)
    retiming = timed_anew(replace(found, motion=replace(found.motion, trajectory=broken)))
    assert (retiming.after, retiming.candidate, retiming.accepted) == (None, "", False)


def test_a_least_segment_time_is_kept() -> None:
    solution = planned("time-3", retime=True, segment_time=(0.4, 2.0))
    assert solution.feasible
    assert np.diff(solution.trajectory.breakpoints).min() >= 0.4 * (1.0 - 1e-9)


def test_a_request_to_stop_leaves_the_plan_as_it_was_found() -> None:
    found, interruption = planned("time-3"), Interruption()
    interruption.requested = True
    planning = Planning(
        scenario=found.scenario,
        solver=found.scenario.solver.build(),
        settings=found.scenario.solver,
        evaluation=None,
        progress=SILENT,
        interruption=interruption,
    )
    left = finished(found, found.scenario.problem(), planning)
    assert left.motion is found.motion
    assert left.retiming is None
    assert left.interrupted

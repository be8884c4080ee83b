"""Torques that need not depend on angles: without gravity only friction is held, and sliding joints turn nothing."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from problems import Joints, Move, PlanarArm, Robot, move
from problems.base import as_array
from problems.evaluation import EvaluationOptions
from problems.robots import read_urdf

AFLOAT = PlanarArm(
    (0.5, 0.4), (4.0,) * 2, (40.0,) * 2, link_masses=(2.0, 1.0), max_torque=(20.0, 6.0), gravity=(0.0, 0.0)
)
RUBBING = replace(AFLOAT, viscous_friction=(0.2, 0.1), coulomb_friction=(0.5, 0.3))
INERTIA = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
GANTRY = f"""<robot name="gantry"><link name="base"/>
<link name="bridge"><inertial><mass value="5"/>{INERTIA}</inertial></link>
<link name="tool"><inertial><mass value="3"/>{INERTIA}</inertial></link>
<joint name="along" type="prismatic"><parent link="base"/><child link="bridge"/><axis xyz="1 0 0"/>
<limit lower="-1" upper="1" velocity="2" effort="60"/></joint>
<joint name="up" type="prismatic"><parent link="bridge"/><child link="tool"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="2" effort="60"/></joint></robot>"""
SLIDING = read_urdf(GANTRY, None, None).arm(max_acceleration=40.0)


@pytest.mark.parametrize("objective", ["time", "energy", "work"])
@pytest.mark.parametrize("robot", [AFLOAT, RUBBING, SLIDING], ids=["afloat", "rubbing", "sliding"])
def test_candidates_can_be_evaluated_and_are_feasible_by_construction(robot: Robot, objective: str) -> None:
    problem = move(Move(robot, Joints((-0.4, 0.3)), (Joints((0.7, -0.2)),)), objective, samples=12)
    straight = np.mean(problem.bounds, axis=0)
    costs = problem.evaluator(EvaluationOptions("vm"))(straight[None, :])
    assert (costs <= problem.objective_upper_bound).all()
    [torque] = [constraint for constraint in problem.constraints if constraint.name == "torque"]
    used = as_array(ca.Function("used", [problem.model.x], [torque.expression])(straight))
    assert (np.abs(used) <= torque.bounds[1] * (1.0 + 1e-9)).all()
    assert np.abs(used).max() > 0.0

"""That a finished motion has the velocities of its task at both ends, and the acceleration at its start."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.limits.constraint import Constraint
from problems.motions.trajectory import Trajectory
from problems.tasks.task import Task

RATE_TOLERANCE = 1e-9  # of a joint's largest speed or acceleration; allows for rounding only


def velocity_conditions(task: Task, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
    """The velocities at both ends: numeric constraints, and the times of their rows in s."""
    ends = trajectory.breakpoints[[0, -1]]
    away = np.abs(trajectory.at(ends, 1) - task.end_velocities)
    bounds = RATE_TOLERANCE * np.array(task.robot.limits.speed)
    return [
        (_rates(task, name, "rad/s", "dtheta_i", away[i], bounds), ends[i : i + 1])
        for i, name in enumerate(("start velocity", "goal velocity"))
    ]


def acceleration_conditions(task: Task, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
    """The same of the acceleration at the start."""
    start = trajectory.breakpoints[:1]
    away = np.abs(trajectory.at(start, 2)[0] - task.end_accelerations[0])
    bounds = RATE_TOLERANCE * np.array(task.robot.limits.acceleration)
    return [(_rates(task, "start acceleration", "rad/s^2", "d2theta_i", away, bounds), start)]


def _rates(task: Task, name: str, unit: str, symbol: str, away: FloatArray, bounds: FloatArray) -> Constraint:
    """Rates of the joints that differ from those of the task by ``away`` (dof,), and may by ``bounds`` (dof,)."""
    bound = ca.DM(bounds).T
    return Constraint(
        name=name,
        unit=unit,
        expression=ca.DM(away).T,
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=task.robot.joint_names,
        scale=bound,
        for_all_t=False,
        formula=f"|{symbol} - {name}_i|, to rounding",
    )

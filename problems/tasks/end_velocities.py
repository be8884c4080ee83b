"""That a finished motion has the velocities of its task at both ends."""

from __future__ import annotations

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.limits.constraint import Constraint
from problems.motions.trajectory import Trajectory
from problems.tasks.task import Task

SPEED_TOLERANCE = 1e-9  # of a joint's largest speed; allows for rounding only


def velocity_conditions(task: Task, trajectory: Trajectory) -> list[tuple[Constraint, FloatArray]]:
    """The velocities at both ends: numeric constraints, and the times of their rows in s."""
    ends = trajectory.breakpoints[[0, -1]]
    away = np.abs(trajectory.at(ends, 1) - task.end_velocities)
    bound = ca.DM(SPEED_TOLERANCE * np.array([task.robot.limits.speed]))
    return [
        (
            Constraint(
                name=name,
                unit="rad/s",
                expression=ca.DM(away[i : i + 1]),
                lower=-bound,
                upper=bound,
                symmetric=True,
                columns=task.robot.joint_names,
                scale=bound,
                for_all_t=False,
                formula=f"|dtheta_i - {name}_i|, to rounding",
            ),
            ends[i : i + 1],
        )
        for i, name in enumerate(("start velocity", "goal velocity"))
    ]

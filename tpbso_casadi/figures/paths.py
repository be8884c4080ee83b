"""The figure of a path: where the tool goes, a fan of postures, and where the arm is closest to an obstacle.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from matplotlib.figure import Figure

from tpbso_casadi.figures.postures.in_plane import path_in_plane
from tpbso_casadi.figures.postures.in_space import path_in_space
from tpbso_casadi.planning.planned_motion import PlannedMotion

PATH_FIGURES = {2: path_in_plane, 3: path_in_space}  # by the robot's dimensions


def path_figure(plan: PlannedMotion) -> Figure:
    """(b) The tool's path, a fan of postures, obstacles, what the task states, and the closest approach."""
    return PATH_FIGURES[plan.criteria.robot.dim](plan)

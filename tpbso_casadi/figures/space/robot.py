"""A robot alone, as it is before there is a task.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from problems.robots.spatial.description import RobotDescription
from tpbso_casadi.figures.space.panels import Posture, space_figure
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.storage.files import write_with

COLOUR = "#1f77b4"
DPI = 150


def draw_robot(file: Path, description: RobotDescription) -> Path:
    """Three views and a picture of a robot with its spheres, as near to zero as its joints can be.

    Raises:
        OSError: the file cannot be written.
    """
    robot = description.drawn
    low, high = np.array(robot.position_limits).T
    posture = Posture(description.title or description.chain.name, COLOUR, np.clip(np.zeros(robot.dof), low, high))
    figure = space_figure(Scene(robot), [posture])
    return write_with(file, partial(figure.savefig, dpi=DPI))

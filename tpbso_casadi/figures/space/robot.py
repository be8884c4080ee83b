"""A robot alone, as it is before there is a task.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from problems.robots.spatial.description import RobotDescription
from tpbso_casadi.figures.space.panels import Posture, space_figure
from tpbso_casadi.figures.space.scene import Scene
from tpbso_casadi.figures.style.colours import BLUE
from tpbso_casadi.figures.style.files import write_figure

COLOUR = BLUE


def draw_robot(file: Path, description: RobotDescription) -> Path:
    """Three views and a picture of a robot with its spheres, as near to zero as its joints can be.

    Raises:
        OSError: the file cannot be written.
    """
    robot = description.drawn
    low, high = np.array(robot.position_limits).T
    posture = Posture(description.title or description.chain.name, COLOUR, np.clip(np.zeros(robot.dof), low, high))
    figure = space_figure(Scene(robot), [posture])
    [path] = write_figure(file.parent, file.stem, figure, (file.suffix[1:],))
    return path

"""What a film shows: each function draws what stands still and returns one that shows a frame.

Imported only where a film is made: matplotlib is slow to load.
"""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.axes import Axes

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.moving import draw_ways
from tpbso_casadi.figures.scene import capsule, draw_bodies, draw_obstacle, draw_scene, wide_bodies
from tpbso_casadi.figures.space.panels import Posture, draw_picture
from tpbso_casadi.figures.style.colours import BLUE

ARM, WAY = "#1b2733", BLUE


def plane(axes: Axes, frames: Frames) -> Callable[[int], None]:
    """An arm in the plane, to scale."""
    draw_scene(axes, frames.problem)
    left, right, bottom, top = frames.extent
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    axes.grid(alpha=0.3)
    tip_path = axes.plot([], [], color=WAY, linewidth=2.0)[0]
    arm = axes.plot([], [], "-o", color=ARM, markerfacecolor="white", linewidth=2.2, zorder=5)[0]
    robot = frames.problem.robot
    draw_ways(axes, [course.middles for course in frames.courses])
    obstacles = [draw_obstacle(axes, course.outlines[0]) for course in frames.courses]
    bodies = draw_bodies(axes, robot, frames.joints[0], ARM)

    def show(index: int) -> None:
        tip_path.set_data(*frames.joints[: index + 1, -1].T)
        arm.set_data(*frames.joints[index].T)
        for patch, body in zip(bodies, wide_bodies(robot), strict=True):
            patch.set_xy(capsule(body, frames.joints[index]))
        for patch, course in zip(obstacles, frames.courses, strict=True):
            patch.set_xy(course.outlines[index])

    return show


def space(axes: Axes, frames: Frames) -> Callable[[int], None]:
    """A robot in space, in perspective."""
    scene, centers = frames.scene, frames.scene.centers(frames.theta)
    bounds = scene.bounds(frames.theta)
    view = scene.view(frames.theta, bounds)
    picture = draw_picture(axes, view, scene, Posture("", ARM, frames.theta[0]), bounds)
    draw_ways(axes, [view.project(course.middles) for course in frames.courses])
    tip_path = axes.plot([], [], color=WAY, linewidth=2.0, zorder=3)[0]

    def show(index: int) -> None:
        tip_path.set_data(*view.project(frames.joints[: index + 1, -1]).T)
        picture.arm.set_data(*view.project(frames.joints[index]).T)
        picture.painting.show(centers[index], float(frames.times[index]))

    return show


STAGES = {2: plane, 3: space}  # by the robot's dimensions

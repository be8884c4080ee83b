"""Films: a figure for each frame."""

from __future__ import annotations

import errno
import subprocess
import warnings
from collections.abc import Callable
from pathlib import Path
from threading import Timer
from typing import Any

import matplotlib as mpl
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.palette import BLUE
from tpbso_casadi.figures.scene import capsule, draw_bodies, draw_obstacle, draw_scene, draw_ways, wide_bodies
from tpbso_casadi.figures.space import Posture, draw_picture, in_strokes, parted
from tpbso_casadi.figures.style import lay_out

ARM, WAY = "#1b2733", BLUE


def plane(axes: Axes, frames: Frames) -> Callable[[int], None]:
    """An arm in the plane, to scale."""
    draw_scene(axes, frames.criteria)
    left, right, bottom, top = frames.extent
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    axes.grid(alpha=0.3)
    tip_path = axes.plot([], [], color=WAY, linewidth=2.0)[0]
    arm = axes.plot([], [], "-o", color=ARM, markerfacecolor="white", linewidth=2.2, zorder=5)[0]
    robot = frames.criteria.robot
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
    scene, robot = frames.scene, frames.criteria.robot
    bounds = scene.bounds(frames.theta)
    view = scene.view(frames.theta, bounds)
    picture = draw_picture(axes, view, scene, Posture("", ARM, frames.theta[0]), bounds)
    draw_ways(axes, [view.project(course.middles) for course in frames.courses])
    tip_path = axes.plot([], [], color=WAY, linewidth=2.0, zorder=3)[0]

    def show(index: int) -> None:
        tools = [frames.joints[: index + 1, stroke][:, -1] for stroke in robot.strokes]
        tip_path.set_data(*view.project(parted(tools)).T)
        picture.arm.set_data(*view.project(in_strokes(robot, frames.joints[index])).T)
        picture.painting.show(frames.theta[index], float(frames.times[index]))

    return show


STAGES = {2: plane, 3: space}  # by the robot's dimensions


FILM_SECONDS = 4.0  # whatever the motion takes: most last less than a second
REST_SHARE = 0.2  # of the frames: how long the film rests at its last posture
DPI = 100
ENCODER_SECONDS = 120.0  # after which ffmpeg is stopped; it needs one


class Encoder(FFMpegWriter):
    """ffmpeg, which is stopped when it takes too long; whatever is wrong with it is an OSError."""

    _proc: subprocess.Popen[bytes]  # of matplotlib, whose types do not know it

    def setup(self, *args: Any, **kwargs: Any) -> None:
        """Start writing the film."""
        super().setup(*args, **kwargs)
        self._watchdog = Timer(ENCODER_SECONDS, self._proc.kill)
        self._watchdog.daemon = True
        self._watchdog.start()

    def finish(self) -> None:
        """Wait until it is done."""
        _, said = self._proc.communicate()
        self._watchdog.cancel()
        if self._proc.returncode != 0 or not Path(self.outfile).stat().st_size:
            reason = said.decode(errors="replace").strip().rpartition("\n")[2]
            raise OSError(errno.EIO, f"ffmpeg failed: {reason or self._proc.returncode}")


def save_film(path: Path, title: str, frames: Frames, ffmpeg: str | None) -> None:
    """Draw frame after frame into a file whose suffix is .gif or .mp4.

    Raises:
        OSError: it cannot be written.
    """
    count = len(frames.times)
    rate = round(count / FILM_SECONDS)
    writer: AbstractMovieWriter = PillowWriter(rate)
    if path.suffix == ".mp4":
        writer = Encoder(rate, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.subplots()
    show = STAGES[frames.criteria.robot.dim](axes, frames)
    caption = axes.set_title(title, parse_math=False)
    with (
        warnings.catch_warnings(),
        mpl.rc_context({} if ffmpeg is None else {"animation.ffmpeg_path": ffmpeg}),
        writer.saving(figure, path, DPI),
    ):
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)  # of a title in another script
        lay_out(figure)  # once, not in every frame
        for index in [*range(count), *[count - 1] * round(REST_SHARE * count)]:
            show(index)
            caption.set_text(f"{title}: t = {frames.times[index]:.3f} s")
            writer.grab_frame()

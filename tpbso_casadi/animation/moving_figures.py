"""A motion as a film: GIF by Pillow, MP4 by ffmpeg.

Imported only where a film is made: matplotlib is slow to load.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.scene import draw_scene

FILM_SECONDS = 4.0  # whatever the motion takes: most last less than a second
REST_SHARE = 0.2  # of the frames: how long the film rests at its last posture
DPI = 100


def save_film(path: Path, title: str, frames: Frames, ffmpeg: str | None) -> None:
    """Draw frame after frame into a file whose suffix is .gif or .mp4.

    Raises:
        OSError: it cannot be written.
    """
    count = len(frames.times)
    rate = round(count / FILM_SECONDS)
    writer: AbstractMovieWriter = PillowWriter(rate)
    if path.suffix == ".mp4":
        writer = FFMpegWriter(rate, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.subplots()
    draw_scene(axes, frames.problem)
    left, right, bottom, top = frames.extent
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    axes.grid(alpha=0.3)
    tip_path = axes.plot([], [], color="#1f4fd8", linewidth=2.0)[0]
    arm = axes.plot([], [], "-o", color="#1b2733", markerfacecolor="white", linewidth=2.2, zorder=5)[0]
    caption = axes.set_title(title)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, not in every frame
    with mpl.rc_context({} if ffmpeg is None else {"animation.ffmpeg_path": ffmpeg}), writer.saving(figure, path, DPI):
        for index in [*range(count), *[count - 1] * round(REST_SHARE * count)]:
            tip_path.set_data(*frames.joints[: index + 1, -1].T)
            arm.set_data(*frames.joints[index].T)
            caption.set_text(f"{title}: t = {frames.times[index]:.3f} s")
            writer.grab_frame()

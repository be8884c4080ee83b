"""A motion as a film: GIF by Pillow, MP4 by ffmpeg.

Imported only where a film is made: matplotlib is slow to load.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.run import draw_task

SECONDS = 4.0  # that a film lasts, whatever the motion takes: most would be over in a blink
LAST = 0.2  # of the frames: how long it stays at the end
DPI = 100


def save_film(path: Path, title: str, frames: Frames, ffmpeg: str | None) -> None:
    """Draw frame after frame into a file whose suffix is .gif or .mp4.

    Raises:
        OSError: it cannot be written.
    """
    count = len(frames.times)
    rate = round(count / SECONDS)
    writer: AbstractMovieWriter = PillowWriter(rate)
    if path.suffix == ".mp4":
        writer = FFMpegWriter(rate, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
    figure = Figure(figsize=(6.0, 6.0), layout="constrained")
    axes = figure.subplots()
    draw_task(axes, frames.problem)
    left, right, bottom, top = frames.extent
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top), xlabel="x [m]", ylabel="y [m]")
    axes.grid(alpha=0.3)
    way = axes.plot([], [], color="#1f4fd8", linewidth=2.0)[0]
    arm = axes.plot([], [], "-o", color="#1b2733", markerfacecolor="white", linewidth=2.2, zorder=5)[0]
    words = axes.set_title(title)
    figure.draw_without_rendering()
    figure.set_layout_engine("none")  # laid out once, not in every frame
    with mpl.rc_context({} if ffmpeg is None else {"animation.ffmpeg_path": ffmpeg}), writer.saving(figure, path, DPI):
        for shown in [*range(count), *[count - 1] * round(LAST * count)]:
            way.set_data(*frames.joints[: shown + 1, -1].T)
            arm.set_data(*frames.joints[shown].T)
            words.set_text(f"{title}: t = {frames.times[shown]:.3f} s")
            writer.grab_frame()

"""A motion as a film: GIF by Pillow, MP4 by ffmpeg.

Imported only where a film is made: matplotlib is slow to load.
"""

from __future__ import annotations

import errno
import subprocess
import warnings
from pathlib import Path
from threading import Timer
from typing import Any

import matplotlib as mpl
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.figure import Figure

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.animation.stage_figures import STAGES

FILM_SECONDS = 4.0  # whatever the motion takes: most last less than a second
REST_SHARE = 0.2  # of the frames: how long the film rests at its last posture
DPI = 100
ENCODER_SECONDS = 120.0  # after which ffmpeg is stopped; it needs one


class Encoder(FFMpegWriter):
    """ffmpeg, which is stopped when it takes too long; whatever is wrong with it is an OSError."""

    _proc: subprocess.Popen[bytes]  # of matplotlib, whose types do not know it

    def setup(self, *args: Any, **kwargs: Any) -> None:
        """Start it."""
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
    show = STAGES[frames.problem.robot.dim](axes, frames)
    caption = axes.set_title(title, parse_math=False)
    with (
        warnings.catch_warnings(),
        mpl.rc_context({} if ffmpeg is None else {"animation.ffmpeg_path": ffmpeg}),
        writer.saving(figure, path, DPI),
    ):
        warnings.filterwarnings("ignore", message="Glyph", category=UserWarning)  # of a title in another script
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # laid out once, not in every frame
        for index in [*range(count), *[count - 1] * round(REST_SHARE * count)]:
            show(index)
            caption.set_text(f"{title}: t = {frames.times[index]:.3f} s")
            writer.grab_frame()

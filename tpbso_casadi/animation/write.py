"""Which animation a file name asks for."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from shutil import which

from tpbso_casadi.animation.frames import frames_of, judged_frames
from tpbso_casadi.animation.player import page
from tpbso_casadi.plain import visible
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.storage import OutputError, check_file, check_writable, write_text, write_with, writing

FILM_FRAMES = 81  # each takes some 50 ms to draw
SUFFIXES = (".gif", ".mp4", ".html")


def check_animation(path: Path) -> None:
    """Make sure before the search that the animation can be written.

    Raises:
        OutputError: an unknown suffix, no ffmpeg for an MP4, or a file that cannot be written.
    """
    if path.suffix not in SUFFIXES:
        raise OutputError(f"--animate {path}: the name must end with {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    if path.suffix == ".mp4" and ffmpeg() is None:
        raise OutputError(f"--animate {path}: needs ffmpeg: install it, or pip install 'tpbso-casadi[video]'")
    check_writable(path.parent)
    check_file(path)


def ffmpeg() -> str | None:
    """The path of ffmpeg: the system's, else that of the package imageio-ffmpeg; None where there is neither."""
    if which("ffmpeg") is not None or find_spec("imageio_ffmpeg") is None:
        return which("ffmpeg")
    from imageio_ffmpeg import get_ffmpeg_exe  # noqa: PLC0415 (optional)

    try:
        return str(get_ffmpeg_exe())
    except (OSError, RuntimeError):  # the package without its program
        return None


def animate(path: Path, title: str, motion: JudgedMotion) -> None:
    """Write a motion as GIF, MP4 or HTML.

    Args:
        path: whose suffix decides.
        title: any text; what is not printable is shown escaped.
        motion: to be shown.

    Raises:
        OutputError: it cannot be written.
    """
    without = motion.criteria.assumed
    title = visible(f"{title}, {without}" if without else title)
    with writing(path.parent):
        if path.suffix == ".html":
            write_text(path, lambda file: file.write(page(title, judged_frames(motion))))
            return
        from tpbso_casadi.animation.moving_figures import save_film  # noqa: PLC0415 (matplotlib is slow to load)

        write_with(path, lambda temporary: save_film(temporary, title, frames_of(motion, FILM_FRAMES), ffmpeg()))

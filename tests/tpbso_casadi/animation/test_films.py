"""Films of a motion, made for real; what is refused before a search."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from helpers.moving_plans import IN_PLANE, moving_space_plan, plane_plan
from PIL import Image, ImageSequence

from tpbso_casadi.animation import moving_figures
from tpbso_casadi.animation import write as writing
from tpbso_casadi.animation.write import animate
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.storage import OutputError

QUICK = ["time-2", "--evaluations", "100", "--no-plots", "--quiet"]


TITLES = ["字 🦾\udcff\x1b[31m\n", "$\\frac[red]</title><script>"]


@pytest.mark.process
def test_a_film_of_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "FILM_FRAMES", 5)
    animate(tmp_path / "way.mp4", "way", plane_plan().motion)
    ffmpeg = writing.ffmpeg()
    assert ffmpeg is not None
    command = [ffmpeg, "-i", str(tmp_path / "way.mp4"), "-f", "null", "-"]
    checked = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "Video: h264" in checked.stderr and "yuv420p" in checked.stderr


@pytest.mark.usefixtures("in_an_empty_folder")
@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--animate", "way.avi"], "--animate way.avi: the name must end with .gif, .mp4 or .html"),
        (["--animate", "way.mp4"], "needs ffmpeg: install it, or pip install 'tpbso-casadi[video]'"),
        (["--animate", "file/way.gif"], "file: file is a file, not a folder"),
        (["--json", "--export", "csv"], "--export: needs a run folder; say --out DIR too"),
        (["--export", "xml"], "argument --export: invalid choice: 'xml'"),
        (["--rate", "0"], "argument --rate: 0 is not a positive number"),
        (["--rate", "1e6"], "argument --rate: 1e6 is not a positive number from 1e-12 to 10000"),
        (["--rate", "fast"], "argument --rate: a number is needed, not 'fast'"),
        (["--animate", "folder.gif"], "folder.gif: is a folder, and would be replaced"),
        (["--animate", "pipe.html"], "pipe.html: is no regular file, and would be replaced"),
        (["--animate", "a" * 300 + ".gif"], "cannot be written: File name too long"),
        (["--animate", ""], "argument --animate: a path is needed, not ''"),
        (["--animate", "nowhere/way.gif"], "nowhere is a file, not a folder"),
        (["--out", "nowhere"], "nowhere is a file, not a folder"),
        (["--out", "a" * 5000], "cannot be written: File name too long"),
    ],
)
def test_bad_input(
    arguments: list[str], expected: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(writing, "ffmpeg", lambda: None)
    Path("file").touch()
    Path("folder.gif").mkdir()
    os.mkfifo("pipe.html")
    Path("nowhere").symlink_to("nothing")
    with pytest.raises(SystemExit) as end:
        sys.exit(main([*QUICK, *arguments]))
    assert end.value.code == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1
    assert expected in error
    assert sorted(path.name for path in Path().iterdir()) == ["file", "folder.gif", "nowhere", "pipe.html"]


@pytest.mark.process
@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("exit 1", "ffmpeg failed: 1"),
        ("echo no such codec >&2; exit 3", "ffmpeg failed: no such codec"),
        ("cat > /dev/null", "ffmpeg failed: 0"),  # and no film
        ("exec sleep 60", "ffmpeg failed: -9"),
    ],
)
def test_an_ffmpeg_that_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, reason: str) -> None:
    encoder = tmp_path / "ffmpeg"
    encoder.write_text(f"#!/bin/sh\n{script}\n")
    encoder.chmod(0o755)
    monkeypatch.setattr(writing, "ffmpeg", lambda: str(encoder))
    monkeypatch.setattr(writing, "FILM_FRAMES", 4)
    monkeypatch.setattr(moving_figures, "ENCODER_SECONDS", 2.0 if "sleep" in script else 60.0)
    with pytest.raises(OutputError, match=reason):
        animate(tmp_path / "way.mp4", "title", plane_plan().motion)
    assert not (tmp_path / "way.mp4").exists()


def reds(image: Image.Image) -> np.ndarray:
    """Where an obstacle that stands in front of nothing is seen: columns of its pixels."""
    colours = np.asarray(image.convert("RGB"), dtype=np.int64)
    red = (colours[..., 0] > 180) & (colours[..., 0] - colours[..., 1:].max(axis=2) > 40)
    return np.flatnonzero(red.any(axis=0))


@pytest.mark.parametrize(
    ("plan", "title"), [(lambda: plane_plan(IN_PLANE[1]), TITLES[0]), (moving_space_plan, TITLES[1])]
)
def test_arm_and_obstacles_move_in_films_of_any_title(
    plan: Callable[[], PlannedMotion], title: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "FILM_FRAMES", 4)
    for name in ("film.gif", "film.html"):
        animate(tmp_path / name, title, plan().motion)
    assert "</title><script>" not in (tmp_path / "film.html").read_text(encoding="utf-8")
    with Image.open(tmp_path / "film.gif") as film:
        images = [frame.convert("RGB") for frame in ImageSequence.Iterator(film)]
    first, last = reds(images[0]), reds(images[3])
    assert first.size and last.size
    assert abs(float(first.mean() - last.mean())) > 10.0
    one, other = (np.asarray(image, dtype=np.int64) for image in (images[0], images[3]))
    assert (np.abs(one - other).max(axis=2) > 100).sum() > 500  # the robot moves

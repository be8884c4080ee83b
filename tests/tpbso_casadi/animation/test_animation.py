"""Films, players and exports of a motion, made for real."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
import yaml
from helpers.browser import fetched, opened
from PIL import Image, ImageSequence

from tpbso_casadi import builtin
from tpbso_casadi.animation import moving_figures
from tpbso_casadi.animation import write as writing
from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player import page
from tpbso_casadi.animation.write import animate
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import SearchedMotion, plan
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.storage import EXPORTS, OutputError, export_motion, exporting
from tpbso_casadi.storage.exporting import ros_message

QUICK = ["--evaluations", "2000", "--no-plots", "--quiet"]


@pytest.fixture(scope="module", params=["time-3", "obstacle-3", "pentagram-time"])
def solution(request: pytest.FixtureRequest) -> SearchedMotion:
    content = builtin(request.param).model_dump()
    content["solver"] |= {"evaluations": 1000}
    content["model"] |= {"formulation": "reduced"}
    return plan(parse_scenario(content))


def run(*arguments: str) -> int:
    try:
        return int(main([*arguments]))
    except SystemExit as end:
        return int(end.code or 0)


def test_frames_are_the_arm(solution: SearchedMotion) -> None:
    frames = frames_of(solution.motion, 31)
    arm = solution.problem.robot
    assert frames.joints.shape == (31, arm.links + 1, 2)
    assert frames.times[0] == 0.0 and frames.duration == solution.trajectory.duration
    lengths = np.linalg.norm(np.diff(frames.joints, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.broadcast_to(arm.link_lengths, lengths.shape), atol=1e-12)
    first, last = frames.task_points[[0, -1]]
    assert np.linalg.norm(frames.joints[0, -1] - first) < 0.11
    assert np.linalg.norm(frames.joints[-1, -1] - last) < 0.11
    left, right, bottom, top = frames.extent
    assert (frames.joints[:, :, 0] > left).all() and (frames.joints[:, :, 0] < right).all()
    assert (frames.joints[:, :, 1] > bottom).all() and (frames.joints[:, :, 1] < top).all()


def test_the_player_runs_in_a_browser_and_fetches_nothing(solution: SearchedMotion, tmp_path: Path) -> None:
    text = page("a <b>&</b> b", frames_of(solution.motion))
    assert fetched(text) == []
    path = tmp_path / "page.html"
    path.write_text(text)
    document = opened(path, tmp_path / "profile")
    assert "<title>a &lt;b&gt;" in document
    assert re.search(r">\d\.\d{3} s</output>", document)  # it plays
    assert ">Pause</button>" in document


def test_films(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(writing, "FILM_FRAMES", 11)
    for name in ("way.gif", "below/way.mp4", "way.html"):
        assert run("time-2", *QUICK, "--animate", name) == 0
    with Image.open("way.gif") as film:
        images = [np.asarray(frame.convert("RGB"), dtype=np.int64) for frame in ImageSequence.Iterator(film)]
    assert len(images) >= 11
    assert np.abs(images[0] - images[8]).max() > 100  # it moves
    ffmpeg = writing.ffmpeg()
    assert ffmpeg is not None
    command = [ffmpeg, "-i", "below/way.mp4", "-f", "null", "-"]
    checked = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "Video: h264" in checked.stderr and "yuv420p" in checked.stderr


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--animate", "way.avi"], "--animate way.avi: the name must end with .gif, .mp4 or .html"),
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
    arguments: list[str],
    expected: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("folder.gif").mkdir()
    os.mkfifo("pipe.html")
    Path("nowhere").symlink_to("nothing")
    assert run("time-2", *QUICK, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.count("\n") == 1
    assert expected in error
    assert sorted(path.name for path in Path().iterdir()) == ["file", "folder.gif", "nowhere", "pipe.html"]


def test_an_mp4_without_ffmpeg(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(writing, "which", lambda name: None)
    monkeypatch.setattr(writing, "find_spec", lambda name: None)
    assert run("time-2", *QUICK, "--animate", "way.mp4") == 2
    assert "needs ffmpeg: install it, or pip install 'tpbso-casadi[video]'" in capsys.readouterr().err


@pytest.mark.parametrize("solution", ["time-3"], indirect=True)
@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("exit 1", "ffmpeg failed: 1"),
        ("echo no such codec >&2; exit 3", "ffmpeg failed: no such codec"),
        ("cat > /dev/null", "ffmpeg failed: 0"),  # and no film
        ("sleep 60", "ffmpeg failed: -9"),
    ],
)
def test_an_ffmpeg_that_fails(
    solution: SearchedMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, script: str, reason: str
) -> None:
    encoder = tmp_path / "ffmpeg"
    encoder.write_text(f"#!/bin/sh\n{script.replace('sleep', 'exec sleep')}\n")
    encoder.chmod(0o755)
    monkeypatch.setattr(writing, "ffmpeg", lambda: str(encoder))
    monkeypatch.setattr(writing, "FILM_FRAMES", 8)
    monkeypatch.setattr(moving_figures, "ENCODER_SECONDS", 2.0 if "sleep" in script else 60.0)
    with pytest.raises(OutputError, match=reason):
        animate(tmp_path / "way.mp4", "title", solution.motion)
    assert not (tmp_path / "way.mp4").exists()


@pytest.mark.parametrize("solution", ["time-3"], indirect=True)
@pytest.mark.parametrize("title", ["$\\frac", "字 🦾", "\udcff\x1b[31m\n", "[red]</title><script>"])
def test_any_name_may_be_a_title(
    solution: SearchedMotion, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, title: str
) -> None:
    monkeypatch.setattr(writing, "FILM_FRAMES", 4)
    for name in ("way.gif", "way.html"):
        animate(tmp_path / name, title, solution.motion)
    assert "[red]</title><script>" not in (tmp_path / "way.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("solution", ["time-3"], indirect=True)
def test_no_export_of_millions_of_rows(solution: SearchedMotion, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"--rate 1e\+09: makes more than 200000 rows of a motion of .* s; at most"):
        export_motion(tmp_path, solution.motion, "csv", 1e9)
    assert not list(tmp_path.iterdir())


def test_an_export_of_too_many_rows_does_not_lose_the_plan(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exporting, "MOST_ROWS", 50)
    assert run("time-2", *QUICK, "--out", "out", "--export", "csv") == 2
    error = capsys.readouterr().err
    assert error.startswith(
        "error: out: the run is written, but not all of its files: --rate 100: makes more than 50 rows"
    )
    assert sorted(path.name for path in Path("out").iterdir()) == ["result.json", "trajectory.csv"]


@pytest.mark.parametrize("rate", [37.0, 100.0])
def test_every_export_holds_the_same_motion(solution: SearchedMotion, tmp_path: Path, rate: float) -> None:
    paths = {kind: export_motion(tmp_path, solution.motion, kind, rate) for kind in EXPORTS}
    table_path, arrays_path = paths["csv"], paths["npz"]
    message = json.loads(paths["ros-json"].read_text())
    assert yaml.safe_load(paths["ros-yaml"].read_text()) == message
    arrays = np.load(arrays_path)
    with table_path.open(newline="") as file:
        header, *rows = csv.reader(file)
    table = np.array(rows, dtype=np.float64)
    links = solution.problem.robot.dof
    times = arrays["t"]
    assert header[0] == "t" and header[-2:] == ["x", "y"]
    np.testing.assert_allclose(np.diff(times)[:-1], 1.0 / rate, rtol=1e-9)
    assert 0.0 < np.diff(times)[-1] <= 1.0 / rate * (1.0 + 1e-9)
    assert times[0] == 0.0 and times[-1] == solution.trajectory.duration
    parts = [times[:, None], arrays["q"], arrays["qd"], arrays["qdd"], arrays["tip"]]
    np.testing.assert_array_equal(table, np.hstack(parts))
    assert message["joint_names"] == [f"joint_{joint + 1}" for joint in range(links)]
    for key, name in (("positions", "q"), ("velocities", "qd"), ("accelerations", "qdd")):
        np.testing.assert_array_equal([point[key] for point in message["points"]], arrays[name])
    stamps = [point["time_from_start"] for point in message["points"]]
    np.testing.assert_allclose([s["sec"] + s["nanosec"] * 1e-9 for s in stamps], times, atol=1e-9)
    assert all(0 <= s["nanosec"] < 1_000_000_000 for s in stamps)
    assert set(message) == {"header", "joint_names", "points"}
    np.testing.assert_array_equal(arrays["coefficients"], solution.trajectory.coefficients)


def test_stamps_increase_in_a_ros_message(solution: SearchedMotion) -> None:
    times = np.array([0.0, 0.9999999999, 1.0000000006])
    stamps = [point["time_from_start"] for point in ros_message(solution.motion, times)["points"]]
    assert stamps == [{"sec": 0, "nanosec": 0}, {"sec": 1, "nanosec": 0}, {"sec": 1, "nanosec": 1}]

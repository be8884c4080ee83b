"""Ctrl-C, SIGTERM, kill -9 and full disks at any moment of ``solve``: the run folder holds one run, complete."""

from __future__ import annotations

import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal
from helpers.scenes import SWING, TWO_LINKS, toml

from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import JudgedMotion
from tpbso_casadi.storage import read_run
from tpbso_casadi.storage.motion_tables import write_motion

process = pytest.mark.process
pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

ANNOUNCING = """
from tpbso_casadi.cli import entry, progress
progress.INTERVAL = -1.0
entry.run("tpbso_casadi.cli.commands.solve")
"""  # the command line, which says at once what it begins
COMMAND = ["obstacle-3", "--evaluations", "3000", "--seed", "2", "--polish-starts", "4", "--animate", "arm.gif"]
FOLDER = Path("out")
QUICK = ["time-2", "--evaluations", "500", "--no-plots", "--quiet", "--out", str(FOLDER)]


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def old() -> dict[str, bytes]:
    """The files of an earlier run in the folder."""
    main([*QUICK, "--export", "npz"])
    return contents(FOLDER)


def started(phase: str, *arguments: str, **options: Any) -> subprocess.Popen[str]:
    """The command, at the moment when it has begun a phase."""
    command = [sys.executable, "-c", ANNOUNCING, *COMMAND, "--out", str(FOLDER), *arguments]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, **options)
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith(phase):
            return process
    raise AssertionError(f"no phase {phase}")


def ctrl_c(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGINT)


def three_ctrl_c(process: subprocess.Popen[str]) -> None:
    for _ in range(3):
        process.send_signal(signal.SIGINT)
        time.sleep(0.02)  # as a finger does; nothing waits for it


def sigterm(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGTERM)


@process
@pytest.mark.parametrize(
    ("phase", "stop"),
    [
        ("searching: ", ctrl_c),
        ("polishing", ctrl_c),
        pytest.param("polishing: ", sigterm, marks=pytest.mark.slow),
        ("writing", ctrl_c),
        pytest.param("filming", three_ctrl_c, marks=pytest.mark.slow),
    ],
)
def test_from_the_first_candidate_on_there_is_a_plan(
    phase: str, stop: Callable[[subprocess.Popen[str]], None], old: dict[str, bytes]
) -> None:
    with started(phase) as process:
        stop(process)
        _, errors = process.communicate(timeout=120.0)
    assert process.returncode == 130
    assert errors.splitlines()[-1].startswith("error: interrupted; the best ")
    assert errors.splitlines()[-1].endswith(" is in out")
    assert "Traceback" not in errors and "Exception" not in errors
    run = read_run(FOLDER)
    assert run.scenario.solver.seed == 2
    assert run.result.interrupted == (phase.partition(":")[0] in ("searching", "polishing"))
    assert "joint_trajectory.npz" in old and not (FOLDER / "joint_trajectory.npz").exists()
    assert {path.name for path in Path().iterdir()} <= {"out", "arm.gif"}


@process
@pytest.mark.parametrize("phase", ["searching: ", pytest.param("polishing: ", marks=pytest.mark.slow)])
def test_sigterm_is_handled_where_ctrl_c_is_ignored(phase: str) -> None:
    def ignore_ctrl_c() -> None:  # as shells do with what runs in the background
        signal.signal(signal.SIGINT, signal.SIG_IGN)

    with started(phase, preexec_fn=ignore_ctrl_c) as process:
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=120.0)
    assert process.returncode == 130
    assert errors.splitlines()[-1].endswith(" is in out")
    assert read_run(FOLDER).result.interrupted


def test_what_comes_into_the_folder_meanwhile_is_not_lost(
    old: dict[str, bytes], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def somebody_writes(folder: Path, title: str, motion: object) -> None:
        (FOLDER / "thesis.tex").write_text("mine")

    monkeypatch.setattr("tpbso_casadi.animation.write.animate", somebody_writes)
    assert main([*QUICK, "--animate", "out/arm.gif"]) == 2
    assert "out: holds thesis.tex, which is not of a run" in capfd.readouterr().err
    (FOLDER / "thesis.tex").unlink()  # beside the plan, which had been written before
    assert sorted(contents(FOLDER)) == ["result.json", "trajectory.csv"]
    assert read_run(FOLDER).scenario.solver.evaluations == 500
    assert [path.name for path in Path().iterdir()] == ["out"]


def test_the_plan_is_written_and_printed_before_it_is_drawn(
    old: dict[str, bytes], monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    seen: list[tuple[list[str], str]] = []

    def look(film: Path, title: str, motion: object) -> None:
        seen.append((sorted(contents(FOLDER)), capfd.readouterr().out))
        film.write_text("film")

    monkeypatch.setattr("tpbso_casadi.animation.write.animate", look)
    loud = [option for option in QUICK if option != "--quiet"]
    assert main([*loud, "--animate", "out/arm.gif"]) == 0
    ((files, printed),) = seen
    assert files == ["result.json", "trajectory.csv"] and "written to out" in printed
    assert sorted(contents(FOLDER)) == ["arm.gif", "result.json", "trajectory.csv"]
    assert set(read_run(FOLDER).result.files) == {"arm.gif", "trajectory.csv"}


INTERRUPTED_WHILE_MODELLING = """
import os, signal
from tpbso_casadi.cli import entry, progress

class Console(progress.OutputConsole):
    def print(self, *texts, **options):
        if texts == ("modelling",):
            os.kill(os.getpid(), signal.SIGINT)

progress.INTERVAL, progress.OutputConsole = -1.0, Console
entry.run("tpbso_casadi.cli.commands.solve")
"""


@process
def test_before_there_is_a_candidate_the_old_run_stays(old: dict[str, bytes]) -> None:
    command = [sys.executable, "-c", INTERRUPTED_WHILE_MODELLING, *COMMAND, "--out", str(FOLDER)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120.0)
    said = "error: interrupted before there was a plan; nothing was written\n"
    assert (done.returncode, done.stdout, done.stderr) == (130, "", said)
    assert contents(FOLDER) == old
    assert [path.name for path in Path().iterdir()] == ["out"]


@process
def test_nothing_but_a_line_while_modules_are_loaded() -> None:
    Path("slow.py").write_text("print('loading', flush=True)\nwhile True:\n    pass\n")
    command = [sys.executable, "-c", "from tpbso_casadi.cli.entry import run\nrun('slow')"]
    for number in (signal.SIGINT, signal.SIGTERM):
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            assert process.stdout.readline() == "loading\n"
            process.send_signal(number)
            _, errors = process.communicate(timeout=60.0)
        assert (process.returncode, errors) == (130, "error: interrupted\n")


@process
@pytest.mark.parametrize("phase", [pytest.param("polishing", marks=pytest.mark.slow), "writing"])
def test_a_killed_command_leaves_the_old_run(phase: str, old: dict[str, bytes]) -> None:
    with started(phase) as process:
        process.kill()
        process.communicate(timeout=60.0)
    assert contents(FOLDER) == old
    assert main(QUICK) in (0, 1)
    assert [path.name for path in Path().iterdir()] == ["out"]  # what the killed one left is gone


@process
def test_a_full_disk_leaves_the_old_run(old: dict[str, bytes]) -> None:
    limited = subprocess.run(
        [sys.executable, "-m", "tpbso_casadi.solve", "time-3", "--evaluations", "500", "--out", str(FOLDER)],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096)),
        env={**os.environ, "TPBSO_CASADI_BACKEND": "vm"},
    )
    assert limited.returncode == 2
    assert limited.stderr == "error: out: cannot be written: File too large\n"
    assert contents(FOLDER) == old
    assert [path.name for path in Path().iterdir()] == ["out"]


STRANGERS = {
    "notes.txt": "mine",
    "path.png": "a picture of mine",
    "result.json": '{"my": "thesis", "files": {}, "seal": {}}',
}


def test_strangers_in_a_folder_and_a_run_that_was_changed_are_not_lost(capfd: pytest.CaptureFixture[str]) -> None:
    FOLDER.mkdir()
    for name, content in STRANGERS.items():
        (FOLDER / name).write_text(content)
        assert f"out: holds {name}, which is not of a run" in refusal(capfd, main, *QUICK)
        (FOLDER / name).unlink()
    main([*QUICK, "--export", "npz"])
    old, table = contents(FOLDER), FOLDER / "trajectory.csv"
    table.write_text("with remarks of mine")
    assert refusal(capfd, main, *QUICK)
    table.unlink()
    table.mkdir()
    assert refusal(capfd, main, *QUICK)
    assert (FOLDER / "joint_trajectory.npz").read_bytes() == old["joint_trajectory.npz"]


def at_speed(speed: float) -> str:
    return toml(arm=TWO_LINKS | {"max_speed": speed}, task=SWING)


def test_a_plan_that_took_the_name_meanwhile_is_not_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    quick = ["--evaluations", "500", "--no-plots", "--quiet"]
    written: list[Path] = []

    def other_plan_comes(path: Path, motion: JudgedMotion, times: np.ndarray) -> None:
        written.append(path)
        write_motion(path, motion, times)
        if len(written) == 1:
            Path("mine.toml").write_text(at_speed(5.0))
            main(["mine.toml", *quick])
            Path("mine.toml").write_text(at_speed(4.0))

    Path("mine.toml").write_text(at_speed(4.0))
    monkeypatch.setattr("tpbso_casadi.storage.run_folder.write_motion", other_plan_comes)
    assert main(["mine.toml", *quick]) == 0
    speeds = {path.name: read_run(path).scenario.arm.max_speed for path in Path("runs").iterdir()}  # type: ignore[union-attr]
    assert speeds == {"mine-abso-1-500-evaluations": 5.0, "mine-abso-1-500-evaluations-2": 4.0}


def moments(count: int, longest: float) -> Iterator[float]:
    """Random times in s, the same in each test run."""
    return iter(np.random.default_rng(1).uniform(0.0, longest, count))


@process
@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_hundred_interruptions_at_random_moments(number: signal.Signals, old: dict[str, bytes]) -> None:
    command = [sys.executable, "-m", "tpbso_casadi.solve", *COMMAND, "--out", str(FOLDER)]
    began = time.monotonic()
    subprocess.run(command, check=False, capture_output=True)
    for moment in moments(100, time.monotonic() - began):
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
            time.sleep(moment)  # any moment will do
            process.send_signal(number)
            _, errors = process.communicate(timeout=120.0)
        assert "Traceback" not in errors and "Exception" not in errors, errors
        assert errors.count("\n") <= 1
        assert number is signal.SIGKILL or process.returncode in (0, 130)
        read_run(FOLDER)

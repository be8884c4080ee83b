"""The tutorials, followed to the letter: every cell and every command, in order, in an empty folder."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

ROOT = Path(__file__).parent.parent.parent
TUTORIALS = ROOT / "docs" / "tutorials"
PAGES = sorted(path.stem for path in TUTORIALS.glob("*.md") if path.stem != "index")
BLOCK = re.compile(r"^```(\{code-cell\} ipython3|console)\n(.*?)^```", flags=re.M | re.S)
SETUP = "import matplotlib\nmatplotlib.use('agg')\n"


def program_of(page: str) -> str:
    """One script: cells as they are, commands as calls of the command line; installing is done already."""
    parts = [SETUP]
    for kind, text in BLOCK.findall(page):
        if kind == "console":
            commands = [line.removeprefix("$ ") for line in text.splitlines() if line.startswith("$ ")]
            parts += [f"_run({command!r})" for command in commands if not command.startswith("pip ")]
        else:
            parts.append(text)
    return "\n".join(parts)


RUNNER = """
import shlex, subprocess, sys
def _run(command):
    program, *arguments = shlex.split(command)
    assert program == "tpbso", command
    print("$", command)
    done = subprocess.run([sys.executable, "-m", "tpbso_casadi", *arguments], capture_output=True, text=True)
    print(done.stdout)
    assert done.returncode == 0, done.stderr
"""


def followed(name: str, folder: Path) -> str:
    """What following a tutorial prints."""
    script = folder / "followed.py"
    script.write_text(RUNNER + program_of((TUTORIALS / f"{name}.md").read_text()))
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, script.name], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr
    return done.stdout


def test_there_are_eight() -> None:
    index = (TUTORIALS / "index.md").read_text()
    assert len(PAGES) == 8 and all(f"\n{name}\n" in index for name in PAGES)


def test_every_block_is_a_cell_or_a_command() -> None:
    for name in PAGES:
        page = (TUTORIALS / f"{name}.md").read_text()
        assert len(BLOCK.findall(page)) == page.count("\n```") // 2 > 5, name


@pytest.mark.process
def test_the_first_plan_can_be_followed(tmp_path: Path) -> None:
    assert followed("first-plan", tmp_path).count("certified") >= 10
    runs = [tmp_path / name / "trajectory.csv" for name in ("first-plan", "rock")]
    assert runs[0].read_bytes() == runs[1].read_bytes()  # from Python and from a shell


def result_in(folder: Path) -> dict[str, Any]:
    result: dict[str, Any] = json.loads((folder / "result.json").read_text())
    assert result["feasible"] and result["certificate"]["verdict"] == "certified"
    return result


@pytest.mark.process
def test_a_cell_is_certified_stage_by_stage(tmp_path: Path) -> None:
    printed = followed("pick-and-place", tmp_path)
    assert len(re.findall(r"^stage \d+ \((?:move|line)\) .* certified$", printed, flags=re.M)) == 7
    assert "gripper,close" in printed
    assert result_in(tmp_path / "cell")["stages"][4]["kind"] == "attach"


@pytest.mark.process
@pytest.mark.slow
def test_a_robot_is_placed(tmp_path: Path) -> None:
    printed = followed("place-the-robot", tmp_path)
    [row] = re.findall(r"^(\S+) s certified, (\S+) s in the search; pedestal: .*; tray: .*$", printed, flags=re.M)
    certified, searched = map(float, row)
    stated = float(re.findall(r"^as it stands: (\S+) s$", printed, flags=re.M)[0])
    assert certified < 0.9 * stated and certified == pytest.approx(searched, rel=0.05)
    folder = tmp_path / "cell-layout"
    assert result_in(folder / "best")["stages"][1]["kind"] == "attach"
    assert len((folder / "evaluations.jsonl").read_text().splitlines()) == 1 + 60
    assert "certified in" in printed


@pytest.mark.process
@pytest.mark.slow
def test_a_bar_is_handed_over(tmp_path: Path) -> None:
    printed = followed("hand-over", tmp_path)
    assert "accepted: 7 motions of 12 joints" in printed and "1 ms late is up to" in printed
    assert {path.name for path in (tmp_path / "hand-over").iterdir()} >= {"joint_trajectory_left.json"}


@pytest.mark.process
@pytest.mark.slow
def test_glue_flows_along_the_edge(tmp_path: Path) -> None:
    printed = followed("glue", tmp_path)
    assert len(re.findall(r"^(?:path accuracy|angular accuracy|tool speed).*certified", printed, flags=re.M)) == 3
    assert re.search(r"^stages\[1\] goal: the tool cannot be led to", printed, flags=re.M)


@pytest.mark.process
@pytest.mark.slow
def test_an_arm_of_ones_own_moves_over_the_wall(tmp_path: Path) -> None:
    printed = followed("own-arm", tmp_path)
    names = re.findall(r'<joint name="(\w+)" type="revolute">', (tmp_path / "arm.urdf").read_text())
    assert len(names) == 5
    for folder in ("over-the-wall", "wall"):
        result_in(tmp_path / folder)
        message = yaml.safe_load((tmp_path / folder / "joint_trajectory.yaml").read_text())
        assert message["joint_names"] == names
        ends = np.array([message["points"][place]["positions"] for place in (0, -1)])
        assert ends == pytest.approx(np.array([[-0.9, 0.35, 1.3, 0.9, 0.0], [0.9, 0.35, 1.3, 0.9, 0.0]]), abs=1e-6)
    assert all(f"{limit} " in printed for limit in ("clearance", "self clearance", "torque", *names))
    runs = [tmp_path / name / "trajectory.csv" for name in ("over-the-wall", "wall")]
    assert runs[0].read_bytes() == runs[1].read_bytes()  # from Python and from a shell
    assert all((tmp_path / name).exists() for name in ("over-the-wall.html", "wall.html"))


@pytest.mark.process
@pytest.mark.slow
def test_a_solver_of_ones_own_is_compared(tmp_path: Path) -> None:
    printed = followed("own-solver", tmp_path)
    [cost] = map(float, re.findall(r"^\[[\d. ]+\] (\S+) evaluations$", printed, flags=re.M))
    assert cost < 1e-4
    assert result_in(tmp_path / "climbed")["solver"]["name"] == "climbing:Climbing"
    with (tmp_path / "climbing" / "summary.csv").open() as table:
        found = {(row["case"], row["solver"]): row["against_first"] for row in csv.DictReader(table)}
    assert len(found) == 2 * 5
    for case in ("time-3", "obstacle-3"):  # as the tutorial says
        assert found[case, "abso"] == "better"
        assert found[case, "climbing:Climbing"] == "no difference shown"
    page = (tmp_path / "climbing" / "comparison.html").read_text()
    assert all(solver in page for _, solver in found)


@pytest.mark.process
@pytest.mark.slow
def test_a_certificate_names_the_motor(tmp_path: Path) -> None:
    printed = followed("certificate", tmp_path)
    result_in(tmp_path / "shelf")
    [per_torque] = map(float, re.findall(r"ms saved, ([\d.]+) ms per N m", printed))
    assert 2.0 < per_torque < 8.0  # "some five milliseconds"
    durations = [float(seconds) for seconds in re.findall(r"^ *\d+ N m: ([\d.]+) s$", printed, flags=re.M)]
    assert len(durations) == 4
    assert durations == sorted(durations, reverse=True)
    assert len(set(durations)) == 4

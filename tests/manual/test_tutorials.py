"""The tutorials, followed to the letter: every cell and every command, in order, in an empty folder."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

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


def test_there_are_four() -> None:
    index = (TUTORIALS / "index.md").read_text()
    assert len(PAGES) == 4 and all(f"\n{name}\n" in index for name in PAGES)


@pytest.mark.parametrize("name", PAGES)
def test_every_block_is_a_cell_or_a_command(name: str) -> None:
    page = (TUTORIALS / f"{name}.md").read_text()
    assert len(BLOCK.findall(page)) == page.count("\n```") // 2 > 5


def test_the_first_plan_can_be_followed(tmp_path: Path) -> None:
    assert followed("first-plan", tmp_path).count("certified") >= 10
    runs = [tmp_path / name / "trajectory.csv" for name in ("first-plan", "rock")]
    assert runs[0].read_bytes() == runs[1].read_bytes()  # from Python and from a shell


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "made"),
    [
        ("own-arm", "over-the-wall/joint_trajectory.yaml"),
        ("own-solver", "climbing/comparison.html"),
        ("certificate", "shelf/result.json"),
    ],
)
def test_the_others_can_be_followed(name: str, made: str, tmp_path: Path) -> None:
    followed(name, tmp_path)
    assert (tmp_path / made).exists()

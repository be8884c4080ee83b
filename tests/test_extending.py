"""The files of docs/explanation/architecture.md, each adding something of its own, used from the command line."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = (Path(__file__).parent.parent / "docs" / "explanation" / "architecture.md").read_text()
LONGEST_FILE = 40  # lines
FILES = dict(re.findall(r"`(\w+\.(?:py|toml))`:\n\n```\w+\n(.*?)```", PAGE, flags=re.S))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("extending")
    for name, text in FILES.items():
        (path / name).write_text(text)
    run(path, "solve", "lift.toml", "--polish", "--animate", "lift.gif", "--out", "run", "--quiet")
    return path


def run(folder: Path, command: str, *arguments: str) -> str:
    environment = os.environ | {"PYTHONPATH": str(folder), "TPBSO_CASADI_BACKEND": "vm"}
    module = [sys.executable, "-m", f"tpbso_casadi.{command}"]
    done = subprocess.run(
        [*module, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", FILES)
def test_each_is_a_short_file(name: str) -> None:
    assert len(FILES[name].splitlines()) < LONGEST_FILE


def test_all_kinds_are_there() -> None:
    assert set(FILES) == {"raised_arm.py", "floor.py", "effort.py", "lift.py", "random_walk.py", "lift.toml"}


def test_they_plan_polish_and_animate(folder: Path) -> None:
    result = json.loads((folder / "run" / "result.json").read_text())
    assert result["feasible"] and result["certificate"]["verdict"] == "certified"
    assert result["objective"]["name"] == "effort" and result["solver"]["name"] == "random_walk:RandomWalk"
    assert "floor" in [constraint["name"] for constraint in result["constraints"]]
    assert result["polish"]["after"]["objective"] < result["polish"]["before"]["objective"]
    header, first, *_ = (folder / "run" / "trajectory.csv").read_text().splitlines()
    row = dict(zip(header.split(","), map(float, first.split(",")), strict=True))
    assert (row["x"], row["y"]) == (pytest.approx(0.9), pytest.approx(0.1))
    assert (folder / "lift.gif").read_bytes()[:4] == b"GIF8"
    assert (folder / "run" / "path.png").exists()


def test_they_are_audited(folder: Path) -> None:
    audit = json.loads(run(folder, "audit", "run", "--json"))
    assert audit["certificate"]["verdict"] == "certified"
    structure = json.loads(run(folder, "audit", "lift.toml", "--json"))
    for model in ("search", "program"):
        assert "floor" in [constraint["name"] for constraint in structure[model]["constraints"]]


def test_they_are_compared(folder: Path) -> None:
    solvers = "random_walk:RandomWalk,bso+polish"
    arguments = ["--solvers", solvers, "--runs", "2", "--evaluations", "1000", "--out", "cmp", "--json", "--quiet"]
    rows = json.loads(run(folder, "compare", "lift.toml", *arguments))
    assert [(row["solver"], row["runs"], row["infeasible"], row["unit"]) for row in rows] == [
        ("random_walk:RandomWalk", 2, 0, "s"),
        ("bso+polish", 2, 0, "s"),
    ]
    assert rows[1]["mean"] < rows[0]["mean"]


def test_a_broken_floor_is_not_certified(folder: Path) -> None:
    low = (folder / "lift.toml").read_text().replace("start = [0.9, 0.1]", "start = [0.9, -0.3]")
    (folder / "low.toml").write_text(low)
    with pytest.raises(AssertionError, match=r"floor is -0\.3 m where -0\.1 is the limit"):
        run(folder, "solve", "low.toml", "--evaluations", "500", "--no-plots", "--out", "low", "--quiet")

"""The files of docs/explanation/architecture.md, each adding something of its own, used from the command line."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest

import tpbso_casadi as tp
from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.figures.path import path_figure

PAGE = (Path(__file__).parent.parent / "docs" / "explanation" / "architecture.md").read_text()
LONGEST_FILE = 40  # lines
FILES = dict(re.findall(r"`(\w+\.(?:py|toml))`:\n\n```\w+\n(.*?)```", PAGE, flags=re.S))
MODULES = {name.removesuffix(".py") for name in FILES if name.endswith(".py")}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """The working folder, on the path of modules, with the files and a run of their scenario."""
    path = tmp_path_factory.mktemp("extending")
    for name, text in FILES.items():
        (path / name).write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path)
        patch.syspath_prepend(str(path))
        patch.setenv("TPBSO_CASADI_BACKEND", "vm")
        patch.setattr("tpbso_casadi.figures.run.drawings_of", lambda plan: {"path": partial(path_figure, plan)})
        options = ["--polish", "--evaluations", "1000", "--animate", "lift.html", "--out", "run", "--quiet"]
        assert solve.main(["lift.toml", *options]) == 0
        yield path
        for name in MODULES & sys.modules.keys():
            del sys.modules[name]


def test_all_kinds_are_there_in_short_files() -> None:
    modules = {"raised_arm.py", "plane_capsule.py", "floor.py", "effort.py", "lift.py", "random_walk.py"}
    assert set(FILES) == {*modules, "lift.toml"}
    assert not {name for name, text in FILES.items() if len(text.splitlines()) >= LONGEST_FILE}


def test_they_plan_polish_and_animate(folder: Path) -> None:
    result = json.loads((folder / "run" / "result.json").read_text())
    assert result["feasible"] and result["certificate"]["verdict"] == "certified"
    assert result["objective"]["name"] == "effort" and result["solver"]["name"] == "random_walk:RandomWalk"
    assert {"floor", "clearance"} <= {constraint["name"] for constraint in result["constraints"]}
    assert result["polish"]["after"]["objective"] < result["polish"]["before"]["objective"]
    header, first, *_ = (folder / "run" / "trajectory.csv").read_text().splitlines()
    row = dict(zip(header.split(","), map(float, first.split(",")), strict=True))
    assert (row["x"], row["y"]) == (pytest.approx(0.9), pytest.approx(0.1))
    assert "lift" in (folder / "lift.html").read_text()
    assert (folder / "run" / "path.png").exists()


def test_they_are_audited(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main(["run", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["certificate"]["verdict"] == "certified"
    assert audit.main(["lift.toml", "--json"]) == 0
    structure = json.loads(capsys.readouterr().out)
    for model in ("search", "program"):
        assert "floor" in [constraint["name"] for constraint in structure[model]["constraints"]]


def test_a_task_is_stated_by_keywords(folder: Path) -> None:
    arm = tp.robot([0.6, 0.5, 0.4], max_speed=4.0, max_acceleration=20.0)
    plan = tp.plan(arm, kind="lift:Lift", start=(0.9, 0.1), height=0.6, solver="pso", evaluations=500)
    assert plan.certified and plan.scenario.task.kind == "lift:Lift"
    with pytest.raises(TypeError, match="there is no keyword 'heigth'; did you mean 'height'"):
        tp.plan(arm, kind="lift:Lift", start=(0.9, 0.1), heigth=0.6)


def test_a_broken_floor_is_not_certified(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    low = (folder / "lift.toml").read_text().replace("start = [0.9, 0.1]", "start = [0.9, -0.3]")
    (folder / "low.toml").write_text(low)
    assert solve.main(["low.toml", "--evaluations", "500", "--no-plots", "--out", "low", "--quiet"]) != 0
    assert "floor is -0.3 m where -0.1 is the limit" in capfd.readouterr().err


@pytest.mark.process
def test_they_are_compared(folder: Path) -> None:
    arguments = ["lift.toml", "--solvers", "random_walk:RandomWalk,pso+polish", "--runs", "2"]
    arguments += ["--evaluations", "5000", "--out", "cmp", "--json", "--quiet"]
    command = [sys.executable, "-m", "tpbso_casadi", "compare", *arguments]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), os.environ.get("PYTHONPATH", "")])}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    rows = json.loads(done.stdout)
    assert [(row["solver"], row["runs"], row["infeasible"], row["unit"]) for row in rows] == [
        ("random_walk:RandomWalk", 2, 0, "s"),
        ("pso+polish", 2, 0, "s"),
    ]
    assert rows[1]["mean"] < rows[0]["mean"]

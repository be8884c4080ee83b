"""What the README shows, run."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands.solve import main

README = (Path(__file__).parent.parent / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", README, flags=re.DOTALL)


def test_scenarios_are_scenarios() -> None:
    whole, task = blocks("toml")
    scenario = parse_scenario(tomllib.loads(whole))
    assert scenario.problem().robot.dof == 4
    assert scenario.solver.budget().evaluations == 30_000
    path = tomllib.loads(task) | {"arm": tomllib.loads(whole)["arm"]}
    path["task"]["points"] = [[1.0, 0.0], [1.0, 0.5], [0.5, 1.0]]
    assert parse_scenario(path).problem().robot.dof == 4


def test_the_example_from_python_runs(capsys: pytest.CaptureFixture[str]) -> None:
    usage, _ = blocks("python")
    exec(usage, {})
    value, feasible, duration = capsys.readouterr().out.split()
    assert (feasible, value) == ("True", duration)


def test_the_example_of_a_solver_plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _, solver = blocks("python")
    (tmp_path / "readme_walk.py").write_text(solver)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.chdir(tmp_path)
    arguments = [
        "rotation-2",
        "--solver",
        "readme_walk:RandomWalk",
        "--formulation",
        "reduced",
        "--no-plots",
        "--quiet",
    ]
    assert main(arguments) == 0
    assert Path("runs/rotation-2-RandomWalk-1-reduced/result.json").exists()

"""Plug-ins that raise, wherever they do: one line that names them, exit status 2, nothing half-written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.storage import sealed

MODULE = """
from dataclasses import dataclass
from typing import ClassVar

from problems import Constraint, Limit, PlanarArm
from pydantic import model_validator
from solvers import Solver
from tpbso_casadi.scenario.model import TaskSection


@dataclass(frozen=True)
class Raising(Limit):
    name: ClassVar[str] = "raising"

    @classmethod
    def for_robot(cls, robot, obstacles):
        return cls()

    def constraints_at(self, samples, margin=0.0):
        raise RuntimeError("no such\\nsensor")


@dataclass(frozen=True)
class Speed(Raising):
    name: ClassVar[str] = "speed"


@dataclass(frozen=True)
class Broken(Solver):
    population: int = 5

    def search(self, box, rng, iterations):
        yield box.sample(rng, self.population)
        raise KeyError("step")


@dataclass(frozen=True)
class Torn(PlanarArm):
    def positions(self, theta):
        raise ZeroDivisionError("no tool")


class Own(BaseException):
    pass


@dataclass(frozen=True)
class Exits(Broken):
    def search(self, box, rng, iterations):
        yield box.sample(rng, self.population)
        raise SystemExit(0)


@dataclass(frozen=True)
class NoFile(Broken):
    def search(self, box, rng, iterations):
        open("/no/such/file")
        yield


class Unmade(Solver):
    def __init__(self):
        raise Own("not today")

    def search(self, box, rng, iterations):
        yield


@dataclass(frozen=True)
class Bye(PlanarArm):
    @classmethod
    def from_settings(cls, settings):
        raise SystemExit(0)


class Chore(TaskSection):
    @model_validator(mode="after")
    def check(self):
        raise RuntimeError("no work")


class Mute(TaskSection):
    def with_files(self, folder):
        raise Silent


class Silent(Exception):
    def __str__(self):
        raise ValueError
"""
TASK = """
[task]
kind = "point-to-point"
start = [1.0, 0.0]
goal = [0.5, 1.5]
objective = "time"
"""
ARM = "[arm]\nlink_lengths = [1.0, 1.0]\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
TORN = (
    '[robot]\nmodel = "raising:Torn"\n'
    "settings = { link_lengths = [1.0, 1.0], max_speed = 4.0, max_acceleration = 20.0 }\n"
)


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "raising.py").write_text(MODULE)
    monkeypatch.syspath_prepend(str(tmp_path))
    return tmp_path


def scenario(folder: Path, text: str) -> str:
    path = folder / "own.toml"
    path.write_text(text)
    return str(path)


CASES = {
    "a limit": (ARM + TASK + '[model]\nlimits = ["raising:Raising"]\n', "RuntimeError: no such sensor"),
    "a robot": (TORN + TASK, "ZeroDivisionError: no tool"),
    "a solver": (ARM + TASK + '[solver]\nname = "raising:Broken"\n', "KeyError: 'step'"),
    "a solver that exits": (ARM + TASK + '[solver]\nname = "raising:Exits"\n', "SystemExit: 0"),
    "a solver without its file": (ARM + TASK + '[solver]\nname = "raising:NoFile"\n', "FileNotFoundError: "),
    "a solver that cannot be made": (ARM + TASK + '[solver]\nname = "raising:Unmade"\n', "Own: not today"),
    "a robot that exits": (TORN.replace("Torn", "Bye") + TASK, "SystemExit: 0"),
    "a task that fails its check": (ARM + '[task]\nkind = "raising:Chore"\n', "task.kind: plug-in"),
    "a task that cannot say why": (ARM + '[task]\nkind = "raising:Mute"\n', "Silent: "),
    "a limit of a name there is": (ARM + TASK + '[model]\nlimits = ["raising:Speed"]\n', "'speed' is there twice"),
}


@pytest.mark.parametrize(("text", "reason"), CASES.values(), ids=CASES)
def test_solve(module: Path, capsys: pytest.CaptureFixture[str], text: str, reason: str) -> None:
    path = scenario(module, text)
    assert solve.main([path, "--evaluations", "200", "--out", str(module / "run"), "--quiet"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and path in said and reason in said
    assert not (module / "run").exists() or not list((module / "run").iterdir())


@pytest.mark.parametrize("case", ["a limit", "a robot", "a limit of a name there is"])
def test_audit_of_a_scenario(module: Path, capsys: pytest.CaptureFixture[str], case: str) -> None:
    text, reason = CASES[case]
    path = scenario(module, text)
    assert audit.main([path]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and path in said and reason in said


def test_audit_of_a_run(module: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path, run = scenario(module, ARM + TASK), module / "run"
    assert solve.main([path, "--evaluations", "2000", "--out", str(run), "--quiet", "--no-plots"]) == 0
    result = json.loads((run / "result.json").read_text())
    result["scenario"]["model"]["limits"] = ["raising:Raising"]
    del result["seal"]
    (run / "result.json").write_text(json.dumps(sealed(result)))
    assert audit.main([str(run)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and str(run) in said and "RuntimeError: no such sensor" in said

"""What the README shows, run; what it names, there."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from helpers.commands import parser_of

from solvers import Budget, Solver
from tpbso_casadi.cli.commands import solve

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
LONGEST = 60  # lines
BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
COMMANDS = [text for text in re.findall(r"`tpbso ([^`]+)`", README) if not text.startswith(("audit run", "--"))]


def test_it_is_short() -> None:
    assert len(README.splitlines()) <= LONGEST
    assert README.count("![") == 1


@pytest.mark.parametrize("budget", [1000, pytest.param(None, marks=pytest.mark.slow)], ids=["short", "as-it-is"])
@pytest.mark.parametrize("block", BLOCKS, ids=["plan"])
def test_what_it_shows_of_python_runs(
    block: str, budget: int | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    if budget is not None:
        monkeypatch.setattr(Solver, "default_budget", Budget(budget))
    exec(block, {})
    assert "certified" in capsys.readouterr().out


def test_its_commands_are_commands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert COMMANDS
    for name, *arguments in map(shlex.split, COMMANDS):
        assert vars(parser_of(name).parse_args(arguments))
        assert all(Path(argument).exists() for argument in arguments if argument.startswith("examples/"))


def test_what_it_names_is_there() -> None:
    names = re.findall(r"\]\(([^)#]+)", README)
    assert names and not [name for name in names if not name.startswith("https:") and not (ROOT / name).exists()]


def test_the_first_command_plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    [options] = re.findall(r"-m tpbso_casadi\.solve (.+)", README)
    monkeypatch.chdir(tmp_path)
    assert solve.main([*shlex.split(options), "--quiet", "--no-plots"]) == 0
    assert len(list(tmp_path.glob("runs/*/result.json"))) == 1

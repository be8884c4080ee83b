"""What the README shows, run; what it names, there."""

from __future__ import annotations

import re
import shlex
from importlib import import_module
from pathlib import Path

import pytest

from tpbso_casadi.cli.commands import solve

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text()
LONGEST = 150  # lines
BLOCKS = re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL)
COMMANDS = [text for text in re.findall(r"`tpbso ([^`]+)`", README) if not text.startswith("audit run")]


def test_it_is_short() -> None:
    assert len(README.splitlines()) <= LONGEST
    assert README.count("![") == 2


@pytest.mark.parametrize("block", BLOCKS)
def test_what_it_shows_of_python_runs(
    block: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    exec(block, {})
    assert "certified" in capsys.readouterr().out


@pytest.mark.parametrize("command", COMMANDS)
def test_its_commands_are_commands(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    name, *arguments = shlex.split(command)
    options = import_module(f"tpbso_casadi.cli.commands.{name}").parser().parse_args(arguments)
    files = [argument for argument in arguments if argument.startswith("examples/")]
    assert vars(options) and all(Path(file).exists() for file in files)


def test_what_it_names_is_there() -> None:
    names = re.findall(r"\]\(([^)#]+)", README)
    assert names and not [name for name in names if not name.startswith("https:") and not (ROOT / name).exists()]


def test_the_first_command_plans(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    [options] = re.findall(r"-m tpbso_casadi\.solve (.+)", README)
    monkeypatch.chdir(tmp_path)
    assert solve.main([*shlex.split(options), "--quiet", "--no-plots"]) == 0
    assert len(list(tmp_path.glob("runs/*/result.json"))) == 1

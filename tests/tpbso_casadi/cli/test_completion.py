"""``tpbso completion``: bash really completes what is typed."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest
from helpers.commands import options_of, parser_of

from problems.robots import BUILT_IN
from tpbso_casadi.cli.commands.completion import SHELLS, main
from tpbso_casadi.cli.tpbso import COMMANDS
from tpbso_casadi.scenario import SOLVER_CATALOGUE
from tpbso_casadi.scenario.cases import TITLES

COMPLETING = """
. ./completion.bash
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
$(complete -p tpbso | sed 's/.*-F \\([^ ]*\\) .*/\\1/')
printf '%s\\n' "${COMPREPLY[@]}"
"""  # what bash does when the user presses Tab after the words
needs_bash = pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Path:
    """A working folder with a scenario, a folder of runs and the script for bash."""
    monkeypatch.chdir(tmp_path)
    assert main(["bash"]) == 0
    Path("completion.bash").write_text(capsys.readouterr().out)
    Path("mine.toml").touch()
    Path("runs").mkdir()
    return tmp_path


def completed(*words: str) -> set[str]:
    done = subprocess.run(["bash", "-c", COMPLETING, "-", *words], capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return set(done.stdout.split())


@needs_bash
def test_bash_completes_commands_options_scenarios_solvers_and_files(folder: Path) -> None:
    assert completed("tpbso", "") == set(COMMANDS)
    assert completed("tpbso", "re") == {"retime", "reproduce"}
    assert completed("tpbso", "solve", "time-") == {name for name in TITLES if name.startswith("time-")}
    assert completed("tpbso", "solve", "") >= {*TITLES, "mine.toml"}
    assert completed("tpbso", "solve", "mi") == {"mine.toml"}
    assert completed("tpbso", "compare", "time-3", "obst") == {name for name in TITLES if name.startswith("obst")}
    assert completed("tpbso", "solve", "--solver", "") == set(SOLVER_CATALOGUE.registry)
    assert completed("tpbso", "solve", "time-3", "--solver", "ab") == {"abso"}
    assert completed("tpbso", "solve", "--backend", "n") == {"native"}
    assert completed("tpbso", "solve", "--export", "ros") == {"ros-json", "ros-yaml"}
    assert completed("tpbso", "solve", "-o", "") == {"runs"}
    assert completed("tpbso", "retime", "path.csv", "--robot", "m") == {"mine.toml"}
    assert completed("tpbso", "audit", "ru") == {"runs"}
    assert completed("tpbso", "robots", "show", "p") == {name for name in BUILT_IN if name.startswith("p")}


@needs_bash
@pytest.mark.parametrize("command", COMMANDS)
def test_bash_completes_every_option(command: str, folder: Path) -> None:
    options = {option for action in options_of(parser_of(command)) for option in action.option_strings}
    assert completed("tpbso", command, "--") == {option for option in options if option.startswith("--")}


@pytest.mark.parametrize("shell", SHELLS)
def test_every_shell_has_a_script_with_every_command_scenario_and_solver(
    shell: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([shell]) == 0
    script = capsys.readouterr().out
    assert all(name in script for name in (*COMMANDS, *TITLES, *SOLVER_CATALOGUE.registry))


def test_a_shell_that_is_none(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match=r"^2$"):
        main(["cmd.exe"])
    assert capsys.readouterr().err.startswith("error: argument SHELL: invalid choice: 'cmd.exe'")

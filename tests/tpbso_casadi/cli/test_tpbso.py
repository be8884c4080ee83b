"""``tpbso`` itself: the overview, the version, mistyped commands, and that all of them are answered at once."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tpbso_casadi import __version__
from tpbso_casadi.cli import tpbso
from tpbso_casadi.cli.tpbso import COMMANDS

MAIN = "from tpbso_casadi.cli.tpbso import main; main()"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", MAIN, *arguments], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"], ["help"]], ids=str)
def test_the_overview_has_a_line_for_every_command(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["tpbso", *arguments])
    with pytest.raises(SystemExit, match=r"^0$"):
        tpbso.main()
    lines = capsys.readouterr().out.splitlines()
    for command, purpose in COMMANDS.items():
        assert f"  tpbso {command:<10}  {purpose}" in lines
    assert max(map(len, lines)) <= 100
    assert any(line.startswith("  tpbso solve time-3 --out ") for line in lines)


def test_the_module_lists_the_same_under_its_own_name() -> None:
    done = subprocess.run([sys.executable, "-m", "tpbso_casadi"], capture_output=True, text=True, check=True)
    assert all(f"  python -m tpbso_casadi {command}" in done.stdout for command in COMMANDS)


@pytest.mark.parametrize("option", ["-V", "--version"])
def test_the_version(option: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["tpbso", option])
    with pytest.raises(SystemExit, match=r"^0$"):
        tpbso.main()
    assert capsys.readouterr().out == f"tpbso-casadi {__version__}\n"


@pytest.mark.parametrize(
    ("command", "line"),
    [
        ("sovle", "there is no command 'sovle'; the nearest is solve (tpbso --help lists all)"),
        ("robot", "there is no command 'robot'; the nearest is robots (tpbso --help lists all)"),
        ("--solver", "there is no command '--solver'; the nearest is solve (tpbso --help lists all)"),
        ("qwx", "there is no command 'qwx' (tpbso --help lists all)"),
        ("a\nb\x1b", r"there is no command 'a\nb\x1b' (tpbso --help lists all)"),
        ("", "there is no command '' (tpbso --help lists all)"),
    ],
)
def test_a_mistyped_command(command: str, line: str) -> None:
    done = run(command, "--seed", "1")
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"error: {line}\n")


def test_a_command_gets_the_arguments_after_its_name_and_gives_its_status() -> None:
    done = run("audit", "nowhere", "-j")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: nowhere: ") and done.stderr.count("\n") == 1


def test_overview_version_and_mistakes_load_nothing_but_the_standard_library() -> None:
    code = "import json, sys, tpbso_casadi.cli.tpbso; print(json.dumps(list(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    names = {name.partition(".")[0] for name in json.loads(done.stdout)}
    assert "tpbso_casadi" in names
    assert not {"numpy", "casadi", "pydantic", "rich", "scipy", "shtab", "solvers", "problems", "argparse"} & names


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
def test_an_overview_that_cannot_be_printed() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([sys.executable, "-c", MAIN], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "error: standard output: No space left on device\n")


@pytest.mark.parametrize(("closed", "status"), [(">&-", 0), ("2>&-", 0), (">&- 2>&-", 0)])
def test_closed_outputs(closed: str, status: int) -> None:
    command = f"{sys.executable} -m tpbso_casadi --version {closed}"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (status, "")

"""What every command leaves to its caller: an overview, one line of error whatever it holds, a status that says so."""

from __future__ import annotations

import argparse
import io
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NoReturn

import pytest
from helpers.running import status
from helpers.slow import slow_except

from problems.library import core_account
from tpbso_casadi import __version__
from tpbso_casadi.cli import tpbso
from tpbso_casadi.cli.command import print_error
from tpbso_casadi.cli.commands import solve
from tpbso_casadi.cli.options import natural, path, positive_float, positive_int, printable_name, whole_number
from tpbso_casadi.cli.tpbso import COMMANDS
from tpbso_casadi.plain import LONGEST_LINE

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

process = pytest.mark.process
needs_full_device = pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")

MAIN = "from tpbso_casadi.cli.tpbso import main; main()"


def tpbso_run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", MAIN, *arguments], capture_output=True, text=True, check=False)


def answer(arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    """What ``tpbso`` prints by itself, which is no error."""
    monkeypatch.setattr(sys, "argv", ["tpbso", *arguments])
    with pytest.raises(SystemExit, match=r"^0$"):
        tpbso.main()
    return capsys.readouterr().out


@pytest.mark.parametrize("arguments", [[], ["--help"], ["-h"], ["help"]], ids=str)
def test_the_overview_has_a_line_for_every_command(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = answer(arguments, monkeypatch, capsys).splitlines()
    assert {f"  tpbso {command:<10}  {purpose}" for command, purpose in COMMANDS.items()} <= set(lines)
    assert max(map(len, lines)) <= 100
    assert any(line.startswith("  tpbso solve time-3 --out ") for line in lines)


def test_the_version(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    for option in ("-V", "--version"):
        assert answer([option], monkeypatch, capsys) == f"tpbso-casadi {__version__}\ncore: {core_account()}\n"


def test_options_of_every_command_may_stand_before_it(monkeypatch: pytest.MonkeyPatch) -> None:
    def ended(module: str, name: str) -> NoReturn:
        raise SystemExit([module.rpartition(".")[2], name, *sys.argv[1:]])

    monkeypatch.setattr(tpbso, "run", ended)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for given, expected in (
        (["-v", "solve", "time-2"], ["solve", "tpbso solve", "time-2", "-v"]),
        (["-vv", "-q", "audit", "run"], ["audit", "tpbso audit", "run", "-vv", "-q"]),
    ):
        monkeypatch.setattr(sys, "argv", ["tpbso", *given])
        with pytest.raises(SystemExit) as left:
            tpbso.main()
        assert left.value.code == expected


@process
def test_the_module_lists_the_same_under_its_own_name() -> None:
    done = subprocess.run([sys.executable, "-m", "tpbso_casadi"], capture_output=True, text=True, check=True)
    assert all(f"  python -m tpbso_casadi {command}" in done.stdout for command in COMMANDS)


MISTYPED = {
    "sovle": "there is no command 'sovle'; the nearest is solve (tpbso --help lists all)",
    "robot": "there is no command 'robot'; the nearest is robots (tpbso --help lists all)",
    "--solver": "there is no command '--solver'; the nearest is solve (tpbso --help lists all)",
    "qwx": "there is no command 'qwx' (tpbso --help lists all)",
    "a\nb\x1b": r"there is no command 'a\nb\x1b' (tpbso --help lists all)",
    "": "there is no command '' (tpbso --help lists all)",
}


@process
def test_a_mistyped_command() -> None:
    for command, line in MISTYPED.items():
        done = tpbso_run(command, "--seed", "1")
        assert (done.returncode, done.stdout, done.stderr) == (2, "", f"error: {line}\n")


@process
def test_a_command_gets_the_arguments_after_its_name_and_gives_its_status() -> None:
    done = tpbso_run("audit", "nowhere", "-j")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("error: nowhere: ") and done.stderr.count("\n") == 1


@process
@needs_full_device
def test_an_overview_that_cannot_be_printed() -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([sys.executable, "-c", MAIN], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "error: standard output: No space left on device\n")


def test_what_an_encoding_lacks_is_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    buffer = io.BytesIO()
    monkeypatch.setattr(sys, "stderr", io.TextIOWrapper(buffer, "ascii"))
    print_error("ä 字")
    assert buffer.getvalue() == b"error: \\xe4 \\u5b57\n"


@process
@pytest.mark.parametrize("redirection", ["2>/dev/full", "2>&-"])
def test_a_full_or_closed_standard_error_changes_no_status(redirection: str) -> None:
    code = "from tpbso_casadi.cli.command import print_error; print_error('lost'); raise SystemExit(2)"
    done = subprocess.run(["sh", "-c", f'"$0" -c "$1" {redirection}', sys.executable, code], check=False)
    assert done.returncode == 2


def test_no_standard_error_at_all(monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    print_error("lost")
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("kind", "text", "reason"),
    [
        (positive_int, "1.5", "a whole number is needed, not '1.5'"),
        (positive_int, "9" * 5000, "a whole number is needed, not '999"),
        (positive_int, "0", "0 is not positive"),
        (positive_int, str(10**30), f"{10**30} is more than 1000000000"),
        (whole_number(1, 100), "101", "101 is more than 100"),
        (whole_number(2, 100), "1", "1 is less than 2"),
        (natural, "-1", "-1 is negative"),
        (natural, str(2**63), f"{2**63} is more than {2**63 - 1}"),
        (positive_float, "fast", "a number is needed, not 'fast'"),
        *(
            (positive_float, text, f"{text} is not a positive number")
            for text in ("nan", "inf", "1e308", "5e-324", "-1")
        ),
        (printable_name, "a\0b", "printable"),
        (printable_name, "\udcff", "printable"),
        (printable_name, "a" * 201, "at most 200"),
        (path, "", "a path is needed, not ''"),
        (path, "a\0b", "a path is needed"),
    ],
)
def test_what_is_typed_wrong(kind: Callable[[str], object], text: str, reason: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError) as caught:
        kind(text)
    assert str(caught.value).startswith(reason) or reason in str(caught.value)
    assert len(str(caught.value)) < LONGEST_LINE


def test_what_is_typed_right() -> None:
    assert natural(str(2**63 - 1)) == 2**63 - 1
    assert positive_float("1e-12") == 1e-12
    assert path("[red]") == Path("[red]")
    assert printable_name("ä.b:C") == "ä.b:C"


SOLVE = [sys.executable, "-m", "tpbso_casadi.solve", "time-2", "--evaluations", "500", "--no-plots"]
RAISES = [
    ("{}['key']", 2, "error: internal error, please report it: KeyError: 'key' (broken.py:2)"),
    ("raise MemoryError", 2, "error: there is not enough memory"),
    ("main()", 2, "error: internal error, please report it: RecursionError: "),
    ("open('nowhere/file')", 2, "error: nowhere/file: No such file or directory"),
    ("raise KeyboardInterrupt", 130, "error: interrupted"),
    ("return 1", 1, ""),
]


def run_main(body: str, *options: str) -> subprocess.CompletedProcess[str]:
    Path("broken.py").write_text(f"def main():\n    {body}\n")
    code = "from tpbso_casadi.cli.entry import run\nrun('broken')"
    return subprocess.run([sys.executable, *options, "-c", code], capture_output=True, text=True, check=False)


@process
def test_whatever_is_raised_is_one_line_and_developers_see_the_traceback() -> None:
    for body, ended, line in RAISES:
        done = run_main(body)
        assert (done.returncode, done.stderr.count("\n")) == (ended, 1 if line else 0), body
        assert done.stderr.startswith(line)
    assert "Traceback" in run_main("{}['key']", "-X", "dev").stderr


@process
@needs_full_device
@pytest.mark.parametrize("what", [["--json"], pytest.param(["--out", "out"], marks=pytest.mark.slow)])
def test_a_full_standard_output(what: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*SOLVE, *what], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "error: standard output: No space left on device\n")
    assert what == ["--json"] or Path("out/result.json").exists()


@process
def test_a_standard_output_that_nobody_reads() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*SOLVE, "--out", "out"], stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (2, "error: standard output: Broken pipe\n")


@process
def test_closed_outputs_of_the_overview() -> None:
    for closed in (">&-", "2>&-", ">&- 2>&-"):
        command = f"{sys.executable} -m tpbso_casadi --version {closed}"
        done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr) == (0, "")


@process
@pytest.mark.parametrize("closed", slow_except([">&- 2>&-", ">&-", "2>&-"], 1))
def test_closed_outputs(closed: str) -> None:
    command = f"{sys.executable} -m tpbso_casadi.solve time-2 --evaluations 500 --no-plots --out out {closed}"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert Path("out/result.json").exists()


PRINTING = """
from dataclasses import dataclass
from solvers import Solver


@dataclass(frozen=True)
class Chatty(Solver):
    population: int = 10

    def search(self, box, rng, iterations):
        print("searching ...")
        yield box.sample(rng, self.population)
        for progress in iterations:
            yield box.sample(rng, self.population)
"""


def test_what_a_plug_in_prints_does_not_spoil_the_result(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("chatty.py").write_text(PRINTING)
    monkeypatch.syspath_prepend(str(Path.cwd()))
    assert status(solve.main, *SOLVE[3:], "--json", "--solver", "chatty:Chatty") == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["solver"]["name"] == "chatty:Chatty"
    assert printed.err.startswith("searching ...\n")

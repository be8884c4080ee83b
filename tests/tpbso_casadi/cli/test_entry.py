"""What a command leaves to its caller when something goes wrong: one line, and a status that says so."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

SOLVE = [sys.executable, "-m", "tpbso_casadi.solve", "time-2", "--evaluations", "500", "--no-plots"]
RAISES = {
    "crash": ("{}['key']", 2, "error: internal error, please report it: KeyError: 'key' (broken.py:2)"),
    "memory": ("raise MemoryError", 2, "error: there is not enough memory"),
    "recursion": ("main()", 2, "error: internal error, please report it: RecursionError: "),
    "system": ("open('nowhere/file')", 2, "error: nowhere/file: No such file or directory"),
    "interruption": ("raise KeyboardInterrupt", 130, "error: interrupted"),
    "status": ("return 1", 1, ""),
}


def run_main(body: str, *options: str) -> subprocess.CompletedProcess[str]:
    Path("broken.py").write_text(f"def main():\n    {body}\n")
    code = "from tpbso_casadi.cli.entry import run\nrun('broken')"
    return subprocess.run([sys.executable, *options, "-c", code], capture_output=True, text=True, check=False)


@pytest.mark.parametrize(("body", "status", "line"), RAISES.values(), ids=RAISES)
def test_whatever_is_raised_is_one_line(body: str, status: int, line: str) -> None:
    done = run_main(body)
    assert (done.returncode, done.stderr.count("\n")) == (status, 1 if line else 0)
    assert done.stderr.startswith(line)


def test_developers_see_the_traceback() -> None:
    done = run_main("{}['key']", "-X", "dev")
    assert "Traceback" in done.stderr


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no such device")
@pytest.mark.parametrize("what", [["--json"], pytest.param(["--out", "out"], marks=pytest.mark.slow)])
def test_a_full_standard_output(what: list[str]) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run([*SOLVE, *what], stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, "error: standard output: No space left on device\n")
    assert what == ["--json"] or Path("out/result.json").exists()


def test_a_standard_output_that_nobody_reads() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([*SOLVE, "--out", "out"], stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (2, "error: standard output: Broken pipe\n")


@pytest.mark.parametrize(
    "closed", [">&- 2>&-", *(pytest.param(closed, marks=pytest.mark.slow) for closed in (">&-", "2>&-"))]
)
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


def test_what_a_plug_in_prints_does_not_spoil_the_result() -> None:
    Path("chatty.py").write_text(PRINTING)
    done = subprocess.run([*SOLVE, "--json", "--solver", "chatty:Chatty"], capture_output=True, text=True, check=False)
    assert done.stdout, done.stderr
    assert json.loads(done.stdout)["solver"]["name"] == "chatty:Chatty"
    assert done.stderr.startswith("searching ...\n")

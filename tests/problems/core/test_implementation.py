"""Which core answers, and what is said where the compiled one is missed."""

from __future__ import annotations

import logging
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from problems.core import core, core_account, implementation, library
from problems.core.implementation import multiprocessing
from problems.core.library import SWITCH, core_library, loaded_core
from problems.core.reference import ReferenceCore

ROOT = Path(__file__).parents[3]
VERSION = '[ "$1" = --version ] && echo 1.0 && exit 0\n'
NONE = r"no C\+\+ compiler \(/nonexistent\) on PATH answers"


def forget() -> None:
    for known in (loaded_core, implementation, core):
        known.cache_clear()


@pytest.fixture(autouse=True)
def asked_anew() -> Iterator[None]:
    forget()
    yield
    forget()


@pytest.fixture
def without_a_compiler(cache_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No library came with the package either."""
    monkeypatch.delenv(SWITCH, raising=False)
    monkeypatch.setattr(library, "_packaged", list)
    monkeypatch.setenv("CXX", "/nonexistent")


@pytest.mark.usefixtures("without_a_compiler")
def test_where_the_compiled_core_is_missed_one_line_says_so_before_the_first_answer(
    caplog: pytest.LogCaptureFixture,
) -> None:
    assert isinstance(implementation(), ReferenceCore) and core_library() is None
    assert re.fullmatch(f"NumPy, as {NONE}", core_account())
    assert caplog.messages == []
    assert core() is core() is implementation()
    [record] = caplog.records
    assert record.levelno == logging.WARNING
    expected = f"core in NumPy, as {NONE}: plans in space .* 2 to 15 times as long; install a C.. compiler .* CXX"
    assert re.fullmatch(expected, record.getMessage())


PLANNED = """
from problems.core import library
library._packaged = list  # as where pip has found no compiler
from helpers.space_scenarios import space_scenario
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario import parse_scenario

for _ in range(2):
    found = plan(parse_scenario(space_scenario(solver={"name": "direct", "evaluations": 300})))
    assert found.motion.feasible and found.search.evaluations == 0
"""


@pytest.mark.process
@pytest.mark.usefixtures("cache_folder")
def test_plans_of_a_process_without_a_compiler_print_one_line() -> None:
    places = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
    environment = {name: value for name, value in os.environ.items() if name != SWITCH}
    done = subprocess.run(
        [sys.executable, "-c", PLANNED], check=True, capture_output=True, text=True, timeout=300,
        env=environment | {"PYTHONPATH": places, "CXX": "/nonexistent"},
    )  # fmt: skip
    assert done.stdout == ""
    assert re.fullmatch(f"core in NumPy, as {NONE}: .*\n", done.stderr)


@pytest.mark.usefixtures("without_a_compiler")
def test_of_processes_that_others_have_started_one_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, cache_folder: Path
) -> None:
    monkeypatch.setattr(multiprocessing, "parent_process", multiprocessing.current_process)
    for _ in range(3):
        forget()
        core()
    assert len(caplog.messages) == 1
    cache_folder.chmod(0o777)  # nobody can claim anything there
    forget()
    core()
    assert len(caplog.messages) == 1


@pytest.mark.usefixtures("without_a_compiler")
@pytest.mark.parametrize("value", ["off", "OFF"])
def test_a_core_that_the_user_has_switched_off_is_not_missed(
    value: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv(SWITCH, value)
    assert isinstance(core(), ReferenceCore)
    assert core_account() == f"NumPy, as {SWITCH} is off"
    assert caplog.messages == []


@pytest.mark.usefixtures("without_a_compiler")
@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("echo no such flag >&2; exit 4", "compiler failed: no such flag"),
        ('for last; do :; done; echo "no library" > "$last"', "what was compiled cannot be loaded"),
    ],
    ids=["fails", "lies"],
)
def test_a_compiler_that_makes_no_core_is_named(
    script: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    compiler = tmp_path / "compiler"
    compiler.write_text(f"#!/bin/sh\n{VERSION}{script}\n")
    compiler.chmod(0o700)
    monkeypatch.setenv("CXX", str(compiler))
    assert isinstance(core(), ReferenceCore)
    assert core_account().endswith(reason)
    [line] = caplog.messages
    assert reason in line and line.isprintable()


def test_a_compiled_core_says_by_what_and_for_what(caplog: pytest.LogCaptureFixture) -> None:
    if core_library() is None:
        pytest.skip("there is no compiled core, and no compiler that makes one")
    made = r"compiled by (GCC|Clang|Apple Clang) \d+\.\d+\.\d+ for (AVX-512|AVX2|any processor of its kind)"
    assert re.fullmatch(made, core_account())
    assert core().name == "compiled"
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]

"""``-v``: lines of the log on standard error, and nowhere else."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import pytest

from tpbso_casadi.cli.command import LOGGERS, logged
from tpbso_casadi.cli.commands import compare, solve

SOLVE = ["time-2", "--evaluations", "500", "--polish", "--no-plots"]


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def subjects(errors: str) -> list[str]:
    """What the lines of a log are about; every line has its time."""
    lines = errors.splitlines()
    assert all(re.match(r"\d+ ms: ", line) for line in lines), errors
    return [line.split(": ")[1] for line in lines]


def test_v_says_what_is_done_and_how_long_it_took(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*SOLVE, "-v", "--out", "out"]) == 0
    printed = capsys.readouterr()
    said = subjects(printed.err)
    assert said[0] == "model" and said[-2:] == ["written", "tpbso solve"]
    assert said.index("search") < said.index("certificate") < said.index("written")
    assert said.index("search") < said.index("polish")
    assert re.search(r"search: 500 evaluations, \d+ iterations in \d+\.\d{3} s; stopped: evaluations\n", printed.err)
    assert re.search(r"certificate: 4 of 4 constraints proven for all t in \d+\.\d{3} s\n", printed.err)
    assert printed.err.endswith(" s\n") and ": exit status 0 after " in printed.err
    assert " ms: " not in printed.out


def test_json_is_alone_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*SOLVE, "-vv", "-j"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["solver"]["name"]
    assert "tpbso_casadi.planning.progress: search: " in printed.err  # twice names the loggers
    assert re.search(r"\d+ ms: tpbso_casadi.cli.command: tpbso-casadi \S+, casadi ", printed.err)


def test_without_it_nothing_is_said_and_the_result_is_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*SOLVE, "-q", "-o", "silent"]) == 0
    assert capsys.readouterr() == ("", "")
    assert solve.main([*SOLVE, "-q", "-v", "-o", "told"]) == 0
    silent, told = (Path(folder, "trajectory.csv").read_bytes() for folder in ("silent", "told"))
    assert silent == told


def test_a_campaign_says_each_run(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["time-2", "--solvers", "bso,pso", "--runs", "2", "--evaluations", "300", "--workers", "1"]
    assert compare.main([*arguments, "--no-plots", "-qv"]) == 0
    said = re.findall(r"run: (time-2, \w+, seed \d): done in", capsys.readouterr().err)
    assert sorted(said) == [f"time-2, {solver}, seed {seed}" for solver in ("bso", "pso") for seed in (1, 2)]


def test_a_record_is_one_line_without_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    with logged(1):
        logging.getLogger("problems.evaluation").info("two\nlines \x1b[31m")
        logging.getLogger("problems.evaluation").debug("not at this level")
    logging.getLogger("problems.evaluation").info("nobody listens any more")
    assert re.fullmatch(r"\d+ ms: two lines \\x1b\[31m\n", capsys.readouterr().err)


def test_levels_and_handlers_are_as_before() -> None:
    before = [(logging.getLogger(name).level, list(logging.getLogger(name).handlers)) for name in LOGGERS]
    with pytest.raises(KeyError), logged(2):
        raise KeyError
    assert [(logging.getLogger(name).level, list(logging.getLogger(name).handlers)) for name in LOGGERS] == before

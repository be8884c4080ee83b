"""``tpbso certify``: what it prints and writes of a motion, and of one that it repairs; exit statuses."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from helpers.recorded import ARM, write_rows
from helpers.running import result_of, status

from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.cli.commands.certify import main

OBSTACLE = '[[obstacles]]\nshape = "box"\ncenter = [0.6, 0.6]\nsize = [0.2, 0.2]\n'
GOOD, FAST = ("good.csv", "--robot", "arm.toml"), ("fast.csv", "--robot", "arm.toml")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    Path("cell.toml").write_text(OBSTACLE)
    write_rows("good.csv", 2.0)
    write_rows("fast.csv", 0.6)


def run(*arguments: str) -> int:
    return status(main, *arguments, "--no-plots")


def test_a_motion_is_proven_written_and_audited_and_a_scenario_states_the_same(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(*GOOD, "--out", "out", "--repair", "--quiet") == 0
    assert capsys.readouterr().out == "" and not Path("out-repaired").exists()
    content = result_of("out")
    assert content["certificate"]["verdict"] == "certified"
    assert content["scenario"]["task"]["times"] == np.linspace(0.0, 2.0, 9).tolist()
    assert content["solver"] is None
    assert audit.main(["out", "--quiet"]) == 0
    Path("s.toml").write_text(ARM + '[task]\nkind = "recorded-motion"\nfile = "good.csv"\n')
    assert solve.main(["s.toml", "--quiet", "--no-plots", "--out", "solved"]) == 0
    assert result_of("solved")["solution"] == content["solution"]
    assert run(*GOOD, "--json") == 0
    assert json.loads(capsys.readouterr().out)["certificate"]["verdict"] == "certified"


def test_what_is_broken_says_when_first_when_worst_where_and_what_would_have_to_move(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert run(*FAST, "--scene", "cell.toml", "--out", "out", "--repair") == 1
    out, err = capsys.readouterr()
    assert "a motion as it is stated: quintic between 9 rows" in out
    assert err.startswith(
        "error: the motion as it is cannot be run: its speed is 3.125 rad/s where 2 is the limit (joint 1, "
    )
    assert "time alone does not help; on this path would have to give way:\nclearance: link 2, obstacle 1, t = " in err
    rows = {row["name"]: row for row in result_of("out")["constraints"]}
    first = 0.6 * (1.0 - np.sqrt(0.2)) / 2.0  # where 30 u^2 (1 - u)^2 / 0.6 s is 2 rad/s
    assert rows["speed"]["where"] == f"joint 1, t = 0.3 s; first at {first:.4g} s"
    assert rows["clearance"]["where"].startswith("link 2, obstacle 1, t = ")
    assert "; first at " in rows["clearance"]["where"]
    assert rows["clearance"]["worst"] < 0.0
    assert audit.main(["out", "--quiet"]) == 1
    assert not Path("out-repaired").exists()


def test_a_repaired_motion_lies_beside_the_folder_that_was_written(capsys: pytest.CaptureFixture[str]) -> None:
    Path("slow.toml").write_text(ARM.replace("2.0", "1.9"))
    for arm in ("arm.toml", "slow.toml"):
        assert run("fast.csv", "--robot", arm, "--repair") == 0
    said = capsys.readouterr().err
    assert "slower all along by 1.5625: 0.9375 s, certified" in said
    assert "timed anew on its path: 0.7013" in said
    assert "repaired: 0.7013" in said
    folders = ("fast-certified", "fast-certified-repaired", "fast-certified-2", "fast-certified-2-repaired")
    assert {path.name for path in Path("runs").iterdir()} == set(folders)
    assert [audit.main([f"runs/{name}", "--quiet"]) for name in folders] == [1, 0, 1, 0]


def test_a_folder_has_a_table_that_is_printed_and_none_of_its_trajectories(capsys: pytest.CaptureFixture[str]) -> None:
    Path("many").mkdir()
    for name, seconds in (("a", 2.0), ("b", 0.5)):
        write_rows(f"many/{name}.csv", seconds)
    command = ["many", "--robot", "arm.toml", "--out", "many"]
    assert status(main, *command) == 1
    out = capsys.readouterr().out
    assert out.startswith("1 violated, 1 certified\n") or out.startswith("1 certified, 1 violated\n")
    assert out.index("b.csv") < out.index("a.csv") and "written to many/certificates.csv\n" in out
    with Path("many/certificates.csv").open(newline="") as file:
        rows = {row["file"]: row for row in csv.DictReader(file)}
    assert {name: row["status"] for name, row in rows.items()} == {"a.csv": "certified", "b.csv": "violated"}
    assert status(main, *command, "--json") == 1
    assert [row["file"] for row in json.loads(capsys.readouterr().out)["certificates"]] == ["a.csv", "b.csv"]
    limits = ["--without", "speed", "--without", "acceleration", "--without", "jerk"]
    assert status(main, *command, *limits) == 0
    assert capsys.readouterr().out.startswith("2 certified without a verdict on speed, acceleration, jerk\n")
    Path("many/b.csv").unlink()
    assert status(main, *command, "--interpolation", "cubic", "--payload", "0", "--quiet") == 0
    assert capsys.readouterr().out == ""

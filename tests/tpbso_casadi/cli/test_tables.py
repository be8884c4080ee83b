"""What is printed fits 80 columns, and says what a user should know."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.cli.commands.audit import main as audit
from tpbso_casadi.cli.commands.solve import main as solve
from tpbso_casadi.scenario.cases import BEST_KNOWN, TITLES, best_known

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize(
    "case", ["time-2", *(pytest.param(case, marks=pytest.mark.slow) for case in ("obstacle-5", "pentagram-time"))]
)
def test_tables_fit_and_cut_nothing(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    solve([case, "--evaluations", "1000", "--no-plots", "--out", "out"])
    audit(["out"])
    audit([case])
    solve(["--list"])
    lines = capfd.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100 and all(len(line) <= 80 for line in lines if "  " in line)
    assert not any("…" in line for line in lines)
    rows = [line for line in lines if re.match(r"(speed|acceleration|accuracy|clearance) +-?\d", line)]
    assert rows
    assert all(re.match(r"\w+ +-?[\d.e-]+  -?[\d.]+ \S+ ", row) for row in rows)


def test_joints_that_turn_more_than_once_are_mentioned(capfd: pytest.CaptureFixture[str]) -> None:
    solve(["pentagram-time", "--evaluations", "1000", "--no-plots", "--out", "out"])
    assert re.search(r"^joint 1 turns [2-9]\.\d\d times; state joint_limits", capfd.readouterr().out, re.MULTILINE)
    solve(["time-2", "--evaluations", "1000", "--no-plots", "--out", "out"])
    assert "turns" not in capfd.readouterr().out


def test_joints_that_are_given_far_apart_are_no_surprise(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "far.toml"
    file.write_text(
        "[arm]\nlink_lengths = [0.5, 0.5]\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
        '[task]\nkind = "joint-path"\njoints = [[0.0, 0.0], [4.0, 0.5], [8.0, 0.0]]\n'
    )
    solve([str(file), "--no-plots", "--out", "out"])
    assert "joint 1 turns 1.27 times; the joints that are given are 1.27 turns apart" in capfd.readouterr().out


def test_a_plan_far_from_the_best_known_is_called_so(capfd: pytest.CaptureFixture[str]) -> None:
    solve(["time-5", "--solver", "bso", "--evaluations", "3000", "--no-plots", "--out", "out"])
    assert re.search(r"^\d+% above the best plan known, 0\.322\d* s; try", capfd.readouterr().out, re.MULTILINE)
    solve(["time-2", "--no-plots", "--out", "out"])
    assert "best plan known" not in capfd.readouterr().out
    solve(["time-5", "--links", "6", "--solver", "bso", "--evaluations", "3000", "--no-plots", "--out", "out"])
    assert "best plan known" not in capfd.readouterr().out


def test_the_best_known_is_that_of_the_same_statement() -> None:
    assert set(BEST_KNOWN) == set(TITLES)
    for name, best in BEST_KNOWN.items():
        assert best_known(builtin(name)) == best
    content = builtin("time-3").model_dump()
    assert best_known(parse_scenario(content | {"model": {"formulation": "reduced"}})) == BEST_KNOWN["time-3"]
    content["arm"]["max_speed"] = 5.0
    assert best_known(parse_scenario(content)) is None


def test_names_are_not_read_as_markup(capfd: pytest.CaptureFixture[str]) -> None:
    Path("[red]").mkdir()
    solve(["time-2", "--evaluations", "500", "--no-plots", "--out", "[red]/[bold]out[/]"])
    assert "written to [red]/[bold]out[/]" in capfd.readouterr().out

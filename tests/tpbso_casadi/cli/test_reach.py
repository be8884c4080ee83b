"""``tpbso reach``: what it writes and says, and what it refuses."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.running import status

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.reach import main

SCENE = '[robot]\nmodel = "ur5e"\n[[obstacles]]\nshape = "box"\ncenter = [0.0, 0.0, -0.06]\nsize = [2.0, 2.0, 0.1]\n'
COARSE = ("--spacing", "0.4", "--orientations", "4")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("cell.toml").write_text(SCENE)


def test_a_map_of_a_robot_and_what_is_around_it_is_written_and_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(main, "cell.toml", *COARSE, "--out", "out") == 0
    said = capsys.readouterr().out
    assert "reached and clear" in said and "in every one" in said
    found = tp.read_reach("out/reach.npz")
    assert found.reached.shape == (len(found.points), 4)
    assert not found.clear[found.points[:, 2] < -0.3].any()  # below the table
    assert tp.reach("ur5e", found.points, found.rotations).clear.sum() > found.clear.sum()
    assert {path.name for path in Path("out").iterdir()} == {"reach.npz", "reach.png"}


def test_without_a_folder_nothing_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(main, "ur5e", *COARSE, "--quiet") == 0
    assert not capsys.readouterr().out
    assert {path.name for path in Path().iterdir()} == {"cell.toml"}


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["nosuch"], "is no robot"),
        (["ur5e", "--spacing", "0.0001"], "--spacing: 0.0001 m leads to"),
        (["ur5e", "--tip", "left"], "--tip: no arm is called 'left'"),
        (["ur5e", "--out", "cell.toml"], "cell.toml: is no folder"),
        (["missing.toml"], "missing.toml"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status(main, *arguments) == 2
    said = capsys.readouterr().err.strip()
    assert reason in said and said.count("\n") == 0

"""CSV files of joint angles: what is read, and one line for what is not."""

from __future__ import annotations

from pathlib import Path

import pytest

from tpbso_casadi import ScenarioError
from tpbso_casadi.scenario import InputFolder, input_files, read_joint_rows


def read(folder: Path, text: str) -> list[list[float]]:
    (folder / "path.csv").write_text(text)
    return read_joint_rows(InputFolder(folder), "path.csv")


def test_waypoints_are_read(tmp_path: Path) -> None:
    assert read(tmp_path, "q1,q2\n0,1\n\n 0.5 , -1e-1\n") == [[0.0, 1.0], [0.5, -0.1]]


def test_a_recording_leaves_out_where_nothing_moves(tmp_path: Path) -> None:
    assert read(tmp_path, "t,q1\n0,1\n0.1,1\n0.2,2\n") == [[1.0], [2.0]]


def test_the_table_of_a_run_is_read(tmp_path: Path) -> None:
    assert read(tmp_path, "t,q1,q2,qd1,qd2,qdd1,qdd2,x,y\n0,1,2,0,0,0,0,0,0\n1,3,4,0,0,0,0,0,0\n") == [[1, 2], [3, 4]]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "path.csv: is empty; the header"),
        ("0,1\n1,2\n", "path.csv line 1: the header q1,q2,... or t,q1,q2,... is needed"),
        ("q1,q3\n0,1\n", "path.csv line 1: the header"),
        ("q1,Q2\n0,1\n", "path.csv line 1: the header"),
        ("q1,q2,t\n0,1,2\n", "path.csv line 1: the header"),
        ("t\n0\n", "path.csv line 1: the header"),
        ("q1,q2\n0,1\n", "path.csv: 1 rows of different joint angles; a path needs two at least"),
        ("q1,q2\n", "path.csv: 0 rows"),
        ("q1,q2\n0,1\n\n0,1,2\n", "path.csv line 4: 3 numbers where the header has 2 names"),
        ("q1,q2\n0,1\n0\n", "path.csv line 3: 1 numbers where the header has 2 names"),
        ("q1,q2\n0,1\n0,x\n", "path.csv line 3: 2 numbers are needed"),
        ("q1,q2\n0,1\n0,nan\n", "path.csv line 3: a number is not finite"),
        ("q1,q2\n0,1\n0,1e7\n", "path.csv line 3: a number is not finite, or an angle larger than 1e+06"),
        ("q1,q2\n0,1\n0,1\n1,1\n", "path.csv line 3: the same joint angles as in the line before"),
        ("t,q1\n0,1\n0,2\n", "path.csv line 3: times have to increase"),
        ("t,q1\n0,1\nnan,2\n", "path.csv line 3: "),
        ("t,q1\n0,1\n1,1\n", "path.csv: 1 rows of different"),
    ],
)
def test_what_is_wrong_takes_one_line(tmp_path: Path, text: str, expected: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        read(tmp_path, text)
    assert expected in str(caught.value)
    assert "\n" not in str(caught.value)


def test_more_rows_than_are_planned_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(input_files, "MOST_ROWS", 3)
    with pytest.raises(ScenarioError, match="line 5: more than 3 rows"):
        read(tmp_path, "q1\n0\n1\n2\n3\n")

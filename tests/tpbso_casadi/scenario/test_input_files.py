"""What is read: regular files of a sensible size, those that a scenario may name, and CSV files of joint angles."""

from __future__ import annotations

import os
import socket
from functools import partial
from pathlib import Path

import pytest
from helpers.running import line_of
from helpers.scenes import TWO_LINKS, toml

import tpbso_casadi as tp
from tpbso_casadi.scenario import (
    InputFolder,
    ScenarioError,
    load,
    load_all,
    parse_scenario,
    read_joint_rows,
    read_scenario,
    read_text,
    read_toml,
)

ARM = TWO_LINKS | {"link_lengths": [1.0, 1.0, 1.0]}
POINTS = "1,0\n1,1\n0,1.5\n"


def with_points(file: str) -> str:
    return toml(arm=ARM, task={"kind": "path", "accuracy": 0.05, "points": file})


def refusal(path: Path) -> str:
    return line_of(partial(read_text, path))


def test_what_is_no_regular_file_is_not_opened(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the name of a socket is short
    os.mkfifo("pipe")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind("socket")
    Path("link").symlink_to("/dev/zero")
    for name in ("pipe", "socket", "link", "/dev/zero", "/dev/random"):
        assert refusal(Path(name)).endswith("it is a pipe, a device or a socket, not a file")
    assert refusal(tmp_path).endswith("it is a folder")


def test_paths_that_cannot_be(tmp_path: Path) -> None:
    (tmp_path / "circle").symlink_to("circle")
    assert "Too many levels of symbolic links" in refusal(tmp_path / "circle")
    assert "File name too long" in refusal(tmp_path / ("a" * 5000))
    assert "null byte" in refusal(tmp_path / "a\0b")


def test_a_large_file_is_refused(tmp_path: Path) -> None:
    with (tmp_path / "large").open("wb") as file:
        file.truncate(10**12)  # without content
    assert refusal(tmp_path / "large").endswith("it is larger than 10 MB")
    with pytest.raises(ScenarioError, match="larger than 1 MB"):
        read_toml(tmp_path / "large")


ODD = [
    ("a = " + "9" * 5000, "a whole number of thousands of digits"),
    ("a = " + "[" * 5000, "nested too deeply"),
    (".".join("a" * 60) + " = 1", "a key of more than 50 parts"),
    ("[" + " . ".join(["'a b'"] * 60) + "]", "a key of more than 50 parts"),
    ("a = ", "not TOML: "),
]


def test_toml_that_takes_too_much(tmp_path: Path) -> None:
    for text, reason in ODD:
        (tmp_path / "odd.toml").write_text(text)
        assert reason in line_of(partial(read_toml, tmp_path / "odd.toml"))


def test_many_numbers_are_no_long_key(tmp_path: Path) -> None:
    (tmp_path / "fine.toml").write_text("a = [" + "1.5, " * 200 + "]\nb.c.d = '" + "x.y " * 100 + "'\n")
    assert len(read_toml(tmp_path / "fine.toml")["a"]) == 200


@pytest.mark.parametrize(
    "text", ["x,y\n1,0\n1,1\n\n0,1.5\n", "\ufeffx, y\r\n1,0\r\n1,1\r\n0,1.5", " 1 , 0\n1,1\n0,1.5\n"]
)
def test_points_are_read_from_beside_the_scenario(tmp_path: Path, text: str) -> None:
    (tmp_path / "mine.toml").write_text(with_points("way.csv"))
    (tmp_path / "way.csv").write_text(text)
    scenario = read_scenario(tmp_path / "mine.toml")
    assert scenario.task.points == [(1.0, 0.0), (1.0, 1.0), (0.0, 1.5)]
    assert parse_scenario(scenario.table()) == scenario


@pytest.fixture
def folders(tmp_path: Path) -> Path:
    """A folder with a scenario in it, and points outside."""
    (tmp_path / "mine/deep").mkdir(parents=True)
    (tmp_path / "way.csv").write_text(POINTS)
    (tmp_path / "mine/deep/way.csv").write_text(POINTS)
    (tmp_path / "mine/link.csv").symlink_to(tmp_path / "way.csv")
    return tmp_path


@pytest.mark.parametrize("name", ["deep/way.csv", "./deep/../deep/way.csv"])
def test_points_below_the_folder_of_the_scenario(folders: Path, name: str) -> None:
    (folders / "mine/a.toml").write_text(with_points(name))
    assert len(read_scenario(folders / "mine/a.toml").task.points) == 3  # type: ignore[attr-defined]


@pytest.mark.parametrize("name", ["../way.csv", "link.csv", "/etc/passwd", "deep/../../way.csv"])
def test_points_elsewhere_have_to_be_allowed(folders: Path, name: str) -> None:
    (folders / "mine/a.toml").write_text(with_points(name))
    with pytest.raises(
        ScenarioError, match=r"task\.points: .*lies outside the scenario's folder; --allow-outside-files"
    ):
        read_scenario(folders / "mine/a.toml")
    with pytest.raises(ScenarioError, match="outside"):
        load_all([str(folders / "mine/a.toml")])
    if "way" in name or "link" in name:
        assert len(load(str(folders / "mine/a.toml"), outside_allowed=True).task.points) == 3  # type: ignore[attr-defined]


def test_the_content_of_a_file_is_not_told(folders: Path) -> None:
    (folders / "mine/secret.csv").write_text("root:$6$secret\n")
    (folders / "mine/a.toml").write_text(with_points("secret.csv"))
    with pytest.raises(ScenarioError) as caught:
        read_scenario(folders / "mine/a.toml")
    assert "$6$" not in str(caught.value) and "line 1" in str(caught.value)


def test_labels_can_be_shown(folders: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folders / "mine")
    for name in ("\udcff.toml", "a\nb.toml"):
        Path(name).write_text(with_points("deep/way.csv"))
    assert list(load_all(["\udcff.toml", "a\nb.toml"])) == ["\\udcff", "a\\nb"]


def read(folder: Path, text: str) -> list[list[float]]:
    (folder / "path.csv").write_text(text)
    return read_joint_rows(InputFolder(folder), "path.csv").positions


def test_waypoints_recordings_and_tables_of_runs_are_read(tmp_path: Path) -> None:
    assert read(tmp_path, "q1,q2\n0,1\n\n 0.5 , -1e-1\n") == [[0.0, 1.0], [0.5, -0.1]]
    assert read(tmp_path, "t,q1\n0,1\n0.1,1\n0.2,2\n") == [[1.0], [2.0]]  # without where nothing moves
    table = "t,q1,q2,qd1,qd2,qdd1,qdd2,x,y\n0,1,2,0,0,0,0,0,0\n1,3,4,0,0,0,0,0,0\n"
    assert read(tmp_path, table) == [[1, 2], [3, 4]]


def test_more_rows_than_are_passed_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tpbso_casadi.scenario.path_tasks.MOST_ROWS", 3)
    rows, arm = [[0.1 * row] * 2 for row in range(4)], tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0))
    with pytest.raises(ScenarioError, match="4 rows, of at most 3; more are for interpolation = 'fit'"):
        tp.retime(rows, arm)
    assert tp.retime(rows, arm, interpolation="fit", tolerance=1e-3).certified

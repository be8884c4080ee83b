"""``tpbso certify FOLDER``: many trajectories at once, a table that is resumed, the same whatever the processes."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from helpers.recorded import ARM, write_rows
from helpers.running import status

from tpbso_casadi.cli.commands.certify import main
from tpbso_casadi.facade import certifying_many
from tpbso_casadi.facade.certifying_many import Judge


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    Path("many").mkdir()
    for name, seconds in (("a", 2.0), ("b", 0.5), ("c", 3.0)):
        write_rows(f"many/{name}.csv", seconds, columns=5)
    Path("many/d.yaml").write_text("no: trajectory\n")
    Path("many/notes.txt").write_text("not judged")


def run(*arguments: str) -> int:
    return status(main, "many", "--robot", "arm.toml", "--out", "out", *arguments)


def table(folder: str = "out") -> dict[str, dict[str, str]]:
    with Path(folder, "certificates.csv").open(newline="") as file:
        return {row["file"]: row for row in csv.DictReader(file)}


def test_every_file_has_its_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert run() == 1
    rows = table()
    assert {name: row["status"] for name, row in rows.items()} == {
        "a.csv": "certified", "b.csv": "violated", "c.csv": "certified", "d.yaml": "unreadable",
    }  # fmt: skip
    assert float(rows["a.csv"]["duration"]) == 2.0
    assert rows["b.csv"]["worst"].startswith("speed 3.75, limit 2 rad/s; joint 1, t = 0.25 s; first at ")
    assert rows["b.csv"]["broken"] == "speed; acceleration"
    assert rows["d.yaml"]["reason"].startswith("many/d.yaml: no JointTrajectory with joint_names and points is in it")
    out = capsys.readouterr().out
    assert out.startswith("2 certified, 1 violated, 1 unreadable\n")
    assert out.index("b.csv") < out.index("a.csv")
    for name in ("b.csv", "d.yaml"):
        Path("many", name).unlink()
    assert run("--quiet") == 0


def test_what_was_judged_is_not_judged_again_and_the_robot_is_built_once(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    judged: list[str] = []
    motion = Judge.motion
    monkeypatch.setattr(Judge, "motion", lambda self, file: (judged.append(file.name), motion(self, file))[1])
    built: list[int] = []
    scene = certifying_many.Scenario.built
    monkeypatch.setattr(certifying_many.Scenario, "built", lambda self: (built.append(1), scene(self))[1])
    assert run("--quiet") == 1
    assert built == [1]
    before = table()
    assert judged == ["a.csv", "b.csv", "c.csv", "d.yaml"]
    text = Path("out/certificates.csv").read_text()
    Path("out/certificates.csv").write_text(text[: text.index("c.csv") + 9])  # stopped while it was written
    write_rows("many/a.csv", 1.8, columns=5)
    judged.clear()
    assert run("--quiet") == 1
    assert judged == ["a.csv", "c.csv", "d.yaml"]
    assert table()["b.csv"] == before["b.csv"]
    assert float(table()["a.csv"]["duration"]) == 1.8
    judged.clear()
    assert run("--payload", "0", "--interpolation", "cubic", "--quiet") == 1  # judged by something else
    assert judged == ["a.csv", "b.csv", "c.csv", "d.yaml"]
    capsys.readouterr()
    assert run("--json") == 1
    rows = json.loads(capsys.readouterr().out)["certificates"]
    assert [row["file"] for row in rows] == ["a.csv", "b.csv", "c.csv", "d.yaml"]


def test_what_is_left_out_stands_beside_every_status(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--without", "speed", "--without", "acceleration") == 1  # d.yaml is unreadable
    rows = table()
    assert {row["status"] for name, row in rows.items() if name != "d.yaml"} == {"certified"}
    assert {row["assumed"] for row in rows.values()} == {"", "without a verdict on speed, acceleration"}
    assert capsys.readouterr().out.startswith("3 certified without a verdict on speed, acceleration, 1 unreadable\n")
    assert run("--quiet") == 1  # judged by all limits again
    assert table()["b.csv"]["status"] == "violated"


def test_a_table_among_the_trajectories_is_none_of_them() -> None:
    for _ in range(2):
        assert run("--out", "many", "--quiet") == 1
    assert "certificates.csv" not in table("many")


@pytest.mark.process
def test_processes_change_nothing() -> None:
    assert run("--quiet") == 1
    assert run("--quiet", "--processes", "2", "--out", "two") == 1
    for one, other in zip(table().values(), table("two").values(), strict=True):
        assert one | {"seconds": ""} == other | {"seconds": ""}

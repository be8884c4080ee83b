"""Certificates of a folder of trajectories: a table that is resumed, the same whatever the processes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.recorded import ARM, write_rows
from helpers.running import status

from tpbso_casadi.cli.commands.certify import main
from tpbso_casadi.facade import certifying_many
from tpbso_casadi.facade.certifying import surrounding_scenario
from tpbso_casadi.facade.certifying_many import (
    TABLE,
    Certificate,
    CertificateTable,
    Judge,
    Statement,
    trajectory_files,
)
from tpbso_casadi.facade.surroundings import given_keys


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("arm.toml").write_text(ARM)
    Path("many").mkdir()
    for name, seconds in (("a", 2.0), ("b", 0.5), ("c", 3.0)):
        write_rows(f"many/{name}.csv", seconds, columns=5)
    Path("many/d.yaml").write_text("no: trajectory\n")
    Path("many/notes.txt").write_text("not judged")


def judged(out: str = "out", processes: int = 1, payload: float | None = None, **task: Any) -> dict[str, Certificate]:
    statement = Statement(surrounding_scenario(Path("arm.toml"), None, payload), given_keys(task))
    table = CertificateTable(Path(out, TABLE), statement)
    return {each.file: each for each in table.judged(trajectory_files(Path("many")), processes)}


def test_every_file_has_its_certificate() -> None:
    found = judged()
    assert {name: each.status for name, each in found.items()} == {
        "a.csv": "certified", "b.csv": "violated", "c.csv": "certified", "d.yaml": "unreadable",
    }  # fmt: skip
    assert found["a.csv"].duration == 2.0
    assert found["b.csv"].worst.startswith("speed 3.75, limit 2 rad/s; joint 1, t = 0.25 s; first at ")
    assert found["b.csv"].broken == "speed; acceleration"
    assert found["d.yaml"].reason.startswith("many/d.yaml: no JointTrajectory with joint_names and points is in it")


def test_what_numbers_look_like_is_said_of_every_file(capsys: pytest.CaptureFixture[str]) -> None:
    write_rows("many/c.csv", 3000.0, columns=5)  # ms
    assert "ms" in judged()["c.csv"].notes
    assert not judged()["a.csv"].notes
    assert status(main, "many", "--robot", "arm.toml", "--out", "more") == 1
    assert "1 of 4: " in capsys.readouterr().out


def test_what_was_judged_is_not_judged_again_and_the_robot_is_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    files: list[str] = []
    motion, scene, built = Judge.motion, certifying_many.Scenario.built, []
    monkeypatch.setattr(Judge, "motion", lambda self, file: (files.append(file.name), motion(self, file))[1])
    monkeypatch.setattr(certifying_many.Scenario, "built", lambda self: (built.append(1), scene(self))[1])
    before = judged()
    assert built == [1]
    assert files == ["a.csv", "b.csv", "c.csv", "d.yaml"]
    text = Path("out", TABLE).read_text()
    Path("out", TABLE).write_text(text[: text.index("c.csv") + 9])  # stopped while it was written
    write_rows("many/a.csv", 1.8, columns=5)
    files.clear()
    found = judged()
    assert files == ["a.csv", "c.csv", "d.yaml"]
    assert found["b.csv"] == before["b.csv"]
    assert found["a.csv"].duration == 1.8
    files.clear()
    again = judged(payload=0.0, interpolation="cubic")  # judged by something else
    assert files == list(again) == ["a.csv", "b.csv", "c.csv", "d.yaml"]


def test_what_is_left_out_stands_beside_every_status() -> None:
    found = judged(without=["speed", "acceleration"])
    assert {each.status for name, each in found.items() if name != "d.yaml"} == {"certified"}
    assert {each.assumed for each in found.values()} == {"", "without a verdict on speed, acceleration"}
    assert judged()["b.csv"].status == "violated"  # by all limits again


@pytest.mark.process
def test_processes_change_nothing() -> None:
    for one, other in zip(judged().values(), judged("two", processes=2).values(), strict=True):
        assert vars(one) | {"seconds": 0.0} == vars(other) | {"seconds": 0.0}

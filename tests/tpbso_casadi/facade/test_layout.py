"""``tp.layout`` and ``tpbso layout``: searched, planned, written, gone on with, and refused in one line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from helpers.running import refusal, status

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.layout import main

EXAMPLE = (Path(__file__).parents[3] / "examples" / "place-the-robot.toml").resolve()
FREE = {"pedestal": {"x": (-0.1, 0.1), "y": (-0.1, 0.1)}}


@pytest.fixture(scope="module")
def found() -> tp.Layouts:
    return tp.layout(EXAMPLE, free=FREE, evaluations=8, finalists=1, workers=1)


def test_the_best_is_certified_and_as_fast_as_the_search_counted(found: tp.Layouts) -> None:
    assert found.is_certified and found.plan.certified
    assert found.plan.duration == found.best.seconds == pytest.approx(found.best.least, rel=0.02)
    assert repr(found).startswith("<best of 8 layouts, of which ")
    (row, *_) = found.table
    assert row[0] == f"{found.plan.duration:.4f}" and row[2].startswith("pedestal: x ")


def test_what_is_written_can_be_planned_again(found: tp.Layouts, tmp_path: Path) -> None:
    folder = found.save(tmp_path / "run", figures=False)
    names = {path.name for path in folder.iterdir()}
    assert {"layout.json", "evaluations.jsonl", "layout-1.toml", "best"} <= names
    summary = json.loads((folder / "layout.json").read_text())
    assert summary["finalists"][0]["seconds"] == found.plan.duration
    again = tp.bound(folder / "layout-1.toml")
    assert again.seconds == pytest.approx(found.best.least, rel=2e-3)
    assert tp.read_run(folder / "best").duration == pytest.approx(found.plan.duration)


def test_a_map_has_a_figure(found: tp.Layouts, tmp_path: Path) -> None:
    drawn = found.map("pedestal", points=2)
    assert drawn.seconds.shape == (2, 2) and list(drawn.x) == [-0.1, 0.1]
    found.show_map(drawn, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 1_000
    with pytest.raises(tp.ScenarioError, match=r"map: of pedestal, whose x and y are free, not of 'bin'"):
        found.map("bin")


def test_the_command_writes_goes_on_and_refuses(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.chdir(tmp_path)
    text = EXAMPLE.read_text()
    head, rest = text.split("[[layout.free]]", 1)
    free = '[[layout.free]]\nplace = "pedestal"\nx = [-0.1, 0.1]\ny = [-0.1, 0.1]\n\n[task]'
    Path("cell.toml").write_text(head + free + rest.split("[task]", 1)[1])
    options = "cell.toml", "--finalists", "1", "--workers", "1", "--out", "found"
    assert status(main, *options, "--evaluations", "4", "--no-plots") == 0
    printed = capsys.readouterr().out
    assert "pedestal: x" in printed and "best of 4 layouts" in printed and "written to found" in printed
    assert refusal(capsys, main, *options).startswith("found: holds the evaluations")
    assert status(main, *options, "--evaluations", "6", "--resume", "--no-plots", "-q") == 0
    assert len(Path("found/evaluations.jsonl").read_text().splitlines()) == 1 + 6
    other = Path("cell.toml").read_text().replace("y = [-0.1, 0.1]", "y = [-0.1, 0.2]")
    Path("other.toml").write_text(other)
    line = refusal(capsys, main, "other.toml", *options[1:], "--resume")
    assert "found/evaluations.jsonl: of another cell" in line
    assert "map: of pedestal" in refusal(capsys, main, *options[:-1], "third", "--map", "bin")
    before, after = text.split("[layout]", 1)
    Path("none.toml").write_text(before + "[task]" + after.split("[task]", 1)[1])
    assert "layout: missing key" in refusal(capsys, main, "none.toml")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"what": 3}, "what: the file of a scenario"),
        ({"free": [1]}, "free: "),
        ({"free": {"shelf": {"x": (0.0, 1.0)}}}, "no frame is called 'shelf'"),
        ({"free": {"bin": {"x": (1.0, 0.0)}}}, "free.0.x: the first number"),
        ({"apart": [("bin", 0.1)]}, "apart: "),
        ({"workers": "two"}, "workers: a whole number"),
        ({"evaluations": -1}, "evaluations: "),
    ],
)
def test_wrong_arguments_get_one_line(arguments: dict[str, Any], line: str) -> None:
    with pytest.raises(tp.ScenarioError, match=line):
        tp.layout(**({"what": EXAMPLE} | arguments))

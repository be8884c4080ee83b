"""``tpbso pareto``, run for real: its files, its errors, and that it resumes."""

from __future__ import annotations

import csv
import json
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import refusal, status
from helpers.scenes import SWING, TWO_LINKS, toml

from tpbso_casadi.cli.commands.pareto import main
from tpbso_casadi.plain import SEAL, as_json
from tpbso_casadi.storage import read_run, sealed

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def scene(model: dict[str, Any] | None = None, solver: dict[str, Any] | None = None, **tables: Any) -> str:
    model = {"samples": 20, "retime": False} | (model or {})
    solver = {"evaluations": 200, "polish_starts": 1} | (solver or {})
    return toml(arm=TWO_LINKS, task=SWING | {"elbow": "up"}, model=model, solver=solver, **tables)


SCENARIO = "two.toml"
COMMAND = [SCENARIO, "--objectives", "time,length", "--points", "3", "--no-plots", "--quiet", "--out", "front"]


@pytest.fixture(autouse=True)
def scenario(in_an_empty_folder: None) -> None:
    Path(SCENARIO).write_text(scene())


def run(*arguments: str) -> int:
    return status(main, *arguments)


def rows(folder: str = "front") -> list[dict[str, str]]:
    """``front.csv`` without what depends on the machine."""
    with Path(folder, "front.csv").open(newline="") as file:
        return [{k: v for k, v in row.items() if k != "seconds"} for row in csv.DictReader(file)]


def values(table: list[dict[str, str]], standing: str = "front") -> np.ndarray:
    chosen = [row for row in table if row["standing"] == standing]
    return np.array([[float(row["time [s]"]), float(row["length [m]"])] for row in chosen])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the command, in a folder of its own."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        Path(SCENARIO).write_text(scene())
        assert run(*COMMAND) == 0
    return folder / "front"


@pytest.fixture
def complete(made: Path) -> list[dict[str, str]]:
    """The rows of the folder, of which there is a copy here."""
    shutil.copytree(made, "front")
    return rows()


def test_what_it_leaves_is_resumed_and_then_nothing_is_left_to_do(
    complete: list[dict[str, str]], capsys: pytest.CaptureFixture[str]
) -> None:
    first, manifest = Path("front", complete[0]["folder"], "result.json"), Path("front/front.json")
    before = first.stat().st_mtime_ns
    content = json.loads(manifest.read_text())
    del content[SEAL]
    del content["methods"]["epsilon-constraint"]["points"][3:]  # stopped after three points
    manifest.write_text(as_json(sealed(content)))
    assert run(*(part for part in COMMAND if part != "--quiet")) == 0
    said = capsys.readouterr()
    assert "written to front" in said.out and "epsilon-constraint" in said.out
    assert {path.name for path in Path("front").iterdir()} == {
        "front.csv", "front.json", "methods.csv", "points"
    }  # fmt: skip
    table = rows()
    assert table == complete and first.stat().st_mtime_ns == before
    assert [row["point"] for row in table] == [str(n) for n in range(1, len(table) + 1)]
    front = np.array(sorted(values(table).tolist()))
    assert len(front) >= 3 and (np.diff(front[:, 1]) < 0.0).all()
    for row in table:
        stored = read_run(Path("front", row["folder"]))  # which audits it
        assert stored.motion.feasible == (row["certified"] == "yes")
        assert stored.motion.trajectory.duration == float(row["time [s]"]) == float(row["duration [s]"])
        bound = stored.scenario.task.total_time
        assert bound is None or float(row["time [s]"]) <= bound[1]
    with Path("front/methods.csv").open(newline="") as file:
        [method] = csv.DictReader(file)
    assert method["points"] == str(len(table)) and float(method["hypervolume [s m]"]) > 0.0
    assert method["evaluations"] == str(200 * len(table))
    before_again = manifest.read_bytes()
    assert run(*COMMAND) == 0
    assert manifest.read_bytes() == before_again and capsys.readouterr().out == ""


@pytest.mark.process
@pytest.mark.parametrize("stop", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_stopped_in_the_middle_it_goes_on(stop: signal.Signals, made: Path) -> None:
    shown = [part for part in COMMAND if part != "--quiet"]
    command = [sys.executable, "-m", "tpbso_casadi", "pareto", *shown]
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        for line in process.stderr:
            if line.startswith("point 3: time"):
                break
        process.send_signal(stop)
        errors = process.communicate(timeout=120.0)[1]
    if stop is signal.SIGINT:
        assert process.returncode == 130
        assert errors.splitlines()[-1].startswith("error: interrupted; ")
        assert errors.splitlines()[-1].endswith(" points complete, in front, and the same command resumes")
        assert len(rows()) >= 3
    assert run(*COMMAND) == 0
    assert rows() == rows(str(made))


def test_another_scenario_or_setting_is_refused(
    complete: list[dict[str, str]], capsys: pytest.CaptureFixture[str]
) -> None:
    ways_out = "say --overwrite, or another folder"
    for changes, reason in (
        (["--seed", "2"], "scenario.solver.seed = 1, not 2"),
        (["--points", "5"], "points = 3, not 5"),
        (["--objectives", "time,rotation"], "objectives = ['time', 'length'], not ['time', 'rotation']"),
    ):
        assert refusal(capsys, main, *COMMAND, *changes) == f"front: was made with {reason}; {ways_out}"
    folder = Path("front", complete[0]["folder"])
    mine = folder / "mine.txt"
    mine.write_text("mine")
    assert "mine.txt" in refusal(capsys, main, *COMMAND, "--seed", "2", "--overwrite")
    assert rows() == complete
    mine.unlink()
    (folder / "trajectory.csv").rename("front/elsewhere.csv")
    (folder / "result.json").write_text("{}")
    assert refusal(capsys, main, *COMMAND) == f"{folder}: is gone, or was changed; {ways_out}"
    path = Path("front/front.json")
    path.write_text(path.read_text().replace('"number": 1', '"number": 7'))
    assert "was changed after the file was written" in refusal(capsys, main, *COMMAND)
    path.write_text("[]")
    assert refusal(capsys, main, *COMMAND) == "front/front.json: not of a trade-off"


def test_overwriting_leaves_nothing_of_before(complete: list[dict[str, str]]) -> None:
    command = [*COMMAND, "--objectives", "length,rotation", "--method", "nsga2", "--points", "2", "--overwrite"]
    Path("front/front.png").write_text("of before")
    assert run(*command) == 0
    assert not Path("front/front.png").exists()
    assert {row["method"] for row in rows()} == {"nsga2"}
    assert list(Path("front/points").iterdir()) == []


@pytest.mark.slow
def test_where_there_is_no_plan_what_there_is_is_written(capsys: pytest.CaptureFixture[str]) -> None:
    Path(SCENARIO).write_text(scene(obstacles=[{"shape": "box", "center": [0.0, 0.9], "size": [6.0, 0.3]}]))
    assert run(*COMMAND) == 1
    assert capsys.readouterr().err.startswith("error: no certified plan for an end of the front")
    [row] = rows()
    assert row["standing"] == "not certified" and Path("front", row["folder"], "result.json").exists()


@pytest.mark.slow
def test_weighted_sums_and_nsga2_beside_each_other() -> None:
    command = [*COMMAND, "--objectives", "rotation,length", "--points", "2"]
    assert run(*command, "--method", "nsga2") == 0
    assert run(*command) == 0
    table = rows()
    assert {row["method"] for row in table} == {"weighted-sum", "nsga2"}
    assert all(row["certified"] == "yes" for row in table if row["standing"] == "front")
    with Path("front/methods.csv").open(newline="") as file:
        volumes = {row["method"]: float(row["hypervolume [rad m]"]) for row in csv.DictReader(file)}
    assert volumes["weighted-sum"] > 0.0

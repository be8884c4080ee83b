"""The command line, run for real: what it leaves, what it says, how it ends."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from oracles.csv_checker import check_run

from solvers import SOLVERS
from tpbso_casadi import parse_scenario
from tpbso_casadi.cli.commands.solve import main
from tpbso_casadi.planning import plan
from tpbso_casadi.scenario.cases import TITLES

COMMAND = [sys.executable, "-m", "tpbso_casadi.solve"]
SCENARIO = """
[arm]
link_lengths = [1.0, 0.8, 0.7]
max_speed = 4.0
max_acceleration = 20.0
{arm}
[task]
kind = "point-to-point"
start = [1.0, 0.0]
goal = [0.5, 1.5]
{task}
{rest}
"""
OVAL = "[[obstacles]]\ncenter = {center}\nsemi_axes = [0.15, 0.25]\n"


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def scenario(name: str = "mine.toml", arm: str = "", task: str = "", rest: str = "") -> str:
    Path(name).write_text(SCENARIO.format(arm=arm, task=task, rest=rest))
    return name


def run(*arguments: str) -> int:
    """The exit status of the command line, run in this process."""
    try:
        return int(main([*arguments]))
    except SystemExit as end:
        return int(end.code or 0)


ALL = [(case, solver) for case in TITLES for solver in SOLVERS]
IN_BRIEF = [pair for number, pair in enumerate(ALL) if number % 4 == 0]  # every case, and every solver


@pytest.mark.parametrize(
    ("case", "solver"), [pair if pair in IN_BRIEF else pytest.param(*pair, marks=pytest.mark.slow) for pair in ALL]
)
def test_every_case_with_every_solver_in_the_reduced_form(case: str, solver: str) -> None:
    quick = ["--evaluations", "5000", "--no-plots", "--quiet", "--out", "out", "--formulation", "reduced"]
    assert run(case, "--solver", solver, *quick) == 0
    result = check_run(Path("out"))
    assert result["feasible"]
    assert result["evaluations"] == 5000
    assert all(constraint["satisfied"] for constraint in result["constraints"])


@pytest.mark.slow
@pytest.mark.parametrize("objective", ["time", "rotation"])
@pytest.mark.parametrize("links", [2, 3, 4, 5, 7])
@pytest.mark.parametrize("solver", SOLVERS)
def test_any_number_of_links_in_the_paper_form(solver: str, links: int, objective: str) -> None:
    quick = ["--no-plots", "--quiet", "--out", "out"]
    assert run("--solver", solver, "--links", str(links), "--objective", objective, *quick) == 0
    check_run(Path("out"))


@pytest.mark.slow
@pytest.mark.parametrize("case", [name for name in TITLES if not name.startswith(("time", "rotation"))])
@pytest.mark.parametrize("solver", SOLVERS)
def test_obstacles_and_paths_in_the_paper_form(solver: str, case: str) -> None:
    assert run(case, "--solver", solver, "--no-plots", "--quiet", "--out", "out") == 0
    check_run(Path("out"))


def test_what_a_newcomer_gets() -> None:
    done = subprocess.run(COMMAND, capture_output=True, text=True, check=True)
    folder = Path("runs/time-3-abso-1")
    assert sorted(path.name for path in folder.iterdir()) == [
        "convergence.png",
        "joints.png",
        "limits.png",
        "path.png",
        "result.json",
        "trajectory.csv",
    ]
    assert "holds" in done.stdout
    assert str(folder) in done.stdout
    assert done.stderr == ""
    check_run(folder)


def test_figures_are_pictures() -> None:
    assert run("pentagram-time", "--evaluations", "3000", "--formulation", "reduced", "--quiet", "--out", "out") == 0
    pictures = {path.stem: path.read_bytes() for path in Path("out").glob("*.png")}
    assert set(pictures) == {"accuracy", "convergence", "joints", "limits", "path", "redundancy"}
    assert all(content.startswith(b"\x89PNG") and len(content) > 10_000 for content in pictures.values())


def test_json_goes_alone_to_standard_output() -> None:
    done = subprocess.run(
        [*COMMAND, "--solver", "bso", "--json", "--evaluations", "2000"], capture_output=True, text=True, check=False
    )
    result = json.loads(done.stdout)
    assert done.returncode == (0 if result["feasible"] else 1)
    assert result["solver"]["settings"]["lambda_"] == 0.95
    assert result["stop_reason"] == "evaluations"
    assert not list(Path().iterdir())


def test_quiet_says_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    assert run("rotation-2", "--quiet", "--no-plots", "--evaluations", "2000") == 0
    assert capfd.readouterr() == ("", "")


def test_lists_and_overview(capfd: pytest.CaptureFixture[str]) -> None:
    assert run("--list") == 0
    output = capfd.readouterr().out
    assert all(name in output for name in TITLES)
    overview = subprocess.run([sys.executable, "-m", "tpbso_casadi"], capture_output=True, text=True, check=True)
    assert "tpbso_casadi solve" in overview.stdout


def outcome(folder: str, *arguments: str) -> tuple[dict[str, object], str]:
    assert run("time-2", "--evaluations", "3000", "--no-plots", "--quiet", "--out", folder, *arguments) == 0
    result = json.loads((Path(folder) / "result.json").read_text())
    del result["seconds"], result["polish"]["seconds"], result["seal"]
    return result, (Path(folder) / "trajectory.csv").read_text()


def test_same_seed_same_files_other_seed_others() -> None:
    first, again, other = outcome("a"), outcome("b"), outcome("c", "--seed", "2")
    assert first == again
    assert first[1] != other[1]
    assert first[0]["seed"] == 1


def test_a_result_can_be_run_again() -> None:
    result, trajectory = outcome("a", "--elbow", "free", "--seed", "3")
    Path("again.json").write_text(json.dumps(result["scenario"]))
    again = plan(parse_scenario(json.loads(Path("again.json").read_text())))
    assert again.objective == result["objective"]["value"]  # type: ignore[index]
    assert trajectory.count("\n") == len(again.times) + 1


def test_a_scenario_file_with_everything() -> None:
    name = scenario(
        arm="joint_limits = [[-3.0, 3.0], [-2.5, 2.5], [-2.6, 2.6]]",
        task='objective = "length"\nelbow = "free"',
        rest=OVAL.format(center="[0.8, 0.8]") + '[model]\nformulation = "reduced"\n[solver]\nname = "pso"\nseed = 2\n',
    )
    assert run(name, "--no-plots", "--quiet") == 0
    result = check_run(Path("runs/mine-pso-2"))
    assert [c["name"] for c in result["constraints"]][:4] == ["speed", "acceleration", "joint range", "clearance"]


def letter(count: int) -> str:
    """An S, as written by hand."""
    s = np.linspace(0.0, 1.0, count)
    x = 0.9 + 0.35 * np.sin(4.4 * s + 0.4) + 0.02 * np.sin(40.0 * s)
    return "\n".join(f"{a},{b}" for a, b in zip(x, 0.9 * s + 0.1, strict=True))


@pytest.mark.parametrize("links", [3, pytest.param(5, marks=pytest.mark.slow)])
def test_a_letter_of_200_points_is_followed(links: int) -> None:
    Path("letter.csv").write_text("x,y\n" + letter(200))
    Path("letter.toml").write_text(
        f"[arm]\nlink_lengths = {[2.1 / links] * links}\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
        '[task]\nkind = "path"\naccuracy = 0.01\npoints = "letter.csv"\n[model]\nformulation = "reduced"\n'
    )
    assert run("letter.toml", "--evaluations", "1500", "--no-plots", "--quiet", "--out", "out") == 0
    check_run(Path("out"))


def test_an_accuracy_that_nothing_met_is_said_and_written(capfd: pytest.CaptureFixture[str]) -> None:
    Path("way.csv").write_text("1,0\n1,1\n0,1.5\n-1,1\n-1,0.2")
    Path("way.toml").write_text(
        "[arm]\nlink_lengths = [1.0, 1.0, 1.0]\nmax_speed = 4.0\nmax_acceleration = 20.0\n"
        '[task]\nkind = "path"\naccuracy = 1e-6\npoints = "way.csv"\ncount = 40\n'
        '[model]\nmotion = "paper"\n'
    )
    assert run("way.toml", "--evaluations", "500", "--no-plots", "--quiet", "--out", "out") == 1
    output = capfd.readouterr().err
    assert output.count("\n") == 1
    assert "accuracy is" in output
    assert "1e-06 is the limit" in output
    result = json.loads(Path("out/result.json").read_text())
    assert result["feasible"] is False
    assert not next(c for c in result["constraints"] if c["name"] == "accuracy")["satisfied"]


FILES = {
    "unknown key": {"task": "colour = 3"},
    "wrong type": {"task": "elbow = 3"},
    "start in an obstacle": {"rest": OVAL.format(center="[1.0, 0.1]")},
    "base in an obstacle": {"rest": OVAL.format(center="[0.1, 0.1]")},
    "bad number": {"task": "segment_time = [nan, 4.0]"},
    "infinite": {"task": "segment_time = [0.1, inf]"},
    "joint limits": {"arm": "joint_limits = [[0.0, 1.0]]"},
    "budget of zero": {"rest": "[solver]\nevaluations = 0"},
    "solver": {"rest": '[solver]\nname = "bos"'},
}


def refused(capfd: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line with which a command is refused; nothing is left behind."""
    before = sorted(Path().rglob("*"))
    assert run(*arguments) == 2
    output = capfd.readouterr()
    assert output.out == ""
    assert output.err.startswith("error: ")
    assert output.err.count("\n") == 1
    assert sorted(Path().rglob("*")) == before
    return output.err


@pytest.mark.parametrize("parts", FILES.values(), ids=FILES)
def test_a_bad_file_is_refused(parts: dict[str, str], capfd: pytest.CaptureFixture[str]) -> None:
    assert "mine.toml: " in refused(capfd, scenario(**parts))


OPTIONS = {
    "population": (["--solver", "bso", "--population", "1"], "at least 2"),
    "iterations": (["--iterations", "0"], "not positive"),
    "evaluations": (["--evaluations", "-5"], "not positive"),
    "seconds": (["--time-limit", "nan"], "not a positive number"),
    "seed": (["--seed", "-1"], "negative"),
    "links": (["--links", "1"], "link"),
    "solver": (["--solver", "bos"], "did you mean bso"),
    "plug-in": (["--solver", "nowhere:Nothing"], "cannot load"),
    "option": (["--colour", "red"], "--colour"),
    "choice": (["--objective", "beauty"], "beauty"),
    "links of a path": (["pentagram-time", "--links", "2"], "at least 3 links"),
    "polish of ipopt": (["--solver", "ipopt", "--polish"], "nothing to polish"),
    "missing file": (["missing.toml"], "No such file"),
    "not a name": (["missing"], "--list"),
    "folder": (["."], "."),
    "below a file": (["--out", "taken/out"], "is a file"),
    "a file": (["--out", "taken"], "is a file"),
    "not writable": (["--out", "/proc/nowhere"], "cannot be written"),
}


@pytest.mark.parametrize(("arguments", "expected"), OPTIONS.values(), ids=OPTIONS)
def test_bad_options_are_refused(arguments: list[str], expected: str, capfd: pytest.CaptureFixture[str]) -> None:
    Path("taken").write_text("mine")
    assert expected in refused(capfd, *arguments)


@pytest.mark.parametrize("content", [b"not = = toml", b"\xff\xfe\x00binary", b""], ids=["not TOML", "binary", "empty"])
def test_a_file_that_is_no_scenario_is_refused(content: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    Path("odd.toml").write_bytes(content)
    assert "odd.toml" in refused(capfd, "odd.toml")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anything")
def test_an_unreadable_file_is_refused(capfd: pytest.CaptureFixture[str]) -> None:
    Path(scenario()).chmod(0)
    assert "cannot be read" in refused(capfd, "mine.toml")


def test_written_numbers_lose_nothing() -> None:
    outcome("a")
    result = json.loads(Path("a/result.json").read_text())
    last = Path("a/trajectory.csv").read_text().splitlines()[-1].split(",")
    assert float(last[0]) == result["objective"]["value"]
    assert all(math.isfinite(float(cell)) for cell in last)

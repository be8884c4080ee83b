"""What commands print and write: tables, the log, names of run folders, figures; the same plan by every backend."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import pytest
from helpers.evaluation import needs_compiler
from helpers.running import refusal, result_of
from helpers.scenes import SWING, TWO_LINKS, toml
from helpers.slow import slow_except

from problems.evaluation import BACKENDS, population
from tpbso_casadi.audit_report import audit_run
from tpbso_casadi.cli.command import LOGGERS, logged
from tpbso_casadi.cli.commands import audit, solve
from tpbso_casadi.scenario.cases import TITLES
from tpbso_casadi.storage import read_run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

QUICK = ["--evaluations", "500", "--no-plots", "--quiet", "--solver", "bso"]
POLISHED = ["time-2", "--evaluations", "500", "--polish", "--no-plots"]


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize("case", slow_except(["time-2", "obstacle-5", "pentagram-time"], 1))
def test_tables_fit_and_cut_nothing(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    Path("[red]").mkdir()
    solve.main([case, "--evaluations", "1000", "--no-plots", "--out", "[red]/[bold]out[/]"])
    audit.main(["[red]/[bold]out[/]"])
    audit.main([case])
    solve.main(["--list"])
    printed = capfd.readouterr().out
    lines = printed.splitlines()
    assert "written to [red]/[bold]out[/]\n" in printed  # names are not read as markup
    assert max(map(len, lines)) <= 100 and all(len(line) <= 80 for line in lines if "  " in line)
    assert not any("…" in line for line in lines) and set(TITLES) <= {line.split()[0] for line in lines if line.strip()}
    rows = [line for line in lines if re.match(r"(speed|acceleration|accuracy|clearance) +-?\d", line)]
    assert rows
    assert all(re.match(r"\w+ +-?[\d.e-]+  -?[\d.]+ \S+ ", row) for row in rows)


def test_a_plan_far_above_the_least_time_between_its_ends_says_by_how_much(capfd: pytest.CaptureFixture[str]) -> None:
    ends = {"start": {"joints": [0.0, 0.0]}, "goal": {"joints": [1.2, 0.0]}}
    wall = {"shape": "ellipse", "center": [1.1, 0.75], "semi_axes": [0.1, 0.1]}
    for obstacles, remark in (([wall], r"^\d\d+% above [\d.]+ s, the least time between its ends"), ([], None)):
        task = {"kind": "point-to-point", **ends}
        Path("move.toml").write_text(toml(arm=TWO_LINKS, task=task, obstacles=obstacles))
        assert solve.main(["move.toml", "--solver", "direct", "--no-plots", "--out", "out"]) == 0
        said = capfd.readouterr().out
        assert re.search(remark, said, re.MULTILINE) if remark else "the least time between" not in said


def test_joints_that_turn_more_than_once_and_plans_far_from_the_best_known_are_mentioned(
    capfd: pytest.CaptureFixture[str],
) -> None:
    task = {"kind": "joint-path", "joints": [[0.0, 0.0], [4.0, 0.5], [8.0, 0.0]]}
    Path("far.toml").write_text(toml(arm=TWO_LINKS, task=task))
    turns = r"^joint 1 turns [2-9]\.\d\d times; state joint_limits"
    above = r"^\d+% above the best plan known, 0\.322\d* s; try --polish, or --within 10$"
    for arguments, remark in (
        (["pentagram-time", "--evaluations", "1000"], turns),
        (["far.toml"], r"^joint 1 turns 1\.27 times; the joints that are given are 1\.27 turns apart"),
        (["time-5", "--solver", "bso", "--evaluations", "1000"], above),
        (["time-2"], None),
    ):
        solve.main([*arguments, "--no-plots", "--out", "out"])
        said = capfd.readouterr().out
        assert re.search(remark, said, re.MULTILINE) if remark else not re.search("turns|best plan known", said)


def test_v_says_what_is_done_and_how_long_it_took_and_changes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*POLISHED, "-v", "--out", "told"]) == 0
    printed = capsys.readouterr()
    lines = printed.err.splitlines()
    assert all(re.match(r"\d+ ms: ", line) for line in lines) and " ms: " not in printed.out
    said = [line.split(": ")[1] for line in lines]
    assert said[0] == "model" and said[-2:] == ["written", "tpbso solve"]
    assert said.index("search") < said.index("certificate") < said.index("written")
    assert said.index("search") < said.index("polish")
    assert re.search(r"search: 500 evaluations, \d+ iterations in \d+\.\d{3} s; stopped: evaluations\n", printed.err)
    assert re.search(r"certificate: 4 of 4 constraints proven for all t in \d+\.\d{3} s\n", printed.err)
    assert printed.err.endswith(" s\n") and ": exit status 0 after " in printed.err
    assert solve.main([*POLISHED, "-q", "-o", "silent"]) == 0
    assert capsys.readouterr() == ("", "")
    silent, told = (Path(folder, "trajectory.csv").read_bytes() for folder in ("silent", "told"))
    assert silent == told


def test_json_is_alone_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*POLISHED, "-vv", "-j"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["stop_reason"] == "evaluations" and not list(Path().iterdir())
    assert "tpbso_casadi.planning.progress: search: " in printed.err  # twice names the loggers
    assert re.search(r"\d+ ms: tpbso_casadi.cli.command: tpbso-casadi \S+, casadi ", printed.err)


def test_a_record_is_one_line_without_control_characters(capsys: pytest.CaptureFixture[str]) -> None:
    with logged(1):
        logging.getLogger("problems.evaluation").info("two\nlines \x1b[31m")
        logging.getLogger("problems.evaluation").debug("not at this level")
    logging.getLogger("problems.evaluation").info("nobody listens any more")
    assert re.fullmatch(r"\d+ ms: two lines \\x1b\[31m\n", capsys.readouterr().err)


def test_levels_and_handlers_are_as_before() -> None:
    before = [(logging.getLogger(name).level, list(logging.getLogger(name).handlers)) for name in LOGGERS]
    with pytest.raises(KeyError), logged(2):
        raise KeyError
    assert [(logging.getLogger(name).level, list(logging.getLogger(name).handlers)) for name in LOGGERS] == before


def folders(*arguments: str) -> list[str]:
    solve.main([*QUICK, *arguments])
    return sorted(path.name for path in Path("runs").iterdir())


def test_names_say_what_the_command_changes() -> None:
    assert folders("time-3") == folders("time-3") == ["time-3-bso-1-500-evaluations"]
    assert "time-3-bso-1-4-links-rotation-500-evaluations" in folders(
        "time-3", "--links", "4", "--objective", "rotation"
    )
    changed = ["--elbow", "down", "--formulation", "reduced", "--population", "20", "--iterations", "3", "--polish"]
    assert "time-2-bso-7-elbow-down-reduced-population-20-3-iterations-500-evaluations-polish" in folders(
        "time-2", "--seed", "7", *changed
    )


def test_another_plan_of_the_same_name_gets_a_number_and_what_is_no_run_is_left_alone() -> None:
    name = "mine-bso-1-500-evaluations"
    Path("runs", name).mkdir(parents=True)
    Path("runs", name, "notes.txt").write_text("mine")
    for number, speed in enumerate((4.0, 5.0, 4.0), start=1):
        Path("mine.toml").write_text(toml(arm=TWO_LINKS | {"max_speed": speed}, task=SWING))
        assert folders("mine.toml") == [name, f"{name}-2", f"{name}-3"][: min(number + 1, 3)]
    assert [path.name for path in Path("runs", name).iterdir()] == ["notes.txt"]


def held(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


@pytest.mark.usefixtures("only_the_path_is_drawn")
def test_solve_draws_each_format_and_the_audit_knows_it() -> None:
    drawn = ["time-2", "--evaluations", "500", "--quiet", "--solver", "bso", "--out", "run"]
    assert solve.main([*drawn, "--figures", "pdf,svg"]) == 0
    assert held("run") == {"path.pdf", "path.svg", "result.json", "trajectory.csv"}
    assert set(result_of("run")["files"]) == {"path.pdf", "path.svg", "trajectory.csv"}
    assert audit_run(read_run(Path("run")))["certificate"]["verdict"] == "certified"
    picture = Path("run/path.pdf").read_bytes()
    assert b"/Subtype /Image" not in picture and "<image" not in Path("run/path.svg").read_text()  # lines, not pixels
    Path("run/path.pdf").write_bytes(picture + b"% changed")
    assert audit.main(["run"]) == 2
    Path("run/path.pdf").write_bytes(picture)
    assert solve.main([*drawn, "--no-plots", "--figures", "pdf"]) == 0  # in place of the older run
    assert held("run") == {"result.json", "trajectory.csv"}


def test_audit_draws_the_structure_of_scenarios_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main(["time-2", "--plots", "drawn", "--figures", "png,pdf"]) == 0
    assert held("drawn") == {"structure.png", "structure.pdf"}
    assert "degrees of freedom" in capsys.readouterr().out


@needs_compiler
def test_a_plan_is_the_same_whatever_evaluates_it(cache_folder: Path) -> None:
    results = []
    for backend in BACKENDS:
        arguments = ["time-2", "--evaluations", "1000", "--no-plots", "--quiet", "--backend", backend, "--out", backend]
        assert solve.main([*arguments, "--threads", "2"]) == 0
        result = result_of(backend)
        del result["seconds"], result["polish"]["seconds"], result["seal"]
        results.append(result)
    assert results[0] == results[1] == results[2]


def test_a_backend_that_does_not_exist(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setenv(population.VARIABLE, "gpu")
    reason = "evaluation backend 'gpu' is none of auto, vm, native"
    assert refusal(capsys, solve.main, "time-2", "--json") == reason

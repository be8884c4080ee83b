"""What commands print and write: tables, the log, names of run folders, figures; the same plan by every backend."""

from __future__ import annotations

import json
import logging
import re
from pathlib import Path

import pytest
from helpers.evaluation import needs_compiler
from helpers.running import campaigns_here, refusal, result_of
from helpers.scenes import SWING, TWO_LINKS, toml
from helpers.slow import slow_except

from problems.evaluation import BACKENDS, population
from tpbso_casadi import builtin, parse_scenario
from tpbso_casadi.audit_report import audit_run
from tpbso_casadi.cli.command import LOGGERS, logged
from tpbso_casadi.cli.commands import audit, compare, solve
from tpbso_casadi.scenario.cases import BEST_KNOWN, TITLES, best_known
from tpbso_casadi.storage import read_run

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")

QUICK = ["--evaluations", "500", "--no-plots", "--quiet", "--solver", "bso"]
POLISHED = ["time-2", "--evaluations", "500", "--polish", "--no-plots"]


@pytest.fixture(autouse=True)
def eighty_columns(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")


@pytest.mark.parametrize("case", slow_except(["time-2", "obstacle-5", "pentagram-time"], 1))
def test_tables_fit_and_cut_nothing(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    solve.main([case, "--evaluations", "1000", "--no-plots", "--out", "out"])
    audit.main(["out"])
    audit.main([case])
    solve.main(["--list"])
    lines = capfd.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 100 and all(len(line) <= 80 for line in lines if "  " in line)
    assert not any("…" in line for line in lines) and set(TITLES) <= {line.split()[0] for line in lines if line.strip()}
    rows = [line for line in lines if re.match(r"(speed|acceleration|accuracy|clearance) +-?\d", line)]
    assert rows
    assert all(re.match(r"\w+ +-?[\d.e-]+  -?[\d.]+ \S+ ", row) for row in rows)


def test_joints_that_turn_more_than_once_and_plans_far_from_the_best_known_are_mentioned(
    capfd: pytest.CaptureFixture[str],
) -> None:
    turns = r"^joint 1 turns [2-9]\.\d\d times; state joint_limits"
    above = r"^\d+% above the best plan known, 0\.322\d* s; try --polish, or --within 10$"
    for arguments, remark in (
        (["pentagram-time", "--evaluations", "1000"], turns),
        (["time-5", "--solver", "bso", "--evaluations", "1000"], above),
        (["time-5", "--links", "6", "--solver", "bso", "--evaluations", "1000"], None),
        (["time-2"], None),
    ):
        solve.main([*arguments, "--no-plots", "--out", "out"])
        said = capfd.readouterr().out
        assert re.search(remark, said, re.MULTILINE) if remark else not re.search("turns|best plan known", said)


def test_joints_that_are_given_far_apart_are_no_surprise(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "far.toml"
    task = {"kind": "joint-path", "joints": [[0.0, 0.0], [4.0, 0.5], [8.0, 0.0]]}
    file.write_text(toml(arm=TWO_LINKS, task=task))
    solve.main([str(file), "--no-plots", "--out", "out"])
    assert "joint 1 turns 1.27 times; the joints that are given are 1.27 turns apart" in capfd.readouterr().out


def test_the_best_known_is_that_of_the_same_statement() -> None:
    assert set(BEST_KNOWN) == set(TITLES)
    for name, best in BEST_KNOWN.items():
        assert best_known(builtin(name)) == best
    content = builtin("time-3").table()
    assert best_known(parse_scenario(content | {"model": {"formulation": "reduced"}})) == BEST_KNOWN["time-3"]
    content["arm"]["max_speed"] = 5.0
    assert best_known(parse_scenario(content)) is None


def test_names_are_not_read_as_markup(capfd: pytest.CaptureFixture[str]) -> None:
    Path("[red]").mkdir()
    solve.main(["time-2", "--evaluations", "500", "--no-plots", "--out", "[red]/[bold]out[/]"])
    assert "written to [red]/[bold]out[/]" in capfd.readouterr().out


def subjects(errors: str) -> list[str]:
    """What the lines of a log are about; every line has its time."""
    lines = errors.splitlines()
    assert all(re.match(r"\d+ ms: ", line) for line in lines), errors
    return [line.split(": ")[1] for line in lines]


def test_v_says_what_is_done_and_how_long_it_took(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*POLISHED, "-v", "--out", "out"]) == 0
    printed = capsys.readouterr()
    said = subjects(printed.err)
    assert said[0] == "model" and said[-2:] == ["written", "tpbso solve"]
    assert said.index("search") < said.index("certificate") < said.index("written")
    assert said.index("search") < said.index("polish")
    assert re.search(r"search: 500 evaluations, \d+ iterations in \d+\.\d{3} s; stopped: evaluations\n", printed.err)
    assert re.search(r"certificate: 4 of 4 constraints proven for all t in \d+\.\d{3} s\n", printed.err)
    assert printed.err.endswith(" s\n") and ": exit status 0 after " in printed.err
    assert " ms: " not in printed.out


def test_json_is_alone_on_standard_output(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*POLISHED, "-vv", "-j"]) == 0
    printed = capsys.readouterr()
    assert json.loads(printed.out)["stop_reason"] == "evaluations" and not list(Path().iterdir())
    assert "tpbso_casadi.planning.progress: search: " in printed.err  # twice names the loggers
    assert re.search(r"\d+ ms: tpbso_casadi.cli.command: tpbso-casadi \S+, casadi ", printed.err)


def test_without_it_nothing_is_said_and_the_result_is_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    assert solve.main([*POLISHED, "-q", "-o", "silent"]) == 0
    assert capsys.readouterr() == ("", "")
    assert solve.main([*POLISHED, "-q", "-v", "-o", "told"]) == 0
    silent, told = (Path(folder, "trajectory.csv").read_bytes() for folder in ("silent", "told"))
    assert silent == told


def test_a_campaign_says_each_run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    campaigns_here(monkeypatch)
    arguments = ["time-2", "--solvers", "bso,pso", "--runs", "2", "--evaluations", "300", "--workers", "1"]
    assert compare.main([*arguments, "--no-plots", "-qv"]) == 0
    said = re.findall(r"run: (time-2, \w+, seed \d): done in", capsys.readouterr().err)
    assert sorted(said) == [f"time-2, {solver}, seed {seed}" for solver in ("bso", "pso") for seed in (1, 2)]


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


def test_another_plan_of_the_same_name_gets_a_number() -> None:
    for number, speed in enumerate((4.0, 5.0, 4.0), start=1):
        Path("mine.toml").write_text(toml(arm=TWO_LINKS | {"max_speed": speed}, task=SWING))
        expected = ["mine-bso-1-500-evaluations", "mine-bso-1-500-evaluations-2"][: min(number, 2)]
        assert folders("mine.toml") == expected


def test_what_is_no_run_is_left_alone() -> None:
    taken = Path("runs/time-2-bso-1-500-evaluations")
    taken.mkdir(parents=True)
    (taken / "notes.txt").write_text("mine")
    assert folders("time-2") == [taken.name, f"{taken.name}-2"]
    assert [path.name for path in taken.iterdir()] == ["notes.txt"]


DRAWN = ["time-2", *QUICK[:2], *QUICK[3:]]


def held(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


@pytest.mark.usefixtures("only_the_path_is_drawn")
def test_solve_draws_each_format_and_the_audit_knows_it() -> None:
    assert solve.main([*DRAWN, "--figures", "pdf,svg", "--out", "run"]) == 0
    assert held("run") == {"path.pdf", "path.svg", "result.json", "trajectory.csv"}
    assert set(result_of("run")["files"]) == {"path.pdf", "path.svg", "trajectory.csv"}
    assert audit_run(read_run(Path("run")))["certificate"]["verdict"] == "certified"
    picture = Path("run/path.pdf")
    before = picture.read_bytes()
    assert b"/Subtype /Image" not in before and "<image" not in Path("run/path.svg").read_text()  # lines, not pixels
    assert solve.main([*DRAWN, "--figures", "pdf", "--out", "run"]) == 0  # in place of the older run
    assert held("run") == {"path.pdf", "result.json", "trajectory.csv"} and picture.read_bytes() == before
    picture.write_bytes(before + b"% changed")
    assert audit.main(["run"]) == 2
    picture.write_bytes(before)
    assert solve.main([*DRAWN, "--no-plots", "--figures", "pdf", "--out", "run"]) == 0
    assert held("run") == {"result.json", "trajectory.csv"}


def test_audit_draws_the_structure_of_scenarios_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main(["time-2", "--plots", "drawn", "--figures", "png,pdf"]) == 0
    assert held("drawn") == {"structure.png", "structure.pdf"}
    assert "degrees of freedom" in capsys.readouterr().out
    Path("run").mkdir()
    reason = "--figures: an audit draws nothing by itself; say --plots DIR too"
    assert refusal(capsys, audit.main, "time-2", "--figures", "pdf") == reason
    reason = "--plots: run is a run, whose figures are made with it; say a scenario"
    assert refusal(capsys, audit.main, "run", "--plots", "drawn") == reason


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

"""``--figures``: figures in the formats that are asked for, listed with the run, and the same for the same plan."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tpbso_casadi.audit_report import audit_run
from tpbso_casadi.cli.commands import audit, retime, solve
from tpbso_casadi.storage import read_run

QUICK = ["time-2", "--evaluations", "500", "--quiet", "--solver", "bso"]
NAMES = ("path", "joints", "limits", "convergence")
ARM = """
[arm]
link_lengths = [0.5, 0.4]
max_speed = 2.0
max_acceleration = 8.0
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def held(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


def test_solve_draws_each_format_and_the_audit_knows_it() -> None:
    assert solve.main([*QUICK, "--figures", "pdf,svg", "--out", "run"]) == 0
    drawn = {f"{name}.{kind}" for name in NAMES for kind in ("pdf", "svg")}
    assert held("run") == drawn | {"result.json", "trajectory.csv"}
    assert set(json.loads(Path("run/result.json").read_text())["files"]) == drawn | {"trajectory.csv"}
    assert audit_run(read_run(Path("run")))["certificate"]["verdict"] == "certified"
    assert solve.main([*QUICK, "--figures", "pdf", "--out", "again"]) == 0
    for name in NAMES:
        assert Path(f"run/{name}.pdf").read_bytes() == Path(f"again/{name}.pdf").read_bytes()
    assert not [path for path in Path("run").glob("*.pdf") if b"/Subtype /Image" in path.read_bytes()]
    assert not [path for path in Path("run").glob("*.svg") if "<image" in path.read_text()]  # lines, not pixels
    with Path("run/path.svg").open("a") as file:
        file.write("<!-- changed -->")
    assert audit.main(["run"]) == 2


def test_an_older_run_with_other_formats_is_replaced() -> None:
    assert solve.main([*QUICK, "--figures", "svg", "--out", "run"]) == 0
    assert solve.main([*QUICK, "--no-plots", "--figures", "pdf", "--out", "run"]) == 0
    assert held("run") == {"result.json", "trajectory.csv"}


def test_retime_draws_too() -> None:
    Path("arm.toml").write_text(ARM)
    Path("path.csv").write_text("q1,q2\n0,0.2\n0.5,0.9\n1,0.4\n")
    assert retime.main(["path.csv", "--robot", "arm.toml", "--figures", "svg", "--out", "run", "--quiet"]) == 0
    assert {"path.svg", "joints.svg", "limits.svg"} <= held("run")


def test_audit_draws_the_structure(capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main(["time-2", "--plots", "drawn", "--figures", "png,pdf"]) == 0
    assert held("drawn") == {"structure.png", "structure.pdf"}
    capsys.readouterr()


def test_an_audit_says_what_it_would_not_draw(capsys: pytest.CaptureFixture[str]) -> None:
    assert audit.main(["time-2", "--figures", "pdf"]) == 2
    assert capsys.readouterr().err == "error: --figures: an audit draws nothing by itself; say --plots DIR too\n"
    Path("run").mkdir()
    assert audit.main(["run", "--plots", "drawn"]) == 2
    told = "error: --plots: run is a run, whose figures are made with it; say a scenario\n"
    assert capsys.readouterr().err == told
    assert held(".") == {"run"}


@pytest.mark.parametrize("text", ["jpg", "png,", "PDF", ""])
def test_a_format_that_there_is_not_is_named(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        solve.main([*QUICK, "--figures", text, "--out", "run"])
    assert stop.value.code == 2
    message = capsys.readouterr().err
    assert message.startswith("error: argument --figures: ") and "png, pdf, svg" in message
    assert message.count("\n") == 1 and not Path("run").exists()

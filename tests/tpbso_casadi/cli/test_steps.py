"""Steps of long work: a listener is told them; a terminal shows a bar after a second, other outputs lines."""

from __future__ import annotations

from pathlib import Path

import pytest

import tpbso_casadi as tp
from problems.base import listening, tell_step
from tpbso_casadi.cli import progress, steps
from tpbso_casadi.cli.progress import planning_progress
from tpbso_casadi.cli.steps import steps_shown


def work() -> None:
    for done in range(3):
        tell_step("covering links", done, 2)


def test_a_listener_is_told_every_step_and_nobody_is_without_one() -> None:
    told: list[tuple[str, int, int]] = []
    with listening(lambda *step: told.append(step)):
        work()
    work()
    assert told == [("covering links", done, 2) for done in range(3)]


@pytest.mark.parametrize(("terminal", "quiet"), [(True, False), (False, False), (True, True), (False, True)])
def test_long_work_shows_its_steps(
    terminal: bool, quiet: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(steps, "SHORT" if terminal else "INTERVAL", -1.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: terminal, raising=False)
    with steps_shown(quiet):
        work()
    shown = capsys.readouterr().err
    assert ("covering links" in shown) is not quiet
    assert quiet or terminal or shown == "covering links: 0 of 2\ncovering links: 1 of 2\ncovering links: 2 of 2\n"


def test_short_work_shows_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with steps_shown(False):
        work()
    assert not capsys.readouterr().err


@pytest.mark.parametrize("terminal", [True, False])
def test_steps_of_planning_and_saving_are_shown_where_planning_is(
    terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(progress, "INTERVAL", -1.0)
    monkeypatch.setattr(progress.OutputConsole, "is_terminal", terminal)
    arm, start = tp.PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0)), tp.Joints((0.1, 0.5))
    with planning_progress(None, quiet=False) as shown:
        plan = tp.sequence(arm, start=start, stages=[tp.Joints((0.9, 0.5)), start], progress=shown)
        plan.save(tmp_path / "run", figures=())
    told = capsys.readouterr().err
    assert terminal or all(f"{work}: 0 of 2\n" in told for work in ("postures", "proofs", "closest approach"))
    assert "writing" in told

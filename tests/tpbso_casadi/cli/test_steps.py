"""Steps of long work: a listener is told them; a terminal shows a bar after a second, other outputs lines."""

from __future__ import annotations

import pytest

from problems.base import listening, tell_step
from tpbso_casadi.cli import steps
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

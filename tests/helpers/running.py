"""Commands run in this process, what they leave, and the one line that they or a scenario are refused with."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from solvers.budget import Interruption
from tpbso_casadi.judging.executors import ExecutorFactory, in_process, processes
from tpbso_casadi.scenario import ScenarioError

REMOVED = object()  # instead of a value: the key is not there


def status(main: Callable[[list[str]], object], *arguments: str) -> int:
    """The exit status of a command."""
    try:
        ended = main([*arguments])
    except SystemExit as end:
        ended = end.code or 0
    assert isinstance(ended, int)
    return ended


def refusal(capture: pytest.CaptureFixture[str], main: Callable[[list[str]], object], *arguments: str) -> str:
    """The one line, after "error: ", with which a command is refused; it leaves nothing in the working folder."""
    capture.readouterr()
    before = sorted(Path().rglob("*"))
    assert status(main, *arguments) == 2
    out, line = capture.readouterr()
    assert out == "" and line.startswith("error: ") and line.count("\n") == 1, (out, line)
    assert sorted(Path().rglob("*")) == before
    return line.removeprefix("error: ").rstrip("\n")


def result_of(folder: str | Path) -> dict[str, Any]:
    """``result.json`` of a run folder."""
    content: dict[str, Any] = json.loads(Path(folder, "result.json").read_text())
    return content


def line_of(call: Callable[[], object]) -> str:
    """The one line of the error of a scenario."""
    with pytest.raises(ScenarioError) as caught:
        call()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def changed(content: dict[str, Any], key: str, value: object) -> dict[str, Any]:
    """A copy with one key, ``section.key`` or ``section.0.key``, set or removed."""
    edited = copy.deepcopy(content)
    *path, last = key.split(".")
    place: Any = edited
    for part in path:
        place = place[int(part)] if isinstance(place, list) else place.setdefault(part, {})
    if value is REMOVED:
        del place[last]
    else:
        place[int(last) if isinstance(place, list) else last] = value
    return edited


def campaigns_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let commands do the runs of campaigns in this process: a worker takes seconds to start."""

    def here(workers: int, backend: str | None = None) -> ExecutorFactory:
        processes(workers, backend)  # for its checks
        return in_process(Interruption(), backend)

    monkeypatch.setattr("tpbso_casadi.cli.campaign.processes", here)

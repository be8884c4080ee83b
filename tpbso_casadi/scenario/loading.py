"""A scenario by the name that a command line gives it."""

from __future__ import annotations

from pathlib import Path

from tpbso_casadi.scenario.builtin import TITLES, builtin
from tpbso_casadi.scenario.scenario import Scenario, read_scenario
from tpbso_casadi.scenario.section import ScenarioError


def load(name: str) -> Scenario:
    """A built-in scenario, or that of a file.

    Raises:
        ScenarioError: it is neither, or the file is not a scenario.
    """
    if name in TITLES:
        return builtin(name)
    path = Path(name)
    if not path.suffix and not path.exists():
        raise ScenarioError(f"{name}: neither a file nor a built-in scenario; solve --list shows those")
    return read_scenario(path)

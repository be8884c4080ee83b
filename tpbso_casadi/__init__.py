"""Plan robot-arm motions with metaheuristics on one symbolic CasADi model. A user needs this import alone."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tpbso_casadi.api import *  # noqa: F403


def __getattr__(name: str) -> object:
    """Load what is imported from here when it is: a command handles Ctrl-C before CasADi has been loaded."""
    api = import_module("tpbso_casadi.api")
    if name == "__all__" or name in api.__all__:
        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__getattr__("__all__")]  # type: ignore[misc]

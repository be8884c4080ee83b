"""Plan robot-arm motions with metaheuristics and gradients on one symbolic model, and prove what comes out.

``import tpbso_casadi as tp`` is all that a user needs; see :func:`tpbso_casadi.plan`.
"""

from __future__ import annotations

import sys
from importlib import import_module
from importlib.metadata import version
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tpbso_casadi.api import *  # noqa: F403

__version__ = version("tpbso-casadi")


class _Package(ModuleType):
    """The package, in which the function ``suite`` has the name of a folder: the function wins."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (isinstance(value, ModuleType) and name == "suite"):
            super().__setattr__(name, value)


def __getattr__(name: str) -> object:
    """Load what is imported from here when it is: a command handles Ctrl-C before CasADi has been loaded."""
    if name.startswith("__") and name != "__all__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "suite":  # whose problems are evaluated without CasADi
        return import_module("tpbso_casadi.suite").suite
    api = import_module("tpbso_casadi.api")
    if name == "__all__" or name in api.__all__:
        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*globals(), *__getattr__("__all__")]  # type: ignore[misc]


sys.modules[__name__].__class__ = _Package

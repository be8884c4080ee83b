"""Planning problems: robots, tasks and limits as symbolic CasADi models. Knows nothing of how they are searched."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from problems.api import *  # noqa: F403


def __getattr__(name: str) -> object:
    """Load the public names when one is asked for: who imports one folder alone loads no families of motions."""
    if name == "__all__" or not name.startswith("_"):
        return getattr(import_module("problems.api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

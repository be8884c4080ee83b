"""The versions of everything that decides a result."""

from __future__ import annotations

from functools import cache
from importlib.metadata import version


@cache
def versions() -> dict[str, str]:
    """By the name of the package; the same dictionary each time, not to be changed."""
    return {name: version(name) for name in ("tpbso-casadi", "casadi", "numpy", "scipy")}

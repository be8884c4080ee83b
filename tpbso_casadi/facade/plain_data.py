"""NumPy in: arrays, classes and file names as the plain data of a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tpbso_casadi.scenario.section import ScenarioError


def plain(value: Any) -> Any:
    """The same with lists in place of arrays and tuples, and text in place of paths and classes."""
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Mapping):
        return {plain(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple):
        return [plain(entry) for entry in value]
    if isinstance(value, type):
        return path_of(value)
    return str(value) if isinstance(value, Path) else value


def path_of(kind: type) -> str:
    """``package.module:Class``, as a scenario names classes of anyone.

    Raises:
        ScenarioError: it is defined in a function, where nobody finds it by its name.
    """
    if "<locals>" in kind.__qualname__:
        raise ScenarioError(f"{kind.__name__}: a plan names its classes; define it in a module or a notebook's cell")
    return f"{kind.__module__}:{kind.__qualname__}"

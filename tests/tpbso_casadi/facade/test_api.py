"""The public names: each is there, says what it is, and so do its methods and properties."""

from __future__ import annotations

import inspect
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

import tpbso_casadi as tp
from tpbso_casadi import api

OURS = ("problems", "solvers", "tpbso_casadi")
NAMES = sorted(api.__all__)


def documented_parts(kind: type) -> Iterator[tuple[str, Any]]:
    """What a class of ours, or one that it is derived from, offers."""
    for base in kind.__mro__:
        if base.__module__.split(".")[0] in OURS:
            for name, value in vars(base).items():
                is_part = isinstance(value, (property, classmethod, staticmethod)) or inspect.isfunction(value)
                if is_part and not name.startswith("_"):
                    yield name, getattr(kind, name) if not isinstance(value, property) else value


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_says_what_it_is(name: str) -> None:
    thing = getattr(tp, name)
    if not (inspect.isclass(thing) or inspect.isfunction(thing)):
        pytest.skip("a table of names, or a type")
    assert inspect.getdoc(thing), name
    if isinstance(thing, type):
        assert [part for part, value in documented_parts(thing) if not inspect.getdoc(value)] == []


def test_functions_describe_their_arguments() -> None:
    for name in NAMES:
        thing = getattr(tp, name)
        if inspect.isfunction(thing):
            arguments = [key for key in inspect.signature(thing).parameters if key not in ("content", "folder", "plan")]
            text = inspect.getdoc(thing) or ""
            assert len(arguments) < 2 or all(f"{key}:" in text for key in arguments), (name, arguments)


def test_boxes_are_obstacles() -> None:
    assert issubclass(tp.Box, tp.Obstacle)
    assert issubclass(tp.Sphere, tp.Obstacle)
    assert tp.Box(center=(0.0, 0.0, 0.0), size=(1.0, 1.0, 1.0)).dim == 3


def test_importing_the_package_loads_nothing_heavy() -> None:
    code = "import sys, tpbso_casadi; print([n for n in ('casadi', 'matplotlib', 'pandas') if n in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"

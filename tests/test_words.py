"""The words: what docstrings have to say, and where they have to say nothing.

The first line of a docstring stands alone; a method that overrides another one has a docstring only where it differs.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from functools import cached_property
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

ROOT = Path(__file__).parent.parent
PACKAGES = ("problems", "solvers", "tpbso_casadi")
FILES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")) if path.stem != "__main__"]
POINTING = re.compile(
    r"(Of|That|Those|These|This|The same|Likewise|It|Its|Both|Itself|They|Their|As|What|Whatever|Such|Which|One of"
    r"|All of|Each of|Another|Others?|Nothing|Where|With|By|From|On|In|For|To|At)\b"
)
CHECKER = ROOT / "problems" / "certify" / "check_certificate.py"  # stands alone, with words of its own
LONGEST, SHORTEST = 25, 4  # words of a first line


def folder_of(path: Path) -> str:
    """``problems/robots``; of a package without folders, or of a module directly in one, the package."""
    parts = path.relative_to(ROOT).parts
    return "/".join(parts[:2]) if len(parts) > 2 and parts[0] != "solvers" else parts[0]


class Documented(NamedTuple):
    """A class or function with a docstring."""

    where: str
    first: str

    @cached_property
    def words(self) -> list[str]:
        return self.first.split()


def documented(path: Path) -> Iterator[Documented]:
    if path == CHECKER:
        return
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef) and (
            text := ast.get_docstring(node)
        ):
            first = text.partition("\n\n")[0].replace("\n", " ")
            yield Documented(f"{path.relative_to(ROOT)}:{node.lineno} {node.name}", first)


def faults(first: str) -> list[str]:
    """What is wrong with the first line of a docstring."""
    count = len(first.split())
    return [
        *(["points elsewhere"] if POINTING.match(first) else []),
        *([f"{count} words"] if not SHORTEST <= count <= LONGEST else []),
    ]


@pytest.mark.parametrize("folder", sorted({folder_of(path) for path in FILES}))
def test_first_lines_stand_alone(folder: str) -> None:
    found = [each for path in FILES if folder_of(path) == folder for each in documented(path)]
    wrong = {each.where: f"{bad}: {each.first}" for each in found if (bad := faults(each.first))}
    assert not wrong, "\n".join(f"{where} {what}" for where, what in wrong.items())


def test_faults_of_first_lines_are_found() -> None:
    assert faults("The duration of the motion in seconds.") == []
    assert faults("Of the motion, in seconds.") == ["points elsewhere"]
    assert faults("Itself.") == ["points elsewhere", "1 words"]
    assert faults("word " * 26) == ["26 words"]
    assert faults("Offsets of all joints, (n,), rad.") == []


# Overrides


class Method(NamedTuple):
    """A method, a property or a function of a class."""

    where: str
    name: str
    text: str | None
    overridden: str | None  # the docstring of what it overrides, or empty; None where it overrides nothing


def function_of(member: object) -> object:
    if isinstance(member, property):
        return member.fget
    return getattr(member, "func", getattr(member, "__func__", member))


def methods(kind: type) -> Iterator[Method]:
    for name, member in [*vars(kind).items()]:
        function = function_of(member)
        if (
            not inspect.isfunction(function)
            or function.__name__ != name
            or function.__module__ != kind.__module__
            or name.startswith("_")
        ):
            continue
        above = [
            each for each in kind.__mro__[1:] if name in vars(each) or name in vars(each).get("__annotations__", {})
        ]
        overridden = (getattr(function_of(vars(above[0]).get(name)), "__doc__", None) or "") if above else None
        yield Method(f"{kind.__module__}.{kind.__qualname__}.{name}", name, function.__doc__, overridden)


def all_methods() -> list[Method]:
    found = []
    for path in FILES:
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        try:
            module = import_module(name)
        except ImportError as error:  # adapters of libraries that are not installed
            assert not str(error.name).startswith(PACKAGES), error
            continue
        kinds = [kind for kind in vars(module).values() if inspect.isclass(kind) and kind.__module__ == name]
        found += [method for kind in kinds for method in methods(kind)]
    return found


def test_methods_are_documented_where_they_differ() -> None:
    known = all_methods()
    assert len(known) > 2000
    new = [
        method for method in known if method.overridden is None and len(method.name) > 1 and "._" not in method.where
    ]
    missing = [method.where for method in new if not method.text]
    repeated = [method.where for method in known if method.text and method.text == method.overridden]
    assert not missing, f"no docstring: {missing}"
    assert not repeated, f"repeats the docstring of what it overrides: {repeated}"

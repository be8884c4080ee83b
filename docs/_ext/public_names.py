"""``{public-names} GROUP``: the public names of ``tpbso_casadi`` that belong to a group, from their docstrings.

A name belongs to the first group that has a prefix of the module in which it is defined, so that a new name of the
package is documented without being listed here.
"""

from __future__ import annotations

import inspect
from collections.abc import Collection, Iterator
from typing import Any

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

import tpbso_casadi
from problems.base import Table

LOGGER = logging.getLogger(__name__)
ERRORS, DATA = "errors", "data"
GROUPS = {
    "solvers": ("solvers", "tpbso_casadi.scenario.catalogues"),
    "robots": (
        "problems.robots",
        "tpbso_casadi.facade.robots",
        "tpbso_casadi.facade.reaching",
        "tpbso_casadi.facade.laying_out",
        "tpbso_casadi.facade.layouts",
        "tpbso_casadi.reaching",
    ),
    "obstacles": ("problems.scene",),
    "tasks": ("problems.tasks",),
    "sequences": ("tpbso_casadi.facade.sequences",),
    "scenarios": ("tpbso_casadi.scenario", "tpbso_casadi.facade.frames"),
    "replanning": ("tpbso_casadi.replanning", "tpbso_casadi.simulation", "tpbso_casadi.facade.simulating"),
    "stored": ("tpbso_casadi.storage",),
    "suite": ("tpbso_casadi.suite",),
    "model": ("problems",),
    "plans": ("tpbso_casadi",),
}
OF_DATA = {
    "BENCHMARK_FUNCTIONS": "The names of the functions that :func:`benchmark_function` makes.",
    "EXTERNAL": "Solvers of other libraries, by name: where each is, and the extra that installs the library.",
    "OBJECTIVES": "What can be minimised, by name: a class of each.",
    "SOLVERS": "The package's own metaheuristics, by name: a class of each.",
    "Search": "What :meth:`Solver.search` returns: a generator that yields candidates (m, d) and is sent costs (m,).",
}


class PublicNames(SphinxDirective):
    """Autodoc of every name of a group, in the order of the modules' names."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The documented names."""
        lines = StringList(["```{eval-rst}", *self._directives(), "```"], source=__file__)
        holder = nodes.Element()
        self.state.nested_parse(lines, self.content_offset, holder)
        return list(holder.children)

    def _directives(self) -> Iterator[str]:
        yield ".. currentmodule:: tpbso_casadi"
        yield ""
        for name in sorted(tpbso_casadi.__all__):
            value = getattr(tpbso_casadi, name)
            if group_of(name, value) == self.arguments[0]:
                yield from documented(name, value)


def group_of(name: str, value: object) -> str:
    """The group of a public name."""
    if inspect.isclass(value) and issubclass(value, Exception):
        return ERRORS
    if not (inspect.isclass(value) or inspect.isroutine(value)):
        return DATA
    return next(
        group
        for group, prefixes in GROUPS.items()
        if any(f"{value.__module__}.".startswith(f"{prefix}.") for prefix in prefixes)
    )


def documented(name: str, value: object) -> Iterator[str]:
    """The directives that document a name."""
    if inspect.isclass(value) and issubclass(value, Table):  # a table of a file: its keys are in the reference
        own = [key for key, member in vars(value).items() if not key.startswith("_") and inspect.getdoc(member)]
        methods = [key for key in own if key not in value.schema()]
        yield f".. autoclass:: tpbso_casadi::{name}()"
        yield f"   :members: {', '.join(methods)}"
    elif inspect.isclass(value):
        yield f".. autoclass:: tpbso_casadi::{name}"
        yield "   :members:"
        yield "   :inherited-members: Exception, Enum, IntEnum, StrEnum, str, int, tuple"
        yield "   :show-inheritance:" if issubclass(value, Exception) else ""
    elif inspect.isroutine(value):
        yield f".. autofunction:: tpbso_casadi::{name}"
    else:
        yield f".. py:data:: {name}"
        yield ""
        if name in OF_DATA:
            yield f"   {OF_DATA[name]}"
        else:
            LOGGER.warning("%s: nothing is said of this public name; say it in %s", name, __file__)
        if isinstance(value, Collection):
            yield "   " + ", ".join(f"``{key}``" for key in value)
    yield ""


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("public-names", PublicNames)
    return {"version": "1", "parallel_read_safe": True}

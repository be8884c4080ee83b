"""``{keys} package.module:Section``: the keys of a table of a scenario or a result, each with what is said of it.

In place of a section, the class of an obstacle or of a constraint of the hand: its fields are the keys.

What is said stands in the directive's lines or under ``Attributes:`` in the section's docstring; the kind of values and
the default are those of the section itself. A key of which nothing is said, and a line without a key, is a warning,
which ends a strict build.
"""

from __future__ import annotations

import inspect
import textwrap
from collections.abc import Callable, Collection
from dataclasses import MISSING
from importlib import import_module
from types import UnionType
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.docutils import SphinxDirective

from problems.base import Key, Quantity, Range, Table, keys_of_fields
from problems.limits import HandConstraint
from tpbso_casadi.scenario.obstacle_section import ObstacleSection
from tpbso_casadi.scenario.obstacles import keys_of_shape
from tpbso_casadi.scenario.validation import Word

LOGGER = logging.getLogger(__name__)
WIDTHS = {"key": 15, "values": 20, "default": 15, "what it is": 50}
ABSURD = 1e9  # limits beyond that only guard against overflow
WORDS = {bool: "true or false", str: "text", int: "whole number", float: "number", Any: "place"}


class Keys(SphinxDirective):
    """A table of keys; its content is ``key: what it is`` line by line, indented lines continue."""

    required_arguments = 1
    option_spec: ClassVar[dict[str, Callable[[str], Any]]] = {"but": str.split, "stored": directives.flag}
    has_content = True

    def run(self) -> list[nodes.Node]:
        """The table."""
        module, _, name = self.arguments[0].partition(":")
        known = keys_of(named := getattr(import_module(module), name))
        said = of_docstring(named, known) | descriptions(self.content.data)
        fields = {key: field for key, field in known.items() if key not in self.options.get("but", ())}
        for key in fields.keys() ^ said.keys():
            LOGGER.warning("%s: key %r is not described, or is none", name, key, location=self.get_location())
        rows = [self._row(key, field, said.get(key, "")) for key, field in fields.items()]
        return [table_of(rows, self._widths)]

    @property
    def _widths(self) -> dict[str, int]:
        left_out = {"default"} if "stored" in self.options else set()
        return {heading: width for heading, width in WIDTHS.items() if heading not in left_out}

    def _row(self, key: str, field: Key, text: str) -> nodes.row:
        said, _ = self.parse_inline(text)
        columns = [[nodes.literal(text=key)], [nodes.Text(values_of(field))], [_default(field)], said]
        cells = [cell for heading, cell in zip(WIDTHS, columns, strict=True) if heading in self._widths]
        return nodes.row("", *(nodes.entry("", nodes.paragraph("", "", *cell)) for cell in cells))


def keys_of(named: type[Any]) -> dict[str, Key]:
    """The keys of a section, or those of a table that states an object of a class."""
    if issubclass(named, Table):
        return named.schema()
    if issubclass(named, HandConstraint):
        return {"kind": Key(Word, "", MISSING)} | keys_of_fields(named)
    return ObstacleSection.schema() | keys_of_shape(named)


def descriptions(lines: list[str]) -> dict[str, str]:
    """What is said of each key."""
    said: dict[str, str] = {}
    for line in filter(str.strip, lines):
        if line.startswith(" "):
            said[next(reversed(said))] += f" {line.strip()}"
        else:
            key, _, text = line.partition(":")
            said[key] = text.strip()
    return said


def of_docstring(section: type[Any], known: Collection[str]) -> dict[str, str]:
    """What the docstring of a section says of its keys."""
    _, _, attributes = (inspect.getdoc(section) or "").partition("Attributes:\n")
    said = descriptions(textwrap.dedent(attributes).splitlines()) if issubclass(section, Table) else {}
    return {key: text for key, text in said.items() if key in known}


def table_of(rows: list[nodes.row], widths: dict[str, int]) -> nodes.table:
    """A table with these headings."""
    heading = nodes.row("", *(nodes.entry("", nodes.paragraph(text=word)) for word in widths))
    columns = [nodes.colspec(colwidth=width) for width in widths.values()]
    group = nodes.tgroup("", *columns, nodes.thead("", heading), nodes.tbody("", *rows), cols=len(widths))
    return nodes.table("", group)


def _default(field: Key) -> nodes.Node:
    if field.is_needed:
        return nodes.strong(text="required")
    value = field.usual
    if value is None or isinstance(value, Table) or value in ([], {}):
        return nodes.Text("")
    plain = list(value) if isinstance(value, tuple) else value
    return nodes.literal(text=str(plain).lower() if isinstance(plain, bool) else repr(plain).replace("'", '"'))


def values_of(field: Key) -> str:
    """The kind of values of a key, with their range."""
    return kind_of(field.hint)


def range_of(marks: Any) -> str:
    """The limits among the marks of a number, in words; what only guards against absurd numbers is left out."""
    ranges = [mark for mark in marks if isinstance(mark, Range)]
    ranges += [Range(above=0.0) for mark in marks if isinstance(mark, Quantity) and mark.bounds[0] > 0.0]
    ranges += [Range(least=0.0) for mark in marks if isinstance(mark, Quantity) and mark.bounds[0] == 0.0]
    lower = [f"> {each.above:g}" for each in ranges if each.above is not None]
    lower += [f"≥ {each.least:g}" for each in ranges if each.least is not None and each.least > -ABSURD]
    upper = [f"< {each.below:g}" for each in ranges if each.below is not None]
    upper += [f"≤ {each.most:g}" for each in ranges if each.most is not None and each.most < ABSURD]
    return ", ".join([*lower, *upper])


def kind_of(annotation: Any) -> str:
    """A type in words."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        return "table"
    origin, parts = get_origin(annotation), get_args(annotation)
    return BY_ORIGIN[origin](parts) if origin in BY_ORIGIN else WORDS.get(annotation, "text or table")


def _annotated(parts: tuple[Any, ...]) -> str:
    return " ".join(filter(None, [kind_of(parts[0]), range_of(parts[1:])]))


def _tuple(parts: tuple[Any, ...]) -> str:
    if parts[-1] is Ellipsis:
        return _list(parts)
    return f"list of {len(parts)} " + ("lists" if get_origin(parts[0]) is tuple else "numbers")


def _list(parts: tuple[Any, ...]) -> str:
    inner = kind_of(parts[0])
    words = {"number": "numbers", "text": "names", "table": "tables"}
    return f"list of {words.get(inner.split(' ')[0], 'lists' if inner.startswith('list') else inner)}"


def _union(parts: tuple[Any, ...]) -> str:
    return " or ".join(dict.fromkeys(kind_of(part) for part in parts if part is not type(None)))


BY_ORIGIN: dict[Any, Callable[[tuple[Any, ...]], str]] = {
    Annotated: _annotated,
    Literal: lambda parts: " or ".join(f'"{part}"' for part in parts),
    Union: _union,
    UnionType: _union,
    tuple: _tuple,
    list: _list,
    dict: lambda parts: "table",
}


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    app.add_directive("keys", Keys)
    return {"version": "1", "parallel_read_safe": True}

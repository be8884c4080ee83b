"""``{command} NAME``: what a command of ``tpbso`` takes, from its own parser.

To the page ``reference/commands`` every command is added by itself.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterator
from importlib import import_module
from typing import Any

from docutils import nodes
from docutils.parsers.rst import Directive
from sphinx.application import Sphinx

from tpbso_casadi.cli.tpbso import COMMANDS

PAGE = "reference/commands"
WIDTH = "78"


class Command(Directive):
    """The usage of a command, what it does, and its options group by group."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """The nodes that stand for it."""
        name = self.arguments[0]
        parser: argparse.ArgumentParser = import_module(f"tpbso_casadi.cli.commands.{name}").parser()
        return list(_described(parser, f"tpbso {name}"))


def _described(parser: argparse.ArgumentParser, program: str) -> Iterator[nodes.Node]:
    parser.prog = program
    usage = parser.format_usage().removeprefix("usage: ")
    if parser.description:
        yield nodes.paragraph(text=parser.description)
    yield nodes.literal_block(usage, usage, language="none")
    inner: list[tuple[str, argparse.ArgumentParser]] = []
    for group in parser._action_groups:
        for action in group._group_actions:
            if isinstance(action, argparse._SubParsersAction):
                inner += action.choices.items()
        shown = [action for action in group._group_actions if action.help is not argparse.SUPPRESS]
        if shown:
            yield nodes.rubric(text=(group.title or "").capitalize())
            yield nodes.definition_list("", *(_entry(parser, action) for action in shown))
    examples = [f"{program} {example}".rstrip() for example in getattr(parser, "examples", ())]
    if examples:
        yield nodes.rubric(text="Examples")
        yield nodes.literal_block("", "\n".join(examples), language="none")
    for name, below in inner:
        yield nodes.rubric(text=f"{program} {name}")
        yield from _described(below, f"{program} {name}")


def _entry(parser: argparse.ArgumentParser, action: argparse.Action) -> nodes.definition_list_item:
    formatter = parser._get_formatter()
    term = nodes.term()
    term += nodes.literal(text=formatter._format_action_invocation(action))
    text = formatter._expand_help(action) if action.help else ""
    return nodes.definition_list_item("", term, nodes.definition("", nodes.paragraph(text=text)))


def add_commands(app: Sphinx, docname: str, source: list[str]) -> None:
    """A section for each command on the page of all."""
    if docname == PAGE:
        source[0] += "".join(f"\n## tpbso {name}\n\n```{{command}} {name}\n```\n" for name in COMMANDS)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the directive."""
    os.environ["COLUMNS"] = WIDTH  # of usages, whatever the terminal
    app.add_directive("command", Command)
    app.connect("source-read", add_commands)
    return {"version": "1", "parallel_read_safe": True}

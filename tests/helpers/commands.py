"""The commands of ``tpbso``, and their parsers."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from importlib import import_module
from types import ModuleType

from tpbso_casadi.cli.command import OneLineParser
from tpbso_casadi.cli.tpbso import COMMANDS


def module_of(command: str) -> ModuleType:
    return import_module(f"tpbso_casadi.cli.commands.{command}")


def parser_of(command: str) -> OneLineParser:
    parser = module_of(command).parser()
    assert isinstance(parser, OneLineParser)
    return parser


def parsers() -> Iterator[OneLineParser]:
    """The parser of every command, and those below them."""
    for command in COMMANDS:
        yield from _with_those_below(parser_of(command))


def _with_those_below(parser: OneLineParser) -> Iterator[OneLineParser]:
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            yield from action.choices.values()


def options_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options that a help shows."""
    return [action for action in parser._actions if action.option_strings and action.help != argparse.SUPPRESS]

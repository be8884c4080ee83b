"""Plug-ins that fail: whatever they raise while they are made or used becomes one line that names them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from problems.base import InvalidTable
from tpbso_casadi.scenario.catalogues import failure, is_raised_in
from tpbso_casadi.scenario.validation import ScenarioError


class UsesPlugins(Protocol):
    """A statement that names plug-ins, as a scenario does."""

    @property
    def plugins(self) -> list[str]:
        """The names of those plug-ins, as a file states them."""


@contextmanager
def plug_in_failures(key: str, name: str) -> Iterator[None]:
    """Turn whatever a class of a plug-in raises into one line.

    Args:
        key: of the table that chose the class.
        name: what the key says.

    Raises:
        InvalidTable: errors of the table pass as they are, and so does Ctrl-C.
    """
    try:
        yield
    except (InvalidTable, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise InvalidTable(f"plug-in {name} failed: {failure(error)}", key) from error


@contextmanager
def failures_named(plugins: list[str], key: str, *refusals: type[Exception]) -> Iterator[None]:
    """Turn whatever plug-ins raise while they are made into one line.

    Args:
        plugins: their names; without any only refusals are turned.
        key: of the scenario, with which the line begins.
        refusals: exceptions with which a class says that it does not like its settings.

    Raises:
        ScenarioError: Ctrl-C and errors of ours pass.
    """
    try:
        yield
    except (KeyboardInterrupt, ScenarioError):
        raise
    except BaseException as error:
        if isinstance(error, refusals):
            raise ScenarioError(f"{key}: {error}") from error
        if not plugins:
            raise
        raise ScenarioError(f"{key}: plug-ins ({', '.join(plugins)}) failed: {failure(error)}") from error


@contextmanager
def plugin_failures_named(scenario: UsesPlugins, *known: type[Exception]) -> Iterator[None]:
    """Turn whatever a scenario's plug-ins raise while they are used into one line.

    Args:
        scenario: whose plug-ins run in this context.
        known: errors of ours, which pass, as do Ctrl-C and those of the operating system that no plug-in caused.

    Raises:
        ScenarioError: naming the plug-ins and what was raised; exceptions of scenarios without plug-ins pass.
    """
    plugins = scenario.plugins
    try:
        yield
    except BaseException as error:
        if isinstance(error, (KeyboardInterrupt, ScenarioError, *known)):
            raise
        of_the_system = isinstance(error, OSError) and not is_raised_in(plugins, error)
        if not plugins or of_the_system:
            raise
        raise ScenarioError(f"plug-ins ({', '.join(plugins)}) failed: {failure(error)}") from error

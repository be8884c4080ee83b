"""Solvers as a command line or a list states them: a name, settings in brackets, a polish."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from problems.base import number_of, whole_of
from solvers import Preset
from tpbso_casadi.scenario.catalogues import PluginError, current_name, find_solver
from tpbso_casadi.scenario.validation import ScenarioError

STATED = re.compile(r"(?P<name>[^()+\s]+)(?:\((?P<settings>[^()]*)\))?(?P<polish>\+polish(?P<starts>\d*))?")
BETWEEN = re.compile(r",(?![^()]*\))")  # solvers, not settings


@dataclass(frozen=True)
class NamedSolver:
    """A solver as ``NAME(setting=value,...)+polishN`` states it.

    Attributes:
        name: of the solver, a plug-in's path ``package.module:Class`` too.
        settings: those that are stated.
        polish_starts: candidates that IPOPT refines afterwards; 0 where nothing is said.
    """

    name: str
    settings: Mapping[str, int | float | str] = field(default_factory=dict)
    polish_starts: int = 0

    def table(self, name: str, settings: Mapping[str, Any]) -> dict[str, Any]:
        """The keys of [solver] that it states, in place of a solver with settings, of which another one keeps none."""
        kept = settings if self.name == name else {}
        stated = {"settings": {**kept, **self.settings}, "polish_starts": self.polish_starts}
        return {"name": self.name, **{key: value for key, value in stated.items() if value}}


def named_solver(text: str, key: str = "solver") -> NamedSolver:
    """Read one solver: ``NAME``, ``NAME(setting=value,...)``, either with ``+polish`` or ``+polishN`` behind it.

    A preset of the solver may stand among its settings, ``bso(printed,lambda_=0.4)``; later ones override earlier ones.

    Args:
        text: the statement.
        key: that it is the value of, for messages.

    Raises:
        ScenarioError: it cannot be read.
    """
    match = STATED.fullmatch(text)
    if match is None:
        raise ScenarioError(f"{key}: {text!r} is not NAME, NAME(setting=value) or NAME+polish")
    settings: dict[str, int | float | str] = {}
    for part in match["settings"].split(",") if match["settings"] else []:
        settings |= _preset(match["name"], part.strip()) or dict([_setting(f"{key}: {text!r}", part)])
    starts = 0 if match["polish"] is None else _polish_starts(f"{key}: {text!r}", match["starts"] or "1")
    return NamedSolver(current_name(match["name"]), settings, starts)


def each_of(text: str) -> list[str]:
    """The solvers of a list with commas between them, those within brackets left alone."""
    return [part.strip() for part in BETWEEN.split(text)]


def _polish_starts(place: str, digits: str) -> int:
    if not re.fullmatch("[1-9][0-9]{0,8}", digits):
        raise ScenarioError(f"{place}: +polish needs a number of starts from 1 on, without zeros before it")
    return int(digits)


def _preset(solver: str, name: str) -> Preset:
    """The settings of a preset; empty if there is no such preset, or no such solver, which is an error later."""
    try:
        return find_solver(solver).presets.get(name, {})
    except PluginError:
        return {}


def _setting(place: str, pair: str) -> tuple[str, int | float | str]:
    name, equals, value = (part.strip() for part in pair.partition("="))
    if not (name and equals and value):
        raise ScenarioError(f"{place}: {pair.strip()!r} is not setting=value")
    with suppress(ValueError):
        return name, whole_of(value)
    with suppress(ValueError):
        number = number_of(value)
        return name, number if isfinite(number) else value  # nan and inf are words, as no setting is one of them
    return name, value

"""What is told while a plan is made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from solvers import Status


def _nothing(told: object) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class Progress:
    """Callbacks during planning.

    Attributes:
        status: gets the status after every iteration of a search, and after every start of a descent.
        phase: gets the name of what begins: "modelling", "searching", "polishing".
    """

    status: Callable[[Status], object] = _nothing
    phase: Callable[[str], object] = _nothing

"""Who is told what begins while a plan is made, and how far it is."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

from solvers import Result, Status

LOG = logging.getLogger(__name__)


def _nothing(told: object) -> None:
    """The callback that does nothing."""


@dataclass(frozen=True)
class Progress:
    """Callbacks that are told what planning does.

    Attributes:
        status: gets the status after every iteration of a search, and after every start of a descent.
        phase: gets the name of what begins: "modelling", "searching", "polishing".
    """

    status: Callable[[Status], object] = _nothing
    phase: Callable[[str], object] = _nothing


def log_search(what: str, search: Result) -> None:
    """Log the effort of a search, "search" or "polish", and what ended it."""
    LOG.info(
        "%s: %d evaluations, %d %ss in %.3f s; stopped: %s",
        what,
        search.evaluations,
        search.iterations,
        search.history.steps.name,
        search.seconds,
        search.stop_reason,
    )

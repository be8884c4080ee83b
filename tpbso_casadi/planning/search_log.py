"""What a search or a descent has done, for the log."""

from __future__ import annotations

import logging

from solvers import Result

LOG = logging.getLogger(__name__)


def log_search(what: str, search: Result) -> None:
    """Log the effort of a search, and what ended it.

    Args:
        what: it was: "search", "polish".
        search: its result.
    """
    LOG.info(
        "%s: %d evaluations, %d %ss in %.3f s; stopped: %s",
        what,
        search.evaluations,
        search.iterations,
        search.history.steps.name,
        search.seconds,
        search.stop_reason,
    )

"""``-v``: what the library logs, on standard error."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from tpbso_casadi.cli.common import one_line

LOGGERS = ("tpbso_casadi", "problems", "solvers")  # the packages, parents of their modules' loggers
LEVELS = (logging.WARNING, logging.INFO, logging.DEBUG)


class LineFormatter(logging.Formatter):
    """One line a record, with the milliseconds since the command began; with the logger's name where all is shown."""

    def __init__(self, named: bool) -> None:
        super().__init__("{relativeCreated:.0f} ms: " + "{name}: " * named + "{message}", style="{")

    def format(self, record: logging.LogRecord) -> str:
        """The record as a line."""
        return one_line(super().format(record))


@contextmanager
def logged(verbosity: int) -> Iterator[None]:
    """Show on standard error what the library logs meanwhile.

    Args:
        verbosity: 0 for nothing, 1 for what is done and how long it took, 2 for everything.
    """
    if not verbosity:
        yield
        return
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(LineFormatter(named=verbosity > 1))
    with ExitStack() as listening:
        for name in LOGGERS:
            logger = logging.getLogger(name)
            listening.callback(logger.setLevel, logger.level)
            logger.setLevel(LEVELS[min(verbosity, len(LEVELS) - 1)])
            listening.callback(logger.removeHandler, handler)
            logger.addHandler(handler)
        yield

"""Steps of long work on standard error: a bar on a terminal, lines at intervals elsewhere; short work shows nothing."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING

from problems.base import listening

if TYPE_CHECKING:
    from rich.progress import Progress

SHORT = 1.0  # s that work takes before there is a bar
INTERVAL = 10.0  # s between plain lines


class Steps:
    """A listener that shows how many steps of some work are done.

    Args:
        shown: closes what is shown when the command ends.
    """

    def __init__(self, shown: ExitStack) -> None:
        self._shown, self._began, self._told = shown, 0.0, 0.0
        self._bar: Progress | None = None

    def __call__(self, work: str, done: int, total: int) -> None:
        """Show how many steps are done."""
        now = time.monotonic()
        if done == 0:
            self._began = self._told = now
        if sys.stderr.isatty():
            self._draw(work, done, total, now - self._began)
        elif now - self._told > INTERVAL:
            print(f"{work}: {done} of {total}", file=sys.stderr, flush=True)
            self._told = now

    def _draw(self, work: str, done: int, total: int, elapsed: float) -> None:
        if self._bar is None and done < total and elapsed > SHORT:
            from rich.console import Console  # noqa: PLC0415 (few commands need it)
            from rich.progress import Progress  # noqa: PLC0415

            self._bar = self._shown.enter_context(Progress(console=Console(stderr=True), transient=True))
            self._bar.add_task(work, total=total)
        if self._bar is not None:
            self._bar.update(self._bar.task_ids[0], completed=done)
        if done == total:
            self._shown.close()
            self._bar = None


@contextmanager
def steps_shown(quiet: bool) -> Iterator[None]:
    """Show the steps of long work meanwhile, where it is not to be quiet."""
    with ExitStack() as shown:
        if not quiet and sys.stderr is not None:
            shown.enter_context(listening(Steps(drawn := ExitStack())))
            shown.enter_context(drawn)
        yield

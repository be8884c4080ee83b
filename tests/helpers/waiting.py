"""Waiting for events, however much else the machine has to do."""

from __future__ import annotations

import time
from collections.abc import Callable

PATIENCE = 300.0  # s, after which a test fails
POLL_SECONDS = 0.02


def wait_until(happened: Callable[[], object]) -> None:
    """Return when something has happened.

    Raises:
        AssertionError: it has not, for far too long.
    """
    deadline = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < deadline
        time.sleep(POLL_SECONDS)

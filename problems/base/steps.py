"""Steps of long work, told to who asked for them: a command shows a bar, a call from Python nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str, int, int], object]
_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Call a function with the name of some work, the number of its steps that are done, and of all of them."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)


def tell_step(work: str, done: int, total: int) -> None:
    """Tell the listener, where there is one, how much of some work is done."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(work, done, total)

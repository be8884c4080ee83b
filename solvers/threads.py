"""Linear algebra of small matrices on one thread."""

from __future__ import annotations

from contextlib import AbstractContextManager
from functools import cache

from threadpoolctl import ThreadpoolController


def one_thread() -> AbstractContextManager[object]:
    """A context in which BLAS has one thread, as waiting for others costs more up to some hundred rows.

    The eigenvectors of (56, 56) take 0.2 ms of CPU time so, and 7 ms with two threads on two busy cores. Not a bit of
    them depends on it.
    """
    limit: AbstractContextManager[object] = _controller().limit(limits=1, user_api="blas")
    return limit


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()

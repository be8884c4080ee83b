"""A call in a process of its own that is ended when it takes too long: no library can hang or crash a benchmark."""

from __future__ import annotations

import os
from collections.abc import Callable
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

T = TypeVar("T")


class NoResult(RuntimeError):
    """A call took too long, raised an exception, or took its process with it; the message is one line."""


def within(seconds: float, call: Callable[..., T], *arguments: object) -> T:
    """What a call returns; it and its arguments can be pickled.

    Args:
        seconds: at most, with the start of the process.
        call: a function of a module.
        arguments: of it.

    Raises:
        NoResult: there is none.
    """
    context = get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_serve, args=(theirs, call, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(seconds):
            raise NoResult(f"ended after {seconds:g} s")
        result, error = ours.recv()
    except EOFError as gone:
        raise NoResult("its process died") from gone
    finally:
        process.kill()
        process.join()
        ours.close()
    if error is not None:
        raise NoResult(error)
    return result  # type: ignore[no-any-return]


def _serve(connection: Connection, call: Callable[..., Any], arguments: tuple[object, ...]) -> None:
    try:
        answer = call(*arguments), None
    except Exception as error:
        answer = None, " ".join(f"{type(error).__name__}: {error}".split())[:300]
    connection.send(answer)
    connection.close()
    os._exit(0)  # some libraries print a page about themselves when Python ends

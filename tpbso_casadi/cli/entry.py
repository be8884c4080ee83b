"""How a command is entered and left: Ctrl-C, closed pipes, errors of one line.

Loads nothing but the standard library before a signal can be handled.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from traceback import extract_tb
from types import FrameType
from typing import NoReturn

STOP_SIGNALS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]  # not all on every system
INTERRUPTED = 130
FAILED = 2


def run(module: str, called: str | None = None) -> NoReturn:
    """Run the ``main`` of a module, and exit with its status.

    Whatever happens takes one line on standard error at most: 130 after a signal, 2 after an error; with
    ``python -X dev`` the traceback of an unexpected one is shown.

    Args:
        module: its dotted name.
        called: how the user has called the command; the usage says it.
    """
    _handle(_leave)
    _open_outputs()
    if called is not None:
        sys.argv[0] = called
    main = import_module(module).main
    status = _guarded(main)
    _handle(signal.SIG_IGN)  # all is done
    sys.exit(status)


def answer(text: Callable[[], str]) -> NoReturn:
    """Print a text and exit, with 2 if it cannot be printed, 130 after Ctrl-C."""
    _open_outputs()
    try:
        print(text(), flush=True)
    except KeyboardInterrupt:
        _leave(signal.SIGINT, None)
    except OSError as error:
        _flushed()
        refuse(f"standard output: {error.strerror or error}")
    sys.exit(0)


def refuse(reason: str) -> NoReturn:
    """Print why nothing is done, and exit with 2."""
    _open_outputs()
    with suppress(OSError):
        print(f"error: {reason}", file=sys.stderr, flush=True)
    os._exit(FAILED)


def _open_outputs() -> None:
    """Let what is printed go nowhere where the caller has closed standard output or error."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w"))  # noqa: SIM115 (for as long as the process lives)


def _handle(handler: Callable[[int, FrameType | None], object] | signal.Handlers) -> None:
    """Let a handler have the signals that are not ignored."""
    for number in STOP_SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


def _leave(number: int, frame: FrameType | None) -> NoReturn:
    """Exit at once: nothing has been begun yet."""
    os.write(2, b"error: interrupted\n")
    os._exit(INTERRUPTED)


def _guarded(main: Callable[[], int]) -> int:
    """The exit status of a command; what it raises is one line."""
    from solvers.budget import Interruption  # noqa: PLC0415 (loads CasADi)
    from tpbso_casadi.cli.command import print_error  # noqa: PLC0415 (likewise)

    interruption = Interruption()
    interruption.install(*STOP_SIGNALS)
    try:
        status = interruption.breakable(main)
        sys.stdout.flush()
    except KeyboardInterrupt:
        print_error("interrupted")
        status = INTERRUPTED
    except MemoryError:
        print_error("there is not enough memory")
        status = FAILED
    except OSError as error:
        print_error(f"{error.filename or 'standard output'}: {error.strerror or error}")
        status = FAILED
    except Exception as error:
        if sys.flags.dev_mode:
            raise
        where = extract_tb(error.__traceback__)[-1]
        print_error(
            f"internal error, please report it: {_described(error)} ({Path(where.filename).name}:{where.lineno})"
        )
        status = FAILED
    return status if _flushed() else FAILED


def _described(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"


def _flushed() -> bool:
    """Whether all output could be written; what is left of it is dropped, lest the interpreter complain at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return False
    return True

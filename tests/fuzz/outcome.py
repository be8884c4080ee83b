"""How a command ends, run in this process or in one of its own, and what must not happen."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import NoReturn

STATUSES = {0, 1, 2, 130}
LONGEST_LINE = 300
SECONDS = 60.0  # that a command may take; a busy machine included
BACKEND = "TPBSO_CASADI_BACKEND"


class Hang(BaseException):
    """A command that does not end; derived so that no handler of the program catches it."""


@dataclass(frozen=True)
class Outcome:
    """The end of a command: its status (None where there is none), standard error, and the traceback if it raised."""

    status: int | None
    errors: str
    traceback: str = ""
    hung: bool = False

    @property
    def flaw(self) -> str:
        """What is wrong with it; empty if nothing is."""
        lines = self.errors.splitlines()
        if self.hung:
            return "hang"
        if self.traceback or "Traceback" in self.errors or "internal error" in self.errors:
            return "traceback"
        if self.status not in STATUSES:
            return "status"
        if self.status == 0:
            return "says something" if lines else ""
        if len(lines) != 1 or len(lines[0]) > LONGEST_LINE or not lines[0].startswith("error: "):
            return "not one line"
        return "" if lines[0].isprintable() else "control characters"


class Tally(Counter[str]):
    """Counts of examples, statuses and flaws."""

    def check(self, what: object, outcome: Outcome) -> None:
        """Count an outcome; it must have no flaw."""
        self["examples"] += 1
        self[f"status {outcome.status}"] += 1
        if outcome.flaw:
            self[outcome.flaw] += 1
            text = repr(what)
            print(
                f"{outcome.flaw}: {text[:3000]}\n{outcome.errors[-1500:]}{outcome.traceback[-1500:]}", file=sys.stderr
            )
            raise AssertionError(f"{outcome.flaw}: {text[:500]}")


def run(main: Callable[[Sequence[str]], int], arguments: Sequence[str]) -> Outcome:
    """Run a command line in this process; standard output is thrown away, warnings count as lines of standard error."""
    status, trace, hung = None, "", False
    with tempfile.TemporaryFile() as kept, _standard_error_in(kept.fileno()), warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.simplefilter("ignore", ResourceWarning)
        try:
            with _time_limit(SECONDS):
                status = int(main(arguments))
        except SystemExit as end:
            status = int(end.code or 0)
        except Hang:
            hung = True
        except KeyboardInterrupt:  # of a plug-in: a process exits like that
            status = 130
            print("error: interrupted", file=sys.stderr)
        except BaseException:
            trace = traceback.format_exc()
        sys.stdout.flush()
        sys.stderr.flush()
        kept.seek(0)
        errors = kept.read().decode(errors="backslashreplace")
    return Outcome(status, errors, trace, hung)


def run_process(arguments: Sequence[str | bytes], **options: int) -> Outcome:
    """Run ``python -m`` with arguments in a process of its own."""
    command = [sys.executable, "-m", *arguments]
    environment = os.environ | {BACKEND: "vm"}
    options = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE} | options
    try:
        done = subprocess.run(command, timeout=SECONDS, env=environment, check=False, **options)  # type: ignore[call-overload]
    except subprocess.TimeoutExpired:
        return Outcome(None, "", hung=True)
    return Outcome(done.returncode, (done.stderr or b"").decode(errors="backslashreplace"))


@contextmanager
def _standard_error_in(file: int) -> Iterator[None]:
    """Standard error, that of libraries too, goes to a file; standard output nowhere."""
    streams, saved = (sys.stdout, sys.stderr), (os.dup(1), os.dup(2))
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(file, 2)
    sys.stdout, sys.stderr = (open(os.dup(number), "w", errors="backslashreplace") for number in (1, 2))  # noqa: PTH123, SIM115
    try:
        yield
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.close()
        sys.stdout, sys.stderr = streams
        for number, copy in zip((1, 2), saved, strict=True):
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)


@contextmanager
def _time_limit(seconds: float) -> Iterator[None]:
    def stop(number: int, frame: FrameType | None) -> NoReturn:
        raise Hang

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)

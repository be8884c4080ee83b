"""Run a program of the machine's: with a deadline, its whole process group, and only the beginning of what it says."""

from __future__ import annotations

import os
import select
import signal
import subprocess
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from tempfile import TemporaryFile
from typing import IO

MAX_OUTPUT = 65_536  # bytes of an answer that are kept; the rest is read and dropped
POLL_SECONDS = 0.1  # between two looks whether a program that left its output open has ended


class NoAnswer(Exception):
    """A program did not end in time; the message says which and how long it was given."""


@dataclass(frozen=True)
class Answer:
    """The end of a program.

    Attributes:
        status: 0 where it succeeded; negative for a signal.
        output: the beginning of its standard output and error, whatever is no UTF-8 replaced.
    """

    status: int
    output: str

    @property
    def first_line(self) -> str:
        """The first line that says something, without control characters, at most 200 characters."""
        lines = ("".join(c if c.isprintable() else " " for c in line).strip() for line in self.output.splitlines())
        return next(filter(None, lines), "")[:200]


def run(command: Sequence[str], seconds: float, text: str = "") -> Answer:
    """Run a program to its end, or end it and whatever it started.

    Args:
        command: the program and its arguments.
        seconds: that it has.
        text: its standard input.

    Raises:
        NoAnswer: it took longer.
        OSError: it cannot be started, or there is no room for the text.
    """
    ends = time.monotonic() + seconds
    with TemporaryFile() as given:
        given.write(text.encode())
        given.seek(0)
        process = subprocess.Popen(
            command, stdin=given, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
        )
    assert process.stdout is not None
    with process.stdout as pipe:
        try:
            output = _until_the_end(process, pipe, ends)
        except TimeoutError:
            raise NoAnswer(f"{command[0]} did not end within {seconds:g} s") from None
        finally:  # after Ctrl-C too, which a session of its own does not get
            if process.poll() is None:
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
    return Answer(process.returncode, output.decode(errors="replace"))


def _until_the_end(process: subprocess.Popen[bytes], pipe: IO[bytes], ends: float) -> bytes:
    """The beginning of the output of a process that has ended; a child of it may keep the pipe open.

    Raises:
        TimeoutError: it has not ended in time.
    """
    output, is_open = b"", True
    while is_open or process.poll() is None:
        left = ends - time.monotonic()
        if left <= 0.0:
            raise TimeoutError
        if not is_open:
            with suppress(subprocess.TimeoutExpired):
                process.wait(left)
        elif select.select([pipe], [], [], min(left, POLL_SECONDS))[0]:
            piece = os.read(pipe.fileno(), MAX_OUTPUT)
            output, is_open = (output + piece)[:MAX_OUTPUT], bool(piece)
        elif process.poll() is not None:
            return output
    return output

"""The C++ compiler: found, asked for its version, run outside of this process."""

from __future__ import annotations

import os
import platform
import select
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from itertools import takewhile
from pathlib import Path
from tempfile import TemporaryDirectory, TemporaryFile
from typing import IO

MAX_OUTPUT = 65_536  # bytes of an answer that are kept; the rest is read and dropped
POLL_SECONDS = 0.1  # between two looks whether a program that left its output open has ended


class NoAnswer(Exception):
    """Raised where a program did not end in time; the message says which and how long it was given."""


@dataclass(frozen=True)
class Answer:
    """The exit status and output of a program.

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
    """The beginning of the output of a process that has ended, even if its child keeps the pipe open.

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


# elsewhere registers are of one width, and some Clangs (Apple's on its own processors) refuse the flag
THIS_PROCESSOR = ("-march=native",) if platform.machine().lower() in {"x86_64", "amd64", "i386", "i686"} else ()
FLAGS = (
    "-O1",
    "-fschedule-insns",  # with the next one a tenth quicker than -O1 or -O2: long chains of operations are interleaved
    "-fsched-pressure",
    "-std=c++17",
    *THIS_PROCESSOR,
    "-ffp-contract=off",  # contraction to fused multiply-adds would round differently from CasADi
    "-fno-math-errno",
    "-shared",
    "-fPIC",
)
OF_GCC_ALONE = ("-fschedule-insns", "-fsched-pressure")  # Clang, which schedules anyway, refuses them
NAMES = ("c++", "g++", "clang++")
ZIG = "ziglang"  # a package that is a Clang, from pip
VERSION_SECONDS = 10.0  # for a compiler to say what it is
COMPILE_SECONDS = 300.0  # for one library; a second or two is usual, 14 were the most, but 60 the first time by Zig


class NativeUnavailable(Exception):
    """Raised where this machine cannot compile a program; the message says why."""


@dataclass(frozen=True)
class Compiler:
    """A C++ compiler and its version.

    Attributes:
        command: the program and arguments of its own (``CXX`` may have some).
        version: what it says about itself.
    """

    command: tuple[str, ...]
    version: str

    @property
    def target(self) -> str:
        """A text of everything that decides what a library compiled here and now looks like and where it runs."""
        return "\n".join([*self.command, self.version, *self.flags, processor(), *platform.libc_ver()])

    @property
    def flags(self) -> tuple[str, ...]:
        """The flags of ``FLAGS`` that this compiler knows."""
        unknown = OF_GCC_ALONE if "clang" in self.version.lower() else ()
        return tuple(flag for flag in FLAGS if flag not in unknown)

    def library(self, source: str, flags: Sequence[str] | None = None) -> bytes:
        """The shared library of a C++ source.

        Args:
            source: the text.
            flags: of the compiler; None for its own.

        Raises:
            NativeUnavailable: the compiler refuses, does not end, or there is no room for what it makes.
        """
        try:
            with TemporaryDirectory(prefix="tpbso-casadi-") as folder:
                return self._made(source, self.flags if flags is None else flags, Path(folder) / "library")
        except (OSError, NoAnswer) as error:
            raise NativeUnavailable(f"nothing was compiled: {error}") from error

    def _made(self, source: str, flags: Sequence[str], output: Path) -> bytes:
        answer = run([*self.command, *flags, "-x", "c++", "-", "-o", str(output)], COMPILE_SECONDS, source)
        if answer.status:
            raise NativeUnavailable(f"{self.command[0]} failed: {answer.first_line or f'status {answer.status}'}")
        if not output.is_file():
            raise NativeUnavailable(f"{self.command[0]} left no library")
        return output.read_bytes()


def find_compiler() -> Compiler:
    """The compiler that ``CXX`` names, the first one on ``PATH``, or that of the package ziglang.

    Raises:
        NativeUnavailable: there is none that runs.
    """
    try:
        choice = tuple(shlex.split(os.environ.get("CXX", "")))
    except ValueError as error:
        raise NativeUnavailable(f"CXX cannot be read: {error}") from error
    for command in [choice] if choice else [*((name,) for name in NAMES), *_from_pip()]:
        path = shutil.which(command[0])
        version = None if path is None else asked_version((path, *command[1:]))
        if path is not None and version is not None:
            return Compiler((path, *command[1:]), version)
    raise NativeUnavailable(f"no C++ compiler ({shlex.join(choice) or ', '.join(NAMES)}) on PATH answers")


def _from_pip() -> list[tuple[str, ...]]:
    """The command of the compiler that pip has installed, where it has."""
    return [] if find_spec(ZIG) is None else [(sys.executable, "-m", ZIG, "c++")]


@cache
def asked_version(command: tuple[str, ...]) -> str | None:
    """The version that a program states, asked once a process; None if it does not run or answer."""
    try:
        answer = run([*command, "--version"], VERSION_SECONDS)
    except (OSError, NoAnswer):
        return None
    return answer.output if answer.status == 0 else None


def processor() -> str:
    """Model and features of the processor."""
    try:
        with Path("/proc/cpuinfo").open() as lines:
            first = takewhile(str.strip, lines)
            return "".join(line for line in first if line.startswith(("model name", "flags", "Features", "CPU ")))
    except OSError:
        return f"{platform.machine()} {platform.processor()}"

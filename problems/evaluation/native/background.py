"""Compile in another process, for the rest of a search or for the next one."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from tempfile import TemporaryFile

from problems.evaluation.native import cache
from problems.evaluation.native.compiler import NativeUnavailable
from problems.evaluation.native.native import compile_library, key, usable_compiler


class BackgroundCompiler:
    """A process that compiles a C++ source into the cache, at low priority; it is not waited for.

    Args:
        source: what to compile.

    Raises:
        OSError: no process can be started.
    """

    def __init__(self, source: str) -> None:
        with TemporaryFile() as text:
            text.write(source.encode())
            text.seek(0)
            self._pid = os.posix_spawn(
                sys.executable,
                [sys.executable, "-c", f"from {__name__} import fill_cache; fill_cache()"],
                os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
                file_actions=[
                    (os.POSIX_SPAWN_DUP2, text.fileno(), 0),
                    (os.POSIX_SPAWN_OPEN, 1, os.devnull, os.O_WRONLY, 0),
                    (os.POSIX_SPAWN_DUP2, 1, 2),
                ],
                setpgroup=0,  # Ctrl-C is not meant for it
            )

    def finished(self) -> bool:
        """Whether it has ended, well or not."""
        try:
            return os.waitpid(self._pid, os.WNOHANG)[0] != 0
        except ChildProcessError:
            return True


def fill_cache() -> None:
    """Compile the C++ on standard input into the cache, unless another process is compiling.

    One at a time: many searches beside each other would otherwise start as many compilers. The next search of the
    same program tries again.
    """
    os.nice(10)
    source = sys.stdin.read()
    with suppress(NativeUnavailable, OSError), cache.compile_lock() as ours:
        if ours and cache.claim(key(source, usable_compiler())):
            compile_library(source)

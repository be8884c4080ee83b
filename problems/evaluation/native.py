"""Price candidates with code compiled for this processor, one candidate in each lane of its vector registers."""

from __future__ import annotations

import ctypes
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryFile

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation import cache
from problems.evaluation.codegen import cpp
from problems.evaluation.compiler import Compiler, NativeUnavailable, find_compiler
from problems.evaluation.portable_math import portable

GRAIN = 512  # candidates a thread: fewer do not pay for waking it
Address = ctypes.c_double * 0  # of an array's memory; four times faster than asking NumPy for it
SOURCES = ("simd.hpp", "codegen.py", "portable_math.py", "tape.py")


class Native:
    """The compiled form of a scalar function of one vector.

    Args:
        library: made by :func:`compiled`.
        threads: that share a large population.
    """

    def __init__(self, library: Path, threads: int = 1) -> None:
        self._price = ctypes.CDLL(str(library)).price
        self._price.argtypes = (ctypes.c_void_p, ctypes.c_void_p, ctypes.c_longlong)
        self._price.restype = None
        self._threads = threads

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of contiguous, writable points (m, d)."""
        parts = min(self._threads, len(points) // GRAIN)
        if parts <= 1:
            self._run(points, costs)
        else:
            cuts = zip(np.array_split(points, parts), np.array_split(costs, parts), strict=True)
            list(self._pool.map(lambda cut: self._run(*cut), cuts))

    def _run(self, points: FloatArray, costs: FloatArray) -> None:
        self._price(Address.from_buffer(points.data), Address.from_buffer(costs.data), len(points))

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self._threads)


def find_native(function: ca.Function, threads: int = 1) -> Native | None:
    """The compiled form, if it lies in the cache.

    Raises:
        NativeUnavailable: this machine has no compiler to tell whose libraries would fit.
    """
    library = cache.find(_key(function.serialize(), _compiler()))
    if library is None:
        return None
    try:
        return _loaded(library, threads)
    except NativeUnavailable:  # not made for this system
        return None


def compiled(function: ca.Function, threads: int = 1) -> Native:
    """The compiled form, made now and kept if it can be.

    Raises:
        NativeUnavailable: there is no compiler, or it refuses, or what it makes does not load.
        UnsupportedOperation: the function holds an operation that cannot be written in C++.
    """
    compiler = _compiler()
    library = compiler.library(cpp(portable(function)))
    with NamedTemporaryFile(dir=cache.scratch(), prefix=".") as file:
        file.write(library)
        file.flush()
        native = _loaded(Path(file.name), threads)
    with suppress(OSError):  # a cache that cannot be written costs the next process its time, nothing else
        cache.keep(_key(function.serialize(), compiler), library)
    return native


def _loaded(library: Path, threads: int) -> Native:
    try:
        return Native(library, threads)
    except (OSError, AttributeError) as error:
        raise NativeUnavailable(f"what was compiled cannot be loaded: {error}") from error


class BackgroundCompiler:
    """A process that compiles a function into the cache, at low priority; nobody waits for it.

    Args:
        function: what to compile.

    Raises:
        OSError: no process can be started.
    """

    def __init__(self, function: ca.Function) -> None:
        with TemporaryFile() as text:
            text.write(function.serialize().encode())
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


def _compiler() -> Compiler:
    if os.name != "posix":
        raise NativeUnavailable(f"not written for {sys.platform}")
    return find_compiler()


def _key(function: str, compiler: Compiler) -> str:
    ours = (Path(__file__).with_name(name).read_text() for name in SOURCES)
    return cache.key_of(function, ca.CasadiMeta.version(), compiler.target, *ours)


def fill_cache() -> None:
    """Compile the function on standard input into the cache, unless another process is compiling.

    One at a time: many searches beside each other would otherwise start as many compilers. Who gives up here is
    followed by the next search of the same function.
    """
    os.nice(10)
    text = sys.stdin.read()
    with suppress(NativeUnavailable, OSError), cache.compile_lock() as ours:
        if ours and cache.claim(_key(text, _compiler())):
            compiled(ca.Function.deserialize(text))

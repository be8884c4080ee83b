"""Compiled kernels as functions of a population: compiled now or in the background, loaded, called."""

from __future__ import annotations

import ctypes
import logging
import os
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from tempfile import NamedTemporaryFile, TemporaryFile
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, cache
from problems.evaluation.compiler import Compiler, NativeUnavailable, find_compiler
from problems.evaluation.kernel import KernelData

LOG = logging.getLogger(__name__)
CANDIDATES_PER_THREAD = 512  # fewer do not pay for waking it
Evaluate: TypeAlias = Callable[..., None]
Address = ctypes.c_double * 0  # of an array's memory; four times faster than asking NumPy for it


class Native:
    """A compiled program and the numbers of one scene.

    Args:
        evaluate: what :func:`find_library` or :func:`compile_library` gave.
        data: what its kernels work on.
        threads: that share a large population.
    """

    def __init__(self, evaluate: Evaluate, data: Sequence[KernelData], threads: int = 1) -> None:
        self._evaluate = evaluate
        self._numbers, self._indices = scene_of(data)
        self._scene = self._numbers.ctypes.data, self._indices.ctypes.data
        self._threads = threads

    def with_data(self, data: Sequence[KernelData]) -> Native:
        """The compiled program with the numbers of another scene."""
        return Native(self._evaluate, data, self._threads)

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) or (m, k) of contiguous, writable points (m, d)."""
        parts = min(self._threads, len(points) // CANDIDATES_PER_THREAD)
        if parts <= 1:
            self._run(points, costs)
        else:
            cuts = zip(np.array_split(points, parts), np.array_split(costs, parts), strict=True)
            list(self._pool.map(lambda cut: self._run(*cut), cuts))

    def _run(self, points: FloatArray, costs: FloatArray) -> None:
        addresses = Address.from_buffer(points.data), Address.from_buffer(costs.data)
        self._evaluate(*addresses, len(points), *self._scene)

    @cached_property
    def _pool(self) -> ThreadPoolExecutor:
        return ThreadPoolExecutor(self._threads)


def scene_of(data: Sequence[KernelData]) -> tuple[FloatArray, NDArray[np.int64]]:
    """The numbers, counts and starts of rows that compiled code reads of a scene."""
    numbers = np.concatenate([part.ravel() for each in data for part in (each.parameters, each.rows)])
    return numbers, np.concatenate([part for each in data for part in ([len(each.rows)], each.starts)]).astype(np.int64)


def name_of(source: str) -> str:
    """A digest of a C++ source, by which what is compiled from it is found."""
    return sha256(source.encode()).hexdigest()


def find_library(name: str) -> Evaluate | None:
    """The function compiled from the C++ source of that name, if it lies in the cache.

    Raises:
        NativeUnavailable: this machine has no compiler to tell whose libraries would fit.
    """
    library = cache.find(key(name, usable_compiler()))
    LOG.debug("cache: %s", "nothing compiled before" if library is None else f"compiled before, {library.name}")
    if library is not None:
        with suppress(NativeUnavailable):  # not made for this system
            return load(library)
    return None


def compile_library(source: str) -> Evaluate:
    """The function compiled from a C++ source, now; the library is cached where possible.

    Raises:
        NativeUnavailable: there is no compiler, or it refuses, or what it makes does not load.
    """
    compiler = usable_compiler()
    began = time.perf_counter()
    library = compiler.library(source)
    LOG.info("compiler: %d lines of C++ in %.3f s", source.count("\n"), time.perf_counter() - began)
    evaluate = _loaded(library)
    with suppress(OSError):  # a cache that cannot be written costs the next process its time, nothing else
        cache.store(key(name_of(source), compiler), library)
    return evaluate


def _loaded(library: bytes) -> Evaluate:
    """The function in a library that has just been made, written to a temporary folder.

    Raises:
        NativeUnavailable: there is none, or it does not load.
    """
    reason: Exception = NativeUnavailable("there is no folder for it")
    for folder in (cache.scratch(), None):
        try:
            with NamedTemporaryFile(dir=folder, prefix=".") as file:
                file.write(library)
                file.flush()
                return load(Path(file.name))
        except (OSError, NativeUnavailable) as error:
            reason = error
    raise NativeUnavailable(str(reason)) from reason


def load(library: Path) -> Evaluate:
    """The function in a library.

    Raises:
        NativeUnavailable: it does not load.
    """
    try:
        evaluate = ctypes.CDLL(str(library)).evaluate
    except (OSError, AttributeError) as error:
        raise NativeUnavailable(f"what was compiled cannot be loaded: {error}") from error
    address = ctypes.c_void_p
    evaluate.argtypes = (address, address, ctypes.c_longlong, address, address)
    evaluate.restype = None
    return evaluate


def key(name: str, compiler: Compiler) -> str:
    """The cache key of the library that this compiler makes for this processor of the source of that name."""
    return cache.key_of(name, compiler.target)


def usable_compiler() -> Compiler:
    """The C++ compiler of this machine.

    Raises:
        NativeUnavailable: there is none, or this system is not supported.
    """
    if os.name != "posix":
        raise NativeUnavailable(f"not written for {sys.platform}")
    return find_compiler()


class BackgroundCompiler:
    """A process that compiles a C++ source into the cache at low priority, without being waited for.

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
        """Whether the process has ended, successfully or not."""
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
        if ours and cache.claim(key(name_of(source), usable_compiler())):
            compile_library(source)

"""Evaluate candidates with code compiled for this processor, one candidate in each lane of its vector registers."""

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
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import TypeAlias

import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation.kernel import KernelData
from problems.evaluation.native import cache
from problems.evaluation.native.compiler import Compiler, NativeUnavailable, find_compiler

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
        self._numbers = np.concatenate([part.ravel() for each in data for part in (each.parameters, each.rows)])
        self._indices = np.concatenate([part for each in data for part in ([len(each.rows)], each.starts)])
        self._scene = self._numbers.ctypes.data, self._indices.ctypes.data
        self._threads = threads

    def with_data(self, data: Sequence[KernelData]) -> Native:
        """The same program with the numbers of another scene."""
        return Native(self._evaluate, data, self._threads)

    def __call__(self, points: FloatArray, costs: FloatArray) -> None:
        """Write the costs (m,) of contiguous, writable points (m, d)."""
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


def find_library(source: str) -> Evaluate | None:
    """The function compiled from a C++ source, if it lies in the cache.

    Raises:
        NativeUnavailable: this machine has no compiler to tell whose libraries would fit.
    """
    library = cache.find(key(source, usable_compiler()))
    LOG.debug("cache: %s", "nothing compiled before" if library is None else f"compiled before, {library.name}")
    if library is not None:
        with suppress(NativeUnavailable):  # not made for this system
            return load(library)
    return None


def compile_library(source: str) -> Evaluate:
    """The function compiled from a C++ source, made now and kept if it can be.

    Raises:
        NativeUnavailable: there is no compiler, or it refuses, or what it makes does not load.
    """
    compiler = usable_compiler()
    began = time.perf_counter()
    library = compiler.library(source)
    LOG.info("compiler: %d lines of C++ in %.3f s", source.count("\n"), time.perf_counter() - began)
    evaluate = _loaded(library)
    with suppress(OSError):  # a cache that cannot be written costs the next process its time, nothing else
        cache.keep(key(source, compiler), library)
    return evaluate


def _loaded(library: bytes) -> Evaluate:
    """The function in a library that has just been made, wherever there is room for it.

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


def key(source: str, compiler: Compiler) -> str:
    """The name of the library that this compiler makes of this source, for this processor."""
    return cache.key_of(source, compiler.target)


def usable_compiler() -> Compiler:
    """The machine's compiler.

    Raises:
        NativeUnavailable: there is none, or this system is not supported.
    """
    if os.name != "posix":
        raise NativeUnavailable(f"not written for {sys.platform}")
    return find_compiler()

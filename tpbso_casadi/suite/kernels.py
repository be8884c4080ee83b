"""Compiled kernels of a suite: built once on a machine, then loaded without CasADi.

A kernel is C++ that :mod:`problems.evaluation.codegen` wrote when the suite was frozen; it gives the same bits on every
machine. What is compiled lies in the cache of the project, whose folder is checked again here, as code is loaded from
it: looking there imports nothing but NumPy.
"""

from __future__ import annotations

import ctypes
import os
import platform
import stat
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import takewhile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from platformdirs import user_cache_path

FloatArray = NDArray[np.float64]
Evaluate = Callable[..., None]
CANDIDATES_PER_THREAD = 512  # fewer do not pay for waking it
CACHE = "TPBSO_CASADI_CACHE"  # as :mod:`problems.base.cache` reads it


class NoCompiler(RuntimeError):
    """No library of a kernel can be made on this machine; the message says why."""


@dataclass(frozen=True)
class SuiteKernel:
    """The values of candidates, for every instance of a function.

    Attributes:
        source: C++.
        values: numbers that a candidate is given: merit, objective, violations.
    """

    source: str
    values: int

    def __call__(
        self, points: FloatArray, numbers: FloatArray, indices: NDArray[np.int64], threads: int = 1
    ) -> FloatArray:
        """Values (m, k) of points (m, d), contiguous.

        Args:
            points: candidates.
            numbers: of the instance.
            indices: likewise: counts and starts of rows.
            threads: that share many candidates.

        Raises:
            NoCompiler: there is no library, and none can be made.
        """
        values = np.empty((len(points), self.values))
        evaluate, addresses = self._evaluate, (numbers.ctypes.data, indices.ctypes.data)

        def run(part: FloatArray, into: FloatArray) -> None:
            evaluate(part.ctypes.data, into.ctypes.data, len(part), *addresses)

        parts = min(threads, len(points) // CANDIDATES_PER_THREAD)
        if parts <= 1:
            run(points, values)
        else:
            with ThreadPoolExecutor(parts) as pool:
                list(pool.map(run, np.array_split(points, parts), np.array_split(values, parts)))
        return values

    @cached_property
    def _evaluate(self) -> Evaluate:
        library = _known(self._key)
        return _loaded(_built(self.source, self._key) if library is None else library)

    @property
    def _key(self) -> str:
        return sha256(f"{processor()}\n{self.source}".encode()).hexdigest()


def processor() -> str:
    """The system with model and features of the processor: they decide whether a library runs here."""
    system = " ".join((platform.system(), platform.machine(), *platform.libc_ver()))
    try:
        with Path("/proc/cpuinfo").open() as lines:
            return system + "".join(
                line for line in takewhile(str.strip, lines) if line.startswith(("model name", "flags", "Features"))
            )
    except OSError:
        return system


def _known(key: str) -> Path | None:
    """The library of a key, if nobody but the user could have written it."""
    folder = Path(os.environ.get(CACHE) or user_cache_path("tpbso-casadi"))
    path = folder / f"{key}.so"
    try:
        return path if all(_is_ours(place.lstat()) for place in (folder, path)) else None
    except OSError:
        return None


def _is_ours(status: os.stat_result) -> bool:
    """Whether it belongs to the user, is no link, and no other may write it."""
    kind = stat.S_ISDIR(status.st_mode) or stat.S_ISREG(status.st_mode)
    return kind and status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _built(source: str, key: str) -> Path:
    """The library, compiled now and kept."""
    from problems.base import cache  # noqa: PLC0415 (loads CasADi, once on a machine)
    from problems.evaluation import NativeUnavailable, usable_compiler  # noqa: PLC0415

    try:
        return cache.store(key, usable_compiler().library(source))
    except (NativeUnavailable, OSError) as error:
        raise NoCompiler(str(error)) from error


def _loaded(library: Path) -> Evaluate:
    try:
        evaluate: Evaluate = ctypes.CDLL(str(library)).evaluate
    except (OSError, AttributeError) as error:
        raise NoCompiler(f"what was compiled cannot be loaded: {error}") from error
    address = ctypes.c_void_p
    evaluate.argtypes = (address, address, ctypes.c_longlong, address, address)  # type: ignore[attr-defined]
    evaluate.restype = None  # type: ignore[attr-defined]
    return evaluate

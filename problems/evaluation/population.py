"""Price a whole population, by the fastest means that this machine and this much work allow."""

from __future__ import annotations

import logging
import os
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Literal, get_args
from weakref import finalize

import casadi as ca
import numpy as np

from problems.base.matrix import FloatArray
from problems.evaluation import cache
from problems.evaluation.compiler import NativeUnavailable
from problems.evaluation.native import BackgroundCompiler, Native, compiled, find_native
from problems.evaluation.virtual_machine import VirtualMachine

Backend = Literal["auto", "vm", "native"]
BACKENDS: tuple[str, ...] = get_args(Backend)
VARIABLE = "TPBSO_CASADI_BACKEND"
COMPILE_AFTER_SECONDS = 2.0  # seconds in the virtual machine after which compiling would have paid: about what it takes
WORTH_SECONDS = 0.1  # seconds in the virtual machine that the next search of the same function may well be spared
log = logging.getLogger(__name__)


class InvalidEvaluation(ValueError):
    """A way to price that does not exist; the message names it."""


def _default() -> str:
    return os.environ.get(VARIABLE, "auto")


@dataclass(frozen=True)
class EvaluationOptions:
    """How costs are computed. Whatever is chosen, they are the same, bit by bit.

    Attributes:
        backend: ``vm``, CasADi's virtual machine; ``native``, compiled code, made if it is not in the cache; ``auto``,
            native from the cache, else the virtual machine, while or after which a process aside fills the cache
            should the work turn out to be worth it. Default: ``$TPBSO_CASADI_BACKEND`` or ``auto``.
        threads: that compiled code may use for large populations.

    Raises:
        InvalidEvaluation: there is no such backend, or not even one thread.
    """

    backend: str = field(default_factory=_default)
    threads: int = 1

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise InvalidEvaluation(f"pricing backend {self.backend!r} is none of {', '.join(BACKENDS)}")
        if self.threads < 1:
            raise InvalidEvaluation(f"{self.threads} threads cannot price anything")


class PopulationFunction:
    """A scalar CasADi function of one vector, evaluated for every row of an array.

    Args:
        function: SX function of one input (d,) and one scalar output.
        pricing: how to evaluate it.
    """

    def __init__(self, function: ca.Function, pricing: EvaluationOptions | None = None) -> None:
        self.function = function
        self.pricing = EvaluationOptions() if pricing is None else pricing
        self._dimension = function.size1_in(0)
        self._evaluate: Callable[[FloatArray, FloatArray], None] | None = None
        self._seconds = 0.0
        self._may_compile = self.pricing.backend == "auto"
        self._afterwards: finalize[[ca.Function], PopulationFunction] | None = None
        self._aside: BackgroundCompiler | None = None

    def __reduce__(self) -> tuple[type[PopulationFunction], tuple[ca.Function, EvaluationOptions]]:
        return PopulationFunction, (self.function, self.pricing)

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d), m of any size, zero included.

        Raises:
            ValueError: the candidates are not (m, d).
            UnsupportedOperation: the function holds an operation that :mod:`problems.evaluation.tape` does not know.
        """
        if candidates.ndim != 2 or candidates.shape[1] != self._dimension:
            raise ValueError(f"candidates of shape {candidates.shape} where (m, {self._dimension}) is needed")
        points = np.ascontiguousarray(candidates, dtype=np.float64)
        if not points.flags.writeable:  # nothing is written, but its memory could not be borrowed
            points = points.copy()
        costs = np.empty(len(points))
        if self._evaluate is None:
            self._evaluate = self._first()
        started = time.perf_counter()
        self._evaluate(points, costs)
        self._seconds += time.perf_counter() - started
        if self._may_compile and self._seconds > WORTH_SECONDS:
            self._consider_compiling()
        return costs

    @property
    def backend(self) -> str:
        """What prices now: ``vm`` or ``native``."""
        return "native" if isinstance(self._evaluate, Native) else "vm"

    def _first(self) -> Callable[[FloatArray, FloatArray], None]:
        """What to begin with."""
        if self.pricing.backend == "vm":
            return VirtualMachine(self.function)
        try:
            native = find_native(self.function, self.pricing.threads)
            if native is None and self.pricing.backend == "native":
                native = compiled(self.function, self.pricing.threads)
        except NativeUnavailable as reason:
            level = logging.WARNING if self.pricing.backend == "native" else logging.INFO
            log.log(level, "priced by CasADi's virtual machine, not natively: %s", reason)
            native, self._may_compile = None, False
        if native is None:
            return VirtualMachine(self.function)
        self._may_compile = False
        return native

    def _consider_compiling(self) -> None:
        """Compile aside: at once in a long search, to change over when that is done; else after it, for the next."""
        if self._afterwards is None:
            self._afterwards = finalize(self, compile_in_background, self.function)
        if self._aside is not None and self._aside.finished():
            self._may_compile = False
            with suppress(NativeUnavailable):
                self._evaluate = find_native(self.function, self.pricing.threads) or self._evaluate
        elif self._aside is None and self._seconds > COMPILE_AFTER_SECONDS:
            self._afterwards.detach()
            self._aside = compile_in_background(self.function)
            self._may_compile = self._aside is not None


def compile_in_background(function: ca.Function) -> BackgroundCompiler | None:
    """Start to compile, where there is a processor to spare and a place to keep the result."""
    if processors() < 2 or not cache.writable():
        return None
    with suppress(OSError):
        return BackgroundCompiler(function)
    return None


def processors() -> int:
    """How many processors this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

"""The costs of a population: backends, options, threads."""

from __future__ import annotations

import logging
import os
import time
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, get_args
from weakref import finalize

import casadi as ca
import numpy as np

from problems.base import FloatArray, cache, shown
from problems.evaluation.batches import VirtualMachine
from problems.evaluation.compiler import NativeUnavailable
from problems.evaluation.kernel import KernelData, data
from problems.evaluation.native import (
    BackgroundCompiler,
    Evaluate,
    Native,
    compile_library,
    find_library,
    usable_compiler,
)
from problems.evaluation.program import Program
from problems.evaluation.structure import ProgramStructure

Backend = Literal["auto", "vm", "native"]
BACKENDS: tuple[str, ...] = get_args(Backend)
VARIABLE = "TPBSO_CASADI_BACKEND"
COMPILE_AFTER_SECONDS = 2.0  # in the virtual machine; about what compiling takes, so that a long search gains by it
WORTH_COMPILING_SECONDS = 0.1  # in the virtual machine; from here on the next search of the same program gains by it
log = logging.getLogger(__name__)


class InvalidEvaluation(ValueError):
    """Raised for evaluation options that do not exist; the message names them."""


def _default() -> str:
    return os.environ.get(VARIABLE, "auto")


@dataclass(frozen=True)
class EvaluationOptions:
    """Options of how costs are computed; whatever is chosen, costs are the same, bit by bit.

    Attributes:
        backend: ``vm``, CasADi's virtual machine; ``native``, compiled code, made if it is not in the cache; ``auto``,
            native from the cache, else the virtual machine, while or after which a background process fills the cache
            should the work turn out to be worth it. Default: ``$TPBSO_CASADI_BACKEND`` or ``auto``.
        threads: that compiled code may use for large populations.

    Raises:
        InvalidEvaluation: there is no such backend, or not even one thread.
    """

    backend: str = field(default_factory=_default)
    threads: int = 1

    def __post_init__(self) -> None:
        if self.backend not in BACKENDS:
            raise InvalidEvaluation(f"evaluation backend {self.backend!r} is none of {', '.join(BACKENDS)}")
        if self.threads < 1:
            raise InvalidEvaluation(f"{self.threads} threads cannot evaluate anything")


class PopulationFunction:
    """A program that is evaluated for every row of an array.

    Args:
        program: steps from a candidate to its cost; or an SX function of one input (d,) and one scalar output.
        options: how to evaluate it.

    Raises:
        TypeError: the program is none.
        UnsupportedOperation: a function is not written out in scalars (SX).
    """

    def __init__(self, program: Program | ca.Function, options: EvaluationOptions | None = None) -> None:
        if not isinstance(program, Program | ca.Function):
            raise TypeError(f"program: a Program or a casadi.Function is needed, not {shown(program)}")
        self.program = program if isinstance(program, Program) else Program.of(program)
        self.options = EvaluationOptions() if options is None else options
        self._structure = ProgramStructure(self.program)
        self._evaluate: Native | VirtualMachine | None = None
        self._seconds = 0.0
        self._may_compile = self.options.backend == "auto"
        self._afterwards: finalize[[str], PopulationFunction] | None = None
        self._background: BackgroundCompiler | None = None
        self._made: Native | VirtualMachine | None = None  # of another scene

    def __reduce__(self) -> tuple[type[PopulationFunction], tuple[Program, EvaluationOptions]]:
        return PopulationFunction, (self.program, self.options)

    def __call__(self, candidates: FloatArray) -> FloatArray:
        """Costs (m,) of candidates (m, d), m of any size, zero included; (m, k) of a program of k values, k > 1.

        Raises:
            ValueError: the candidates are not (m, d), or not finite.
            UnsupportedOperation: a step holds an operation that :mod:`problems.evaluation.interpreter` does not know.
        """
        self._check_shape(candidates)
        finite = np.isfinite(candidates)
        if not finite.all():
            row, column = np.argwhere(~finite)[0]
            value = candidates[row, column]
            raise ValueError(f"variable {column} of candidate {row} is {value}; finite numbers are needed")
        return self.of_any(candidates)

    def of_any(self, candidates: FloatArray) -> FloatArray:
        """Costs of candidates that may hold NaN and infinity, as IEEE arithmetic goes on with them.

        A cost may well be finite then: a minimum of NaN and a number is the number.

        Raises:
            ValueError: the candidates are not (m, d).
            UnsupportedOperation: as of a call.
        """
        self._check_shape(candidates)
        points = np.ascontiguousarray(candidates, dtype=np.float64)
        if not points.flags.writeable:  # nothing is written, but its memory could not be borrowed
            points = points.copy()
        several = (self.program.values,) if self.program.values > 1 else ()
        costs = np.empty((len(points), *several))
        if self._evaluate is None:
            self._evaluate = self._first()
        started = time.perf_counter()
        self._evaluate(points, costs)
        self._seconds += time.perf_counter() - started
        if self._may_compile and self._seconds > WORTH_COMPILING_SECONDS:
            self._consider_compiling()
        return costs

    def _check_shape(self, candidates: FloatArray) -> None:
        if candidates.ndim != 2 or candidates.shape[1] != self.program.dimension:
            raise ValueError(f"candidates of shape {candidates.shape} where (m, {self.program.dimension}) is needed")

    def with_numbers(self, parameters: FloatArray) -> PopulationFunction:
        """The steps for another scene, (q,): what was made of them serves both.

        Raises:
            InvalidProgram: the program has not as many numbers.
        """
        return self.same_structure_with(self.program.with_numbers(parameters))

    def same_structure_with(self, program: Program) -> PopulationFunction:
        """The function for a program whose steps have the same functions with other numbers in them."""
        other = PopulationFunction(program, self.options)
        other._structure = self._structure
        other._made = self._evaluate
        return other

    @property
    def backend(self) -> str:
        """The backend in use now: ``vm`` or ``native``."""
        return "native" if isinstance(self._evaluate, Native) else "vm"

    @cached_property
    def _data(self) -> tuple[KernelData, ...]:
        return data(self.program, self._structure.preparations)

    def _virtual_machine(self) -> VirtualMachine:
        return VirtualMachine(self._structure.kernels, self._data, self.program.dimension)

    def _native(self, library: Evaluate) -> Native:
        return Native(library, self._data, self.options.threads)

    def _first(self) -> Native | VirtualMachine:
        """The backend to begin with."""
        if self._made is not None:
            return self._made.with_data(self._data)
        if self.options.backend == "vm":
            return self._virtual_machine()
        try:
            usable_compiler()  # without one no source is written
            library = find_library(self._structure.source_name)
            if library is None and self.options.backend == "native":
                library = compile_library(self._structure.source)
        except NativeUnavailable as reason:
            level = logging.WARNING if self.options.backend == "native" else logging.INFO
            log.log(level, "evaluated by CasADi's virtual machine, not natively: %s", reason)
            library, self._may_compile = None, False
        if library is None:
            return self._virtual_machine()
        self._may_compile = False
        return self._native(library)

    def _consider_compiling(self) -> None:
        """Compile in the background, at once in a long search to switch over, else after it for the next."""
        if self._afterwards is None:
            self._afterwards = finalize(self, compile_in_background, self._structure.source)
        if self._background is not None and self._background.finished():
            self._may_compile = False
            with suppress(NativeUnavailable):
                library = find_library(self._structure.source_name)
                self._evaluate = self._evaluate if library is None else self._native(library)
        elif self._background is None and self._seconds > COMPILE_AFTER_SECONDS:
            self._afterwards.detach()
            self._background = compile_in_background(self._structure.source)
            self._may_compile = self._background is not None


def compile_in_background(source: str) -> BackgroundCompiler | None:
    """A process that starts to compile, where there is a processor to spare and a writable cache."""
    if processors() < 2 or not cache.writable():
        return None
    with suppress(OSError):
        log.info("compiler: begins in the background, for the rest of a long search or the next one")
        return BackgroundCompiler(source)
    return None


def processors() -> int:
    """The number of processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1

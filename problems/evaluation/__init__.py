"""Batch evaluation: the costs of thousands of candidates, by compiled code or by CasADi's virtual machine.

A cost is a :class:`Program`: small functions, of which some run once for each sample of a motion (``program``). Each
becomes a tape of operations (``interpreter``) that every processor rounds alike, without those that depend on the scene
alone (``kernel``). CasADi's virtual machine runs it anywhere (``batches``); where there is a C++ compiler it is written
as loops (``codegen``), compiled (``compiler``), cached by the program's structure (``structure``) and loaded
(``native``). The numbers of a scene are arguments of compiled code: another scene of the same structure compiles
nothing. All backends give the same bits, so that ``population`` may change from one to the other during a search.
"""

from problems.evaluation.compiler import THIS_PROCESSOR, Compiler, NativeUnavailable
from problems.evaluation.interpreter import (
    BINARY,
    UNARY,
    Interpreter,
    Symbolic,
    UnsupportedOperation,
    interpret,
    rebuilt,
)
from problems.evaluation.native import usable_compiler
from problems.evaluation.population import (
    BACKENDS,
    EvaluationOptions,
    InvalidEvaluation,
    PopulationFunction,
    processors,
)
from problems.evaluation.program import PARAMETERS, InvalidProgram, Loop, Program, RowFunction, Step
from problems.evaluation.structure import ProgramStructure

__all__ = [
    "BACKENDS",
    "BINARY",
    "PARAMETERS",
    "THIS_PROCESSOR",
    "UNARY",
    "Compiler",
    "EvaluationOptions",
    "Interpreter",
    "InvalidEvaluation",
    "InvalidProgram",
    "Loop",
    "NativeUnavailable",
    "PopulationFunction",
    "Program",
    "ProgramStructure",
    "RowFunction",
    "Step",
    "Symbolic",
    "UnsupportedOperation",
    "interpret",
    "processors",
    "rebuilt",
    "usable_compiler",
]

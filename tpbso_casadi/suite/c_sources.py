"""The suite for programs in C, and in all that can call C: a header, sources, a Makefile, an example.

The sources of ``c`` are what is the same for all; written are the kernels, the numbers of each instance, and a table of
problems.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tpbso_casadi.storage import OutputError, write_text, writing
from tpbso_casadi.suite.frozen import InvalidSuite
from tpbso_casadi.suite.kernels import FloatArray

if TYPE_CHECKING:
    from tpbso_casadi.suite.problem import SuiteProblem

SAME_FOR_ALL = Path(__file__).with_name("c")
PROBLEMS = "problems"  # the folder of what is written
FNV_OFFSET, FNV_PRIME = 0xCBF29CE484222325, 0x100000001B3
WORD = 2**64


def write_c(folder: Path, problems: Sequence[SuiteProblem]) -> None:
    """Write sources whose ``make`` builds a library of some problems.

    Args:
        folder: new or empty.
        problems: of any functions.

    Raises:
        OutputError: it holds something, or cannot be written.
        InvalidSuite: this machine does not give the suite's values.
    """
    for problem in problems:
        if not problem.is_intact():
            raise InvalidSuite(f"{problem.name}: this machine does not give the suite's values")
    with writing(folder):
        if any(folder.iterdir()):
            raise OutputError(f"{folder}: holds something already; name a new folder")
        for source in sorted(SAME_FOR_ALL.iterdir()):
            _write(folder / source.name, [source.read_text(encoding="utf-8")])
        (folder / PROBLEMS).mkdir()
        for function in dict.fromkeys(problem.function for problem in problems):
            of_function = [problem for problem in problems if problem.function is function]
            for number, _ in enumerate(function.objectives):
                _write(folder / PROBLEMS / f"{_symbol(of_function[0], number)}.cpp", _kernel(of_function, number))
        _write(folder / PROBLEMS / "table.cpp", _table(problems))


def _write(path: Path, parts: Iterable[str]) -> None:
    write_text(path, lambda file: file.writelines(parts))


def _symbol(problem: SuiteProblem, objective: int) -> str:
    """The name in C of a kernel."""
    return f"arm_motions_{problem.function.name}_{objective}".replace("-", "_")


def _kernel(problems: Sequence[SuiteProblem], objective: int) -> Iterator[str]:
    """A kernel, and what it is given for each instance."""
    symbol = _symbol(problems[0], objective)
    yield f"#define evaluate {symbol}\n{problems[0].kernel_source(objective)}\n#undef evaluate\n\n"
    for problem in problems:
        numbers, indices = problem.kernel_arguments(objective)
        yield _array("double", f"{symbol}_numbers_{problem.instance}", map(float.hex, numbers.tolist()))
        yield _array("long long", f"{symbol}_indices_{problem.instance}", map(str, indices.tolist()))


def _array(kind: str, name: str, values: Iterable[str]) -> str:
    return f"extern const {kind} {name}[] = {{{','.join(values)}}};\n"


def _table(problems: Sequence[SuiteProblem]) -> Iterator[str]:
    """All problems: what they are, their boxes, their kernels and the numbers for these."""
    yield '#include <math.h>\n\n#include "problem.hpp"\n\n'
    kernels = {_symbol(problem, k): None for problem in problems for k, _ in enumerate(problem.objectives)}
    yield from (f'extern "C" kernel {symbol};\n' for symbol in kernels)
    for number, problem in enumerate(problems):
        for name in _symbols(problem, "numbers"):
            yield f"extern const double {name}[];\n"
        for name in _symbols(problem, "indices"):
            yield f"extern const long long {name}[];\n"
        for name, corner in zip(("lower", "upper"), problem.bounds, strict=True):
            yield f"static const double {name}_{number}[] = {{{','.join(map(float.hex, corner.tolist()))}}};\n"
    yield "\nextern const Problem arm_motions_problems[] = {\n"
    for number, problem in enumerate(problems):
        yield _entry(problem, number)
    yield f"}};\nextern const int arm_motions_problem_count = {len(problems)};\n"


def _symbols(problem: SuiteProblem, what: str) -> list[str]:
    return [f"{_symbol(problem, k)}_{what}_{problem.instance}" for k, _ in enumerate(problem.objectives)]


def _entry(problem: SuiteProblem, number: int) -> str:
    """The problem's line in the table."""
    best = None if problem.best_known is None else problem.best_known.value
    counts = (problem.dimension, len(problem.objectives), len(problem.constraint_names))
    shown = (
        f'"{problem.name}"',
        *map(str, counts),
        f"lower_{number}",
        f"upper_{number}",
        *map(_number, (problem.feasible_merit, best, problem.lower_bound)),
    )
    kernels = [_symbol(problem, k) for k, _ in enumerate(problem.objectives)]
    behind = [f"{{{', '.join(names)}}}" for names in (kernels, *(_symbols(problem, w) for w in ("numbers", "indices")))]
    return f"    {{{{{', '.join(shown)}}}, {', '.join(behind)}, {_hash(problem.check_values):#x}u}},\n"


def _number(value: float | None) -> str:
    return "NAN" if value is None else "INFINITY" if np.isinf(value) else value.hex()


def _hash(tables: Iterable[FloatArray]) -> int:
    """FNV-1a of the bits of all values, a word each."""
    found = FNV_OFFSET
    for table in tables:
        for word in np.ascontiguousarray(table, dtype="<f8").view("<u8").ravel().tolist():
            found = (found ^ word) * FNV_PRIME % WORD
    return found

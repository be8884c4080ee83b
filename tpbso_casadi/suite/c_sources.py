"""The suite for programs in C, and in all that can call C: a header, sources, a Makefile, an example.

The sources of ``c`` are what is the same for all; written are the kernels, the numbers of each instance, and a table of
problems.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from math import inf
from pathlib import Path

import numpy as np

from tpbso_casadi.storage import OutputError, replacing, write_text, writing
from tpbso_casadi.suite.frozen import InvalidSuite, content_of
from tpbso_casadi.suite.kernels import FloatArray
from tpbso_casadi.suite.problem import SuiteProblem

FOLDER = Path(__file__).with_name("c")
SAME_FOR_ALL = ("Makefile", "arm_motions.h", "arm_motions.cpp", "problem.hpp", "example.c")
PROBLEMS = "problems"  # the folder of what is written
FNV_OFFSET, FNV_PRIME, WORD = 0xCBF29CE484222325, 0x100000001B3, 2**64


def write_c(folder: Path, problems: Iterable[SuiteProblem]) -> None:
    """Write sources whose ``make`` builds a library of some problems, all or none.

    Args:
        folder: new or empty.
        problems: of any functions; one that comes again counts once.

    Raises:
        OutputError: the folder holds something, or cannot be written.
        InvalidSuite: there is no problem, or this machine does not give the suite's values.
    """
    _check_empty(folder, folder)
    stated = list({problem.name: problem for problem in problems}.values())
    if not stated:
        raise InvalidSuite("there is no problem to write")
    for problem in stated:
        if not problem.is_intact():
            raise InvalidSuite(f"{problem.name}: this machine does not give the suite's values")
    with writing(folder, make=False), replacing(folder, partial(_check_empty, folder)) as staged:
        for name in SAME_FOR_ALL:
            _write(staged / name, [(FOLDER / name).read_text(encoding="utf-8")])
        (staged / PROBLEMS).mkdir()
        for function in dict.fromkeys(problem.function for problem in stated):
            of_function = [problem for problem in stated if problem.function is function]
            for number, _ in enumerate(function.objectives):
                _write(staged / PROBLEMS / f"{_symbol(of_function[0], number)}.cpp", _kernel(of_function, number))
        _write(staged / PROBLEMS / "table.cpp", _table(stated))


def _check_empty(named: Path, folder: Path) -> None:
    """Make sure that nothing would be replaced, wherever that is for the moment."""
    if folder.is_dir() and any(folder.iterdir()):
        raise OutputError(f"{named}: holds something already; name a new folder")
    if folder.exists() and not folder.is_dir():
        raise OutputError(f"{named}: is a file, not a folder")


def _write(path: Path, parts: Iterable[str]) -> None:
    write_text(path, lambda file: file.writelines(parts))


def _symbol(problem: SuiteProblem, objective: int) -> str:
    """The name in C of a kernel."""
    return f"{problem.suite}_{problem.function.name}_{objective}".replace("-", "_")


def _kernel(problems: Sequence[SuiteProblem], objective: int) -> Iterator[str]:
    """A kernel, and what it is given for each instance."""
    symbol, function = _symbol(problems[0], objective), problems[0].function
    content = content_of(problems[0].suite, function.name, function.digest)
    yield f"#define evaluate {symbol}\n{content.kernels[objective].source}\n#undef evaluate\n\n"
    for instance in (problem.instance for problem in problems):
        numbers, indices = (each[objective][instance - 1].tolist() for each in (content.numbers, content.indices))
        yield _array("double", f"{symbol}_numbers_{instance}", map(float.hex, numbers))
        yield _array("long long", f"{symbol}_indices_{instance}", map(str, indices))


def _array(kind: str, name: str, values: Iterable[str]) -> str:
    return f"extern const {kind} {name}[] = {{{','.join(values)}}};\n"


def _table(problems: Sequence[SuiteProblem]) -> Iterator[str]:
    """All problems: what they are, their boxes, their kernels and the numbers for these."""
    yield '#include <math.h>\n\n#include "problem.hpp"\n\n'
    kernels = {_symbol(problem, k): None for problem in problems for k, _ in enumerate(problem.objectives)}
    yield from (f'extern "C" kernel {symbol};\n' for symbol in kernels)
    for number, problem in enumerate(problems):
        numbers, indices = (_symbols(problem, what) for what in ("numbers", "indices"))
        yield from (f"extern const double {name}[];\n" for name in numbers)
        yield from (f"extern const long long {name}[];\n" for name in indices)
        for name, corner in zip(("lower", "upper"), problem.bounds, strict=True):
            yield f"static const double {name}_{number}[] = {{{','.join(map(float.hex, corner.tolist()))}}};\n"
        behind = ([_symbol(problem, k) for k, _ in enumerate(problem.objectives)], numbers, indices)
        told = ", ".join(f"{{{', '.join(names)}}}" for names in behind)
        yield f"static const arm_motion_content content_{number} = {{{told}, {_hash(problem.check_values):#x}u}};\n"
    yield "\nextern const arm_motion arm_motions_problems[] = {\n"
    yield from (f"    {{{_shown(problem, number)}}},\n" for number, problem in enumerate(problems))
    yield f"}};\nextern const int arm_motions_problem_count = {len(problems)};\n"


def _symbols(problem: SuiteProblem, what: str) -> list[str]:
    return [f"{_symbol(problem, k)}_{what}_{problem.instance}" for k, _ in enumerate(problem.objectives)]


def _shown(problem: SuiteProblem, number: int) -> str:
    """The fields of ``arm_motion``."""
    best = None if problem.best_known is None else problem.best_known.value
    counts = (problem.dimension, len(problem.objectives), len(problem.constraint_names))
    merits = (problem.feasible_merit, best, problem.lower_bound)
    arrays = (f"lower_{number}", f"upper_{number}")
    return ", ".join([f'"{problem.name}"', *map(str, counts), *arrays, *map(_number, merits), f"&content_{number}"])


def _number(value: float | None) -> str:
    """The number as C writes it; an infinite merit bounds nothing."""
    return "NAN" if value is None else "INFINITY" if value == inf else value.hex()


def _hash(tables: Iterable[FloatArray]) -> int:
    """FNV-1a of the bits of all values, a word each."""
    found = FNV_OFFSET
    for table in tables:
        for word in np.ascontiguousarray(table, dtype="<f8").view("<u8").ravel().tolist():
            found = (found ^ word) * FNV_PRIME % WORD
    return found

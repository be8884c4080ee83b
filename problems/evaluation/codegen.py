"""C++ of a kernel: loops over samples, candidates in the lanes of vector registers.

Every number of the tape becomes a vector with one candidate in each lane (``simd.hpp``), every comparison a mask of
lanes: there are no branches, and the processor works on as many candidates as its registers hold.

``where(c, a)`` is zero wherever c does not hold, whatever a is. Statements that serve a alone, its *region*, need not
run when c holds for no candidate of the batch. Everything is bit by bit what it is without jumps.

All vectors of a batch of candidates lie behind each other in one array ``w`` of lanes, which stays in the processor's
nearest cache. Each step is one function (several, if it is long) that reads and writes there; a loop calls it for each
row. How many rows there are and what they bring, the function is told at run time.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from itertools import accumulate
from math import inf, isfinite
from pathlib import Path

from problems.evaluation.interpreter import interpret
from problems.evaluation.kernel import Kernel
from problems.evaluation.program import CANDIDATE, COST, PARAMETERS, ROW, WINDOW

ARITHMETIC = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
COMPARISONS = {"lt": "<", "le": "<=", "eq": "==", "ne": "!="}
LOGIC = {"and": "&", "or": "|"}
OF_ONE = {"neg": "-{0}", "sq": "{0} * {0}", "twice": "{0} + {0}", "inv": "1.0 / {0}"}


class Kind(Enum):
    """The kind of an operand in C++."""

    NUMBER = auto()
    TRUTH = auto()
    CONSTANT = auto()


@dataclass(frozen=True)
class Value:
    """An operand of a C++ expression.

    Attributes:
        text: a variable's name, an input or the digits of a constant.
        kind: a number or a truth in each lane, or one constant for all.
        place: index of the statement that computes it, -1 for inputs and constants.
    """

    text: str
    kind: Kind = Kind.NUMBER
    place: int = -1


@dataclass(frozen=True)
class Statement:
    """A C++ variable: how it is computed, and from what.

    Attributes:
        value: itself.
        text: of the expression.
        operands: in it.
        condition: that of them without which it is zero in a lane; None where there is none.
    """

    value: Value
    text: str
    operands: tuple[Value, ...]
    condition: Value | None = None


class Writer:
    """An interpreter that writes one C++ statement for each operation."""

    def __init__(self) -> None:
        self.statements: list[Statement] = []

    def constant(self, value: float) -> Value:
        """A constant, exact to the bit."""
        if isfinite(value):
            return Value(f"({value.hex()})", Kind.CONSTANT)
        return Value({inf: "INFINITY", -inf: "(-INFINITY)"}.get(value, "NAN"), Kind.CONSTANT)

    def unary(self, name: str, a: Value) -> Value:
        """The statement of one operation."""
        if name == "not":
            return self._state(Kind.TRUTH, "~{}", self._truth(a))
        return self._state(Kind.NUMBER, OF_ONE.get(name, f"{name}_({{}})"), self._number(a))

    def binary(self, name: str, a: Value, b: Value) -> Value:
        """The statement of one operation."""
        if name == "if_else_zero":
            condition = self._truth(a)
            return self._state(Kind.NUMBER, "where({}, {})", condition, self._number(b), condition=condition)
        if name in LOGIC:
            return self._state(Kind.TRUTH, f"{{}} {LOGIC[name]} {{}}", self._truth(a), self._truth(b))
        if name in ARITHMETIC:
            return self._state(Kind.NUMBER, f"{{}} {ARITHMETIC[name]} {{}}", *self._numbers(a, b))
        if name in COMPARISONS:
            return self._state(Kind.TRUTH, f"{{}} {COMPARISONS[name]} {{}}", *self._numbers(a, b))
        return self._state(Kind.NUMBER, f"{name}_({{}}, {{}})", self._number(a), self._number(b))

    def result(self, a: Value) -> Value:
        """The value as a number with a statement of its own."""
        return self._state(Kind.NUMBER, "{}", self._number(a))

    def _numbers(self, a: Value, b: Value) -> tuple[Value, Value]:
        """Operands of an operator; a constant on one side needs no spreading over the lanes."""
        if b.kind is Kind.CONSTANT:
            return self._number(a), b
        return a if a.kind is Kind.CONSTANT else self._number(a), self._number(b)

    def _number(self, a: Value) -> Value:
        if a.kind is Kind.NUMBER:
            return a
        return self._state(Kind.NUMBER, "number({})" if a.kind is Kind.TRUTH else "all({})", a)

    def _truth(self, a: Value) -> Value:
        return a if a.kind is Kind.TRUTH else self._state(Kind.TRUTH, "truth({})", self._number(a))

    def _state(self, kind: Kind, text: str, *operands: Value, condition: Value | None = None) -> Value:
        place = len(self.statements)
        value = Value(f"v{place}", kind, place)
        self.statements.append(
            Statement(value, text.format(*(operand.text for operand in operands)), operands, condition)
        )
        return value


LEAST_STATEMENTS = 48  # of a region: a jump costs about as much as a dozen
BLOCK_STATEMENTS = 1000  # in one C++ function: the time to compile grows faster than their number


@dataclass(frozen=True)
class Block:
    """Statements of one C++ function.

    Attributes:
        statements: in order.
        condition: without which in any lane none of them runs, and the last one's value is zero; None where they
            always run.
    """

    statements: Sequence[Statement]
    condition: Value | None = None


def blocks_of(statements: Sequence[Statement], results: Sequence[Value]) -> list[Block]:
    """Statements in blocks, regions in blocks of their own, each after what it needs.

    Args:
        statements: in order; the place of a value is its statement's index.
        results: what has to be computed in any case.
    """
    owner = _owners(statements, results)
    levels = _levels(statements, owner)
    members: dict[int, list[Statement]] = {head: [] for head in owner if head is not None}
    for statement, head in zip(statements, owner, strict=True):
        if head is not None:
            members[head].append(statement)
    blocks: list[Block] = []
    for level in range(max(levels, default=0) + 1):
        heads = [k for k in members if levels[k] == level]
        blocks += [Block([*members[k], statements[k]], statements[k].condition) for k in heads]
        plain = [
            statement
            for k, statement in enumerate(statements)
            if levels[k] == level and owner[k] is None and k not in members
        ]
        blocks += [Block(plain[k : k + BLOCK_STATEMENTS]) for k in range(0, len(plain), BLOCK_STATEMENTS)]
    return blocks


def _owners(statements: Sequence[Statement], results: Sequence[Value]) -> list[int | None]:
    """The conditional statement that each one serves alone; None where none does or its region is too small."""
    count = len(statements)
    owner: list[int | None] = [None] * count
    seen = [False] * count
    sizes: dict[int, int] = {}

    def claim(place: int, head: int | None) -> None:
        if place >= 0:
            owner[place] = head if not seen[place] or owner[place] == head else None
            seen[place] = True

    for value in results:
        claim(value.place, None)
    for k in range(count - 1, -1, -1):
        statement, own = statements[k], owner[k]
        is_head = statement.condition is not None and own is None
        for operand in statement.operands:
            claim(operand.place, k if is_head and operand is not statement.condition else own)
        if own is not None:
            sizes[own] = sizes.get(own, 0) + 1
    return [head if head is not None and sizes[head] >= LEAST_STATEMENTS else None for head in owner]


def _levels(statements: Sequence[Statement], owner: Sequence[int | None]) -> list[int]:
    """The number of consecutive regions before each statement; a region's statements have that of its head."""
    heads = {head for head in owner if head is not None}
    needed: dict[int, int] = dict.fromkeys(heads, 0)
    levels: list[int] = []
    for k, statement in enumerate(statements):
        outside = [levels[o.place] for o in statement.operands if o.place >= 0 and owner[o.place] is None]
        level, head = max(outside, default=0), owner[k]
        if head is not None:
            needed[head] = max(needed[head], level)
        if k in heads:
            level = max(level, needed[k]) + 1
        levels.append(level)
    return [level if head is None else levels[head] for level, head in zip(levels, owner, strict=True)]


MOST_ON_STACK = 16_384  # lanes, of 64 bytes: one MiB of the eight that a thread usually has
ARGUMENTS = "lanes *w, const double *p, const double *row, const lanes *window, long long i"
EVALUATE = """
extern "C" void evaluate(
    const double *points, double *costs, long long count, const double *numbers, const long long *indices
) {{
{memory}{data}    for (long long start = 0; start < count; start += LANES) {{
        const long long rest = count - start < LANES ? count - start : LANES;
        for (int lane = 0; lane < LANES; lane++) {{
            const double *point = points + (start + (lane < rest ? lane : 0)) * {dimension};
            for (int i = 0; i < {dimension}; i++) w[i][lane] = point[i];
        }}
{loops}        for (int lane = 0; lane < rest; lane++) {results}
    }}
{release}}}
"""
DATA = """    const double *const p_{step} = numbers, *const rows_{step} = numbers + {parameters};
    const long long n_{step} = *indices, *const starts_{step} = indices + 1;
    numbers = rows_{step} + n_{step} * {row};
    indices = starts_{step} + n_{step};
"""
ONE = "costs[start + lane] = w[{cost}][lane];"
SEVERAL = """{{
            for (int k = 0; k < {count}; k++) costs[(start + lane) * {count} + k] = w[{cost} + k][lane];
        }}"""
LOOP = """        for (long long i = 0; i < n_{step}; i++) {{
            const double *const row = rows_{step} + i * {row};
            const lanes *const window = w + {window} + starts_{step}[i];
{calls}        }}
"""


class Store:
    """Slots of ``w`` in which one block of statements leaves what a later one needs.

    Args:
        blocks: the statements, block by block.
        results: read by the last block, beside its own operands.
        first: slot that is free, and all after it.
    """

    def __init__(self, blocks: Sequence[Block], results: Sequence[Value], first: int) -> None:
        self.size = first
        self._slots: dict[Value, int] = {}
        self._free: list[int] = []
        self._last_use = {
            a: number for number, block in enumerate(blocks) for s in block.statements for a in s.operands
        }
        self._last_use |= dict.fromkeys(results, len(blocks) - 1)

    def loads(self, values: Sequence[Value]) -> Iterator[str]:
        """Statements that read back what a block uses of earlier ones."""
        for value in dict.fromkeys(values):
            if value in self._slots:
                slot = f"w[{self._slots[value]}]"
                yield _assignment(value, f"whole({slot})" if value.kind is Kind.TRUTH else slot)

    def release(self, block: int) -> None:
        """Free the slots of what no block after this one needs."""
        for value in [value for value in self._slots if self._last_use[value] == block]:
            self._free.append(self._slots.pop(value))

    def saves(self, block: Block, number: int) -> Iterator[str]:
        """Statements that save what later blocks need of this one."""
        for value in (statement.value for statement in block.statements):
            if self._last_use.get(value, number) > number:
                self._slots[value] = self._free.pop() if self._free else self._grown()
                saved = f"bits({value.text})" if value.kind is Kind.TRUTH else value.text
                yield f"    w[{self._slots[value]}] = {saved};\n"

    def skip(self, block: Block) -> str:
        """A statement that leaves a saved block with zero as its result if its condition holds in no lane."""
        if block.condition is None:
            return ""
        result = self._slots[block.statements[-1].value]
        return (
            f"    if (!any({block.condition.text})) {{\n        w[{result}] = (lanes){{}};\n        return;\n    }}\n"
        )

    def _grown(self) -> int:
        self.size += 1
        return self.size - 1


def cpp(kernels: Sequence[Kernel], sizes: dict[str, int]) -> str:
    """The C++ source of ``evaluate(points, costs, count, numbers, indices)``.

    Args:
        kernels: of the steps.
        sizes: entries of all vectors, by name.

    Raises:
        UnsupportedOperation: a kernel holds an operation that cannot be written in C++.
    """
    offsets, end = _offsets(sizes)
    size, functions, data, loops = end, "", "", ""
    for step, kernel in enumerate(kernels):
        blocks, needed = _blocks(kernel, offsets, end)
        size = max(size, needed)
        functions += _functions(step, blocks)
        calls = "".join(f"            step_{step}_{k}(w, p_{step}, row, window, i);\n" for k in range(len(blocks)))
        row = kernel.function.size1_in(ROW)
        data += DATA.format(step=step, parameters=kernel.function.size1_in(PARAMETERS), row=row)
        window = offsets[kernel.window] if kernel.window else 0
        loops += LOOP.format(step=step, row=row, window=window, calls=calls)
    simd = Path(__file__).with_name("simd.hpp").read_text()
    memory, release = _memory(size)
    results = (ONE if sizes[COST] == 1 else SEVERAL).format(cost=offsets[COST], count=sizes[COST])
    frame = EVALUATE.format(
        memory=memory, data=data, dimension=sizes[CANDIDATE], loops=loops, results=results, release=release
    )
    return simd + functions + frame


def _memory(size: int) -> tuple[str, str]:
    """Declaration and release of the memory of ``w``, as the stack of a thread is limited."""
    if size <= MOST_ON_STACK:
        return f"    lanes w[{size}];\n", ""
    return f"    lanes *const w = new lanes[{size}];\n", "    delete[] w;\n"


def _offsets(sizes: dict[str, int]) -> tuple[dict[str, int], int]:
    """The place of each vector in ``w``, the candidate first, and the first slot after all of them."""
    names = [CANDIDATE, *(name for name in sizes if name not in {CANDIDATE, PARAMETERS})]
    *starts, end = accumulate((sizes[name] for name in names), initial=0)
    return dict(zip(names, starts, strict=True)), end


def _functions(step: int, blocks: Sequence[str]) -> str:
    """A step's C++ functions; a single one is part of its loop."""
    keyword = "static" if len(blocks) == 1 else "static __attribute__((noinline))"
    return "".join(f"{keyword} void step_{step}_{k}({ARGUMENTS}) {{\n{b}}}\n" for k, b in enumerate(blocks))


def _blocks(kernel: Kernel, offsets: dict[str, int], end: int) -> tuple[list[str], int]:
    """The lines of each block of a kernel, and how many slots of ``w`` they need; those from ``end`` on are free."""
    function, writer = kernel.function, Writer()
    arguments = [[_argument(name, k, offsets) for k in range(function.size1_in(name))] for name in function.name_in()]
    results = [[writer.result(a) for a in result] for result in interpret(function, arguments, writer)]
    values = [value for result in results for value in result]
    parts = blocks_of(writer.statements, values)
    store, blocks = Store(parts, values, end), []
    for number, part in enumerate(parts):
        blocks.append(_lines(part, number, store, values if number == len(parts) - 1 else []))
    for name, result in zip(function.name_out(), results, strict=True):
        place = f"{offsets[name]} + i * {len(result)}" if name in kernel.stacked else f"{offsets[name]}"
        blocks[-1] += "".join(f"    w[{place} + {k}] = {value.text};\n" for k, value in enumerate(result))
    return blocks, store.size


def _lines(block: Block, number: int, store: Store, results: Sequence[Value]) -> str:
    """The lines of one block, which has to have the results at hand at its end."""
    condition = [] if block.condition is None else [block.condition]
    used = [operand for statement in block.statements for operand in statement.operands if operand not in condition]
    first, loads = [*store.loads(condition)], [*store.loads([*used, *results])]
    assignments = [_assignment(statement.value, statement.text) for statement in block.statements]
    store.release(number)
    saves = [*store.saves(block, number)]
    return "".join([*first, store.skip(block), *loads, *assignments, *saves])


def _argument(name: str, entry: int, offsets: dict[str, int]) -> Value:
    """The operand for an entry of an input: a number for all candidates, or lanes."""
    if name == PARAMETERS:
        return Value(f"p[{entry}]", Kind.CONSTANT)
    if name == ROW:
        return Value(f"row[{entry}]", Kind.CONSTANT)
    return Value(f"window[{entry}]" if name == WINDOW else f"w[{offsets[name] + entry}]")


def _assignment(value: Value, text: str) -> str:
    return f"    const {'mask' if value.kind is Kind.TRUTH else 'lanes'} {value.text} = {text};\n"

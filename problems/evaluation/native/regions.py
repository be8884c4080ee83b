"""What only a condition asks for: computed where it holds in any lane, and jumped over where it holds in none.

``where(c, a)`` is zero wherever c does not hold, whatever a is. Statements that serve a alone, its *region*, need not
run when c holds for no candidate of the batch. Everything is bit by bit what it is without jumps.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from problems.evaluation.native.statements import Statement, Value

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
    """The conditional statement that each one serves alone; None where there is none, or its region is too small."""
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
    """After how many regions, one behind the other, each statement comes; a region's are those of its head."""
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

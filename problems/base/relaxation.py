"""Numbers of a statement that hold a motion back, and what they are where it is held back less.

What a limit is worth is seen by planning again with it a little looser. So each limit says which numbers of which
statement bound it; a copy of the whole problem in which these differ is another problem, which nothing else tells from
one that was stated so.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from problems.base.arguments import Parametric, Replacement

STEP = 0.01  # of the size of a limit: how much looser it is planned again


@dataclass(frozen=True, kw_only=True, eq=False)
class Relaxation:
    """A limit, or a load, that could be looser, and by how much.

    Attributes:
        limit: name of the constraint; ``payload`` for what is carried.
        of: the joint or value, as the constraint's column has it; else the number itself.
        statement: in which it is stated.
        values: the fields of the statement where it is looser by so much, in its unit; tighter where that is negative.
        size: of a bound, or the width of a range, in its unit; 0 where it has none.
        unit: of the size.
        least_step: less of a change is lost in what programs keep between samples, in its unit.
    """

    limit: str
    of: str
    statement: Parametric
    values: Callable[[float], Mapping[str, Any]]
    size: float
    unit: str
    least_step: float = 0.0

    @property
    def step(self) -> float:
        """The step by which the limit is looser when planned again, in its unit; negative where less is left."""
        step = max(STEP * self.size, self.least_step)
        return step if step <= self.size else -step

    def replacement(self, step: float) -> Replacement:
        """The replacement that makes the limit looser by a step, in its unit, in copies of a statement."""
        return Replacement(self.statement, self.values(step))


def entry_changed(values: tuple[Any, ...], place: int, value: Any) -> tuple[Any, ...]:
    """The tuple with another value in one place."""
    return *values[:place], value, *values[place + 1 :]

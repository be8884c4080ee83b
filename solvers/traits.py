"""What every solver class states about itself, so that the application treats all solvers alike."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from solvers.driver.budget import Budget


@dataclass(frozen=True, kw_only=True)
class Steps:
    """What the entries of a history count.

    Attributes:
        name: of one step, for the axis of a figure.
        first: number of the first entry.
    """

    name: str
    first: int


ITERATIONS = Steps(name="iteration", first=0)  # the initial population is iteration 0
STARTS = Steps(name="start", first=1)


class SolverTraits:
    """Base of all solvers, metaheuristic or gradient-based.

    Attributes:
        default_budget: used where the user states no limit.
        has_population: whether ``population`` is one of its settings.
        solves_program: whether it descends on a smooth program (:func:`solvers.descend`) rather than searching a box
            (:func:`solvers.driver.minimize`).
        steps: what the entries of its history count.
    """

    default_budget: ClassVar[Budget]
    has_population: ClassVar[bool]
    solves_program: ClassVar[bool]
    steps: ClassVar[Steps]

"""What every solver class states about itself, so that the application treats all solvers alike."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar, TypeAlias

from solvers.driver.budget import Budget

Preset: TypeAlias = Mapping[str, int | float | str]  # settings by name
NO_PRESETS: Mapping[str, Preset] = MappingProxyType({})


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
        presets: settings that belong together, by a name that stands for them: ``bso(printed)``.
    """

    default_budget: ClassVar[Budget]
    has_population: ClassVar[bool]
    solves_program: ClassVar[bool]
    steps: ClassVar[Steps]
    presets: ClassVar[Mapping[str, Preset]] = NO_PRESETS

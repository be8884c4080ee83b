"""What every method of making a front has in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from problems.evaluation import EvaluationOptions
from solvers.driver.interruption import Interruption
from tpbso_casadi.figures.style.formats import DEFAULT
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.store import Store


@dataclass(frozen=True, kw_only=True)
class Work:
    """What a method is given.

    Attributes:
        objectives: the two, and the scenario.
        store: of the points.
        plots: whether to draw figures of each plan.
        evaluation: how populations are evaluated; changes the time, not the result.
        progress: is told what begins.
        interruption: polled between plans.
        told: gets every point once it is stored.
        formats: of figures.
    """

    objectives: Objectives
    store: Store
    plots: bool
    evaluation: EvaluationOptions | None
    progress: Progress
    interruption: Interruption
    told: Callable[[Point], object]
    formats: Sequence[str] = DEFAULT


@dataclass(frozen=True)
class Method(ABC):
    """A method of making a front.

    Args:
        name: of the method.
        count: of the points to place.
    """

    name: str
    count: int

    @property
    def settings(self) -> dict[str, Any]:
        """What decides its points besides scenario and objectives; plain data."""
        return {"points": self.count}

    @abstractmethod
    def run(self, work: Work) -> None:
        """Make and store the points that are not stored yet; less, where there is a request to stop.

        Raises:
            ScenarioError: there is no such plan.
            OutputError: a plan cannot be written.
        """

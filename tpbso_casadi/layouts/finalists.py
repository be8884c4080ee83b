"""Certified plans of the best layouts that lie apart: what is promised of a layout is what was planned."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from problems.base import FloatArray
from tpbso_casadi.layouts.search import LayoutSearch, Record
from tpbso_casadi.layouts.template import LayoutTemplate
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.scenario import Scenario, ScenarioError

MISSED = 1.02  # times its least cycle is what a plan may take at most to count among those that are certified
TRIES = 3  # times as many layouts are planned as are to be certified, at most
LONGEST_WHY = 160  # characters of a reason


@dataclass(frozen=True, eq=False)
class Finalist:
    """A layout that is among the best, with its plan.

    Attributes:
        scenario: of the layout, with its frames.
        mounting: its number among the template's.
        values: of the free numbers, (d,), m and rad.
        least: what the search counted with, s.
        planned: the plan; None where there is none.
        why: there is none; else empty.
    """

    scenario: Scenario
    mounting: int
    values: FloatArray
    least: float
    planned: PlannedMotion | None
    why: str = ""

    @property
    def seconds(self) -> float:
        """The duration of the certified plan; infinite where there is none."""
        return self.planned.trajectory.duration if self.planned is not None and self.is_certified else np.inf

    @property
    def is_certified(self) -> bool:
        """Whether the plan holds for all t."""
        return self.planned is not None and self.planned.feasible

    @property
    def note(self) -> str:
        """A remark: the reason without a plan, or how far the plan is above what the search counted with."""
        if self.planned is None:
            return self.why
        if not self.is_certified:
            return "the plan is not certified"
        share = self.seconds / self.least
        return f"{share - 1.0:.1%} above what the search counted with" if share > MISSED else ""


def planned_finalists(
    found: LayoutSearch, plan: Callable[[Scenario], PlannedMotion], tell: Callable[[int, int], None]
) -> list[Finalist]:
    """Certified plans of the best layouts that lie apart, the fastest first; those that came to nothing behind them.

    A plan that takes much longer than its layout's least cycle, and one that is not certified, are kept and said, and
    the next layout is planned in its place.

    Args:
        found: by the search.
        plan: plans a scenario.
        tell: is told how many are certified, and how many are to be.
    """
    asked = found.template.section.finalists
    done: list[Finalist] = []
    for finalist in _planned(found, plan):
        done.append(finalist)
        kept = sum(each.is_certified and not each.note for each in done)
        tell(kept, asked)
        if kept >= asked or len(done) >= TRIES * asked:
            break
    return sorted(done, key=lambda each: (each.seconds, each.least))


def _planned(found: LayoutSearch, plan: Callable[[Scenario], PlannedMotion]) -> Iterator[Finalist]:
    """The best layouts, planned one after the other."""
    for record in found.archive:
        yield planned_layout(found.template, record, plan)


def planned_layout(template: LayoutTemplate, record: Record, plan: Callable[[Scenario], PlannedMotion]) -> Finalist:
    """A layout with its plan.

    Args:
        template: of the cell.
        record: of the layout.
        plan: plans a scenario.
    """
    values, mounting = np.array(record.values), record.mounting
    finalist = Finalist(template.placed(values, mounting), mounting, values, record.evaluation.seconds, None)
    try:
        return replace(finalist, planned=plan(template.scenario(values, mounting)))
    except ScenarioError as error:
        return replace(finalist, why=str(error)[:LONGEST_WHY])


def rows_of(finalists: Sequence[Finalist], template: LayoutTemplate) -> list[list[str]]:
    """The rows of a table: certified cycle, least cycle, what stands where (m and degrees), and a remark."""
    rows = []
    for each in finalists:
        seconds = f"{each.seconds:.4f}" if np.isfinite(each.seconds) else "-"
        rows.append([seconds, f"{each.least:.4f}", template.described(each.values), each.note])
    return rows

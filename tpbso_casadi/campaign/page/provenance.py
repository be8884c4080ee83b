"""What a campaign was made with, as its page states it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from solvers import Budget
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.storage.plain import settings_of


@dataclass(frozen=True, kw_only=True)
class SolverRow:
    """A solver of a campaign.

    Attributes:
        label: as stated.
        settings: all of them by name, those that no one stated too.
        budget: of a run, in words; several where it depends on the case.
        polish: descents that refine the plan; 0 for none.
    """

    label: str
    settings: Mapping[str, object]
    budget: str
    polish: int


def solver_rows(runs: Sequence[AnyRun]) -> list[SolverRow]:
    """The solvers of a campaign, in their order."""
    by_label: dict[str, list[AnyRun]] = {}
    for run in runs:
        by_label.setdefault(run.solver, []).append(run)
    return [_solver_row(label, of_label) for label, of_label in by_label.items()]


def _solver_row(label: str, runs: Sequence[AnyRun]) -> SolverRow:
    section = runs[0].section
    step = section.kind().steps.name
    budgets = dict.fromkeys(in_words(run.section.budget(), step) for run in runs)
    return SolverRow(
        label=label,
        settings=settings_of(section.build()),
        budget="; ".join(budgets),
        polish=section.polish_starts,
    )


def in_words(budget: Budget, step: str) -> str:
    """A budget: what ends a run, whichever comes first."""
    limits = [(budget.evaluations, "evaluation"), (budget.iterations, step)]
    parts = [f"{number} {name}{'s' * (number != 1)}" for number, name in limits if number is not None]
    return " or ".join(parts + ([] if budget.seconds is None else [f"{budget.seconds:g} s"]))


def seeds(runs: Sequence[AnyRun]) -> str:
    """The seeds of a campaign, in words."""
    numbers = sorted({run.seed for run in runs})
    if not numbers:
        return "none"
    together = numbers == list(range(numbers[0], numbers[-1] + 1)) and len(numbers) > 2
    return f"{numbers[0]} to {numbers[-1]}" if together else ", ".join(map(str, numbers))

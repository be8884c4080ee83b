"""What an audit says."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING, Any

from problems import CertificateStatus
from tpbso_casadi.audit_report import impossible
from tpbso_casadi.display.audit_tables import (
    PRICE_HEADINGS,
    optimum_in_words,
    price_row,
    print_run_audit,
    print_scenario_audit,
    sentences,
)
from tpbso_casadi.display.console import OutputConsole
from tpbso_casadi.facade.showing import data_frame
from tpbso_casadi.html import heading, table

if TYPE_CHECKING:
    import pandas as pd


WIDTH = 120  # columns of an audit as text


@dataclass(frozen=True, eq=False, repr=False)
class Audit(ABC):
    """An audit of a plan or of a statement; ``print(audit)`` shows all of it.

    Attributes:
        content: everything as plain data, as ``tpbso audit --json`` prints it.
    """

    content: Mapping[str, Any]

    @property
    @abstractmethod
    def constraints(self) -> list[dict[str, Any]]:
        """Each constraint with what is known of it."""

    def to_dataframe(self) -> pd.DataFrame:
        """The constraints as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame(self.constraints)

    def __str__(self) -> str:
        text = StringIO()
        self.print_on(OutputConsole(file=text, width=WIDTH))
        return text.getvalue().rstrip()

    @abstractmethod
    def print_on(self, console: OutputConsole) -> None:
        """Print all of the audit, as ``tpbso audit`` does."""


class RunAudit(Audit):
    """The certificate of a motion, constraint by constraint, how near it is to an optimum, and prices of its limits."""

    @property
    def status(self) -> CertificateStatus:
        """The status of all constraints together, for all t: certified, violated or undecided."""
        return CertificateStatus(self.content["certificate"]["verdict"])

    @property
    def not_judged(self) -> list[str]:
        """Everything that no verdict speaks of, although it is or may be there, a line each."""
        return list(self.content["certificate"]["not_judged"])

    @property
    def certified(self) -> bool:
        """Whether every constraint is proven to hold for all t."""
        return self.status is CertificateStatus.CERTIFIED

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """Each constraint of the search model with ``name``, ``rows``, ``formula``, ``unit``, ``degree`` and more.

        Worst value, bound and margin are in the constraint's unit.
        """
        return list(self.content["constraints"])

    @property
    def optimum(self) -> dict[str, Any] | None:
        """The optimum nearest to the motion, as a certified motion of its own; None where none is found.

        ``objective`` is that of this motion, exact; ``excess`` by how much the plan's is larger, relative, negative
        where the plan is better; ``program`` what the nonlinear program sees of it, at samples and smoothed.
        """
        found: dict[str, Any] | None = self.content["optimum"]
        return found

    @property
    def shadow_prices(self) -> list[dict[str, Any]]:
        """Certified savings of planning again with each limit looser; that first of which one per cent saves most.

        ``step`` is by how much it was looser (tighter where negative, where there is no looser). ``per_unit`` is the
        change of the optimum's objective by it, for one unit, ``per_cent`` for one per cent of the limit;
        ``timed_again`` and ``timed_per_cent`` are that of the plan, which is timed again and otherwise kept.
        ``constraint`` and ``column`` say which limit it is, ``size`` and ``limit_unit`` how large. Empty where no
        optimum is found, or nothing holds the motion back.
        """
        return [] if self.optimum is None else list(self.optimum["ranking"])

    @property
    def advice(self) -> list[str]:
        """Savings of a stronger motor and of a lighter payload, a sentence each."""
        return sentences(self.shadow_prices, self._unit)

    @property
    def _unit(self) -> str:
        return str(self.content["objective"]["unit"])

    @property
    def _in_words(self) -> str:
        return str(self.content["certificate"]["in_words"])

    def __repr__(self) -> str:
        active = sum(c["active"] for c in self.constraints)
        known = f"; {len(self.shadow_prices)} prices" if self.shadow_prices else ""
        return f"<audit: {self._in_words}, {len(self.constraints)} constraints, {active} active{known}>"

    def _repr_html_(self) -> str:
        keys = ("name", "worst", "bound", "unit", "margin", "status", "where")
        parts = [
            heading(f"{self._in_words} for all t"),
            table(keys, ([c[key] for key in keys] for c in self.constraints)),
        ]
        if self.optimum is not None:
            parts.append(heading("; ".join(optimum_in_words(self.content))))
        if self.shadow_prices:
            rows = [price_row(price, self._unit) for price in self.shadow_prices]
            parts += [heading("what holds the motion back"), table(PRICE_HEADINGS, rows)]
        return "".join(parts)

    def print_on(self, console: OutputConsole) -> None:
        print_run_audit(dict(self.content), console)


class ScenarioAudit(Audit):
    """The structure of a scenario's search model and of its nonlinear program, before anything is searched."""

    @property
    def constraints(self) -> list[dict[str, Any]]:
        """Each constraint of the search model with ``name``, ``rows``, ``formula``, ``unit``, ``degree`` and more."""
        return list(self.content["search"]["constraints"])

    @property
    def impossible(self) -> list[str]:
        """The names of the constraints that nothing in the search box can meet."""
        return impossible(dict(self.content))

    def __repr__(self) -> str:
        search = self.content["search"]
        never = f"; nothing meets {', '.join(self.impossible)}" if self.impossible else ""
        return f"<audit of a scenario: {search['variables']} variables, {search['rows']} rows of constraints{never}>"

    def _repr_html_(self) -> str:
        keys = ("name", "rows", "unit", "degree", "formula")
        return heading(repr(self)[1:-1]) + table(keys, ([c[key] for key in keys] for c in self.constraints))

    def print_on(self, console: OutputConsole) -> None:
        print_scenario_audit(dict(self.content), console)

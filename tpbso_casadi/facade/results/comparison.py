"""What a comparison of solvers gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.best import BestPlan
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.export import export, write_comparison
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import Run
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.campaign.table import HEADER, print_tables, rows
from tpbso_casadi.facade.results.data_frame import data_frame
from tpbso_casadi.facade.results.html import heading, table

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 100  # columns of the tables as text
SHOWN = ("case", "solver", "runs", "infeasible", "mean", "std", "best", "a12", "p_corrected", "against_first")


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Runs of solvers on scenarios, and what they show; ``print(comparison)`` shows the tables.

    Attributes:
        runs: what was done: scenario, solver and seed of each.
        results: their records, convergence and summaries.
        best: the best plan of each scenario.
    """

    runs: tuple[Run, ...]
    results: Results
    best: tuple[BestPlan, ...]

    @property
    def records(self) -> Sequence[Record]:
        """Every run in a few numbers."""
        return self.results.records

    @property
    def summaries(self) -> Sequence[Summary]:
        """The runs of each solver on each scenario together."""
        return self.results.summaries

    @property
    def table(self) -> list[dict[str, Any]]:
        """A row for each scenario (``case``) and solver.

        ``mean``, ``std``, ``best`` and ``median`` are objectives of certified plans in ``unit``; ``a12`` and ``p`` are
        those of a rank-sum test against the first solver, ``p_corrected`` by Holm over the table, and ``against_first``
        says what that shows.
        """
        return [dict(zip(HEADER, row, strict=True)) for row in rows(self.summaries)]

    @property
    def objectives(self) -> dict[tuple[str, str], FloatArray]:
        """By scenario and solver the objectives of all runs that did not fail, (n,); inf without a certified plan."""
        return {(summary.case, summary.solver): summary.objectives for summary in self.summaries}

    @property
    def failures(self) -> list[str]:
        """Why runs failed, a line each."""
        failed = (record for record in self.records if record.error)
        return [f"{record.case}, {record.solver}, seed {record.seed}: {record.error}" for record in failed]

    def to_dataframe(self) -> pd.DataFrame:
        """The table as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame(self.table)

    def runs_to_dataframe(self) -> pd.DataFrame:
        """Every run, a row each, as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame([asdict(record) for record in self.records])

    def plot(self, kind: str = "comparison") -> Figure:
        """A figure of all runs.

        Args:
            kind: ``comparison``, the gap to the best plan over the evaluations; ``ecdf``; ``critical-difference``; or
                ``effect-sizes``.

        Raises:
            ValueError: there is no such figure, or it makes no sense for these runs.
        """
        from tpbso_casadi.campaign.figures.catalogue import FIGURES  # noqa: PLC0415 (matplotlib is slow to load)
        from tpbso_casadi.facade.results.figures import shown  # noqa: PLC0415

        kinds = {figure.name: figure for figure in FIGURES}
        if kind not in kinds:
            raise ValueError(f"there is no figure {kind!r}; there are {', '.join(kinds)}")
        reason = kinds[kind].left_out(self.results)
        if reason:
            raise ValueError(f"{kind}: {reason}")
        return shown(kinds[kind].draw(self.results))

    def save(self, folder: str | Path, plots: bool = True, figures: Sequence[str] = ("png",)) -> Path:
        """Write ``summary.csv``, every run in ``runs.csv``, and a page, ``comparison.html``, with all of it.

        Args:
            folder: to write to.
            plots: whether to draw figures, on the page too.
            figures: their formats: ``png``, ``pdf``, ``svg``.

        Returns:
            The path of the folder.

        Raises:
            OutputError: it cannot be written.
        """
        formats = figures if plots else ()
        write_comparison(Path(folder), self.results, self.runs, self.best, formats=formats)
        export(self.records, Path(folder) / "runs.csv")
        return Path(folder)

    def __repr__(self) -> str:
        cases = len({summary.case for summary in self.summaries})
        solvers = len({summary.solver for summary in self.summaries})
        failed = f", {len(self.failures)} failed" if self.failures else ""
        return f"<comparison: {solvers} solvers on {cases} scenarios, {len(self.records)} runs{failed}>"

    def __str__(self) -> str:
        text = StringIO()
        print_tables(self.summaries, Console(file=text, width=WIDTH))
        return text.getvalue().rstrip()

    def _repr_html_(self) -> str:
        return heading(repr(self)[1:-1]) + table(SHOWN, ([row[key] for key in SHOWN] for row in self.table))

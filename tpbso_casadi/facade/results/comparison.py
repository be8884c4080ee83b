"""What a comparison of solvers gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from problems.base.matrix import FloatArray
from tpbso_casadi.campaign.analysis.best import Best
from tpbso_casadi.campaign.analysis.results import Results
from tpbso_casadi.campaign.export import export, write_comparison
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import AnyRun
from tpbso_casadi.campaign.statistics import Summary
from tpbso_casadi.campaign.table import HEADER, print_tables, rows
from tpbso_casadi.facade.results.data_frame import data_frame
from tpbso_casadi.facade.results.export import chosen
from tpbso_casadi.facade.results.html import heading, table
from tpbso_casadi.figures.style.formats import DEFAULT, FORMATS

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

WIDTH = 100  # columns of the tables as text
SHOWN = ("case", "solver", "runs", "infeasible", "mean", "std", "best", "a12", "p_corrected", "against_first")


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Runs of solvers on scenarios, and what they show; ``print(comparison)`` shows the tables.

    Attributes:
        results: of all runs.
        runs: what was run, scenarios with solvers and seeds.
        best: run of each scenario that has one, with what it found.
    """

    results: Results
    runs: tuple[AnyRun, ...]
    best: tuple[Best, ...]

    @property
    def records(self) -> tuple[Record, ...]:
        """Every run in a few numbers."""
        return tuple(self.results.records)

    @property
    def summaries(self) -> tuple[Summary, ...]:
        """The runs of each solver on each scenario together."""
        return tuple(self.results.summaries)

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
        """A figure of the runs.

        Args:
            kind: ``comparison``, gaps to the best plan over evaluations and of final plans; ``ecdf``, the share of
                targets reached; ``critical-difference``, mean ranks over scenarios; ``effect-sizes``, A12 of each
                solver against each.

        Raises:
            ValueError: there is no such figure, or it makes no sense for these runs.
        """
        from tpbso_casadi.campaign.figures.drawing import drawing_of  # noqa: PLC0415 (matplotlib is slow to load)
        from tpbso_casadi.facade.results.figures import shown  # noqa: PLC0415

        return shown(drawing_of(kind, self.results))

    def save(self, folder: str | Path, plots: bool = True, figures: Sequence[str] = DEFAULT) -> Path:
        """Write ``summary.csv``, every run in ``runs.csv``, the page ``comparison.html`` and, with plots, all figures.

        Args:
            folder: to write to.
            plots: whether to draw figures, on the page too.
            figures: formats of their files: ``png``, ``pdf``, ``svg``.

        Returns:
            The path of the folder.

        Raises:
            ValueError: there is no such format.
            OutputError: it cannot be written.
        """
        formats = chosen("figures", figures, FORMATS) if plots else ()
        write_comparison(Path(folder), self.results, self.runs, self.best, formats=formats)
        export(self.records, Path(folder) / "runs.csv")
        return Path(folder)

    def __repr__(self) -> str:
        cases = len({summary.case for summary in self.summaries})
        solvers = len({summary.solver for summary in self.summaries})
        failed = f", {len(self.failures)} failed" if self.failures else ""
        searched = f"{cases} {self.results.measure.case}s"
        return f"<comparison: {solvers} solvers on {searched}, {len(self.records)} runs{failed}>"

    def __str__(self) -> str:
        text = StringIO()
        print_tables(self.summaries, Console(file=text, width=WIDTH))
        return text.getvalue().rstrip()

    def _repr_html_(self) -> str:
        return heading(repr(self)[1:-1]) + table(SHOWN, ([row[key] for key in SHOWN] for row in self.table))

"""``tp.pareto``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from problems import Objective
from problems.base import FloatArray, did_you_mean, in_words, shown_value
from problems.evaluation import EvaluationOptions
from solvers import deferred_interrupt
from tpbso_casadi.facade.arguments import file_path, in_words_of_python, several, whole
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.showing import chosen, data_frame
from tpbso_casadi.facade.statement import HasScenario, What, scenario_of
from tpbso_casadi.figures.palette import DEFAULT, FORMATS
from tpbso_casadi.html import heading, picture, table
from tpbso_casadi.planning import SILENT, Progress
from tpbso_casadi.scenario import ScenarioError, plain
from tpbso_casadi.storage import read_run
from tpbso_casadi.trade_off import (
    METHODS,
    FrontWork,
    Method,
    Objectives,
    Point,
    PointFront,
    TradeOff,
    open_front,
    save_front,
)

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False, repr=False)
class Front:
    """Certified plans that no other one dominates, by the first objective.

    Attributes:
        trade_off: all points that were made, also those that are not on the front.
        method: that made them.
        points: on the front: values, duration, and what was asked for.
        plans: of the points; none of ``nsga2``, whose points have no run of their own.
    """

    trade_off: TradeOff
    method: str
    points: tuple[Point, ...]
    plans: tuple[Plan, ...]

    @property
    def objectives(self) -> tuple[str, str]:
        """The names of the two objectives, with their units."""
        return self.trade_off.headings

    @property
    def values(self) -> FloatArray:
        """The values of both objectives in their units, (n, 2)."""
        return np.array([point.values for point in self.points])

    @property
    def table(self) -> list[dict[str, Any]]:
        """A row for each point: both objectives, and the duration in s."""
        first, second = self.objectives
        return [
            {"point": p.number, first: p.values[0], second: p.values[1], "duration [s]": p.duration}
            for p in self.points
        ]

    def to_dataframe(self) -> pd.DataFrame:
        """The table as a pandas data frame; needs pandas.

        Raises:
            ImportError: pandas is not installed.
        """
        return data_frame(self.table)

    def plot(self) -> Figure:
        """The front, and the points that are dominated."""
        from tpbso_casadi.figures.notebook import notebook_figure  # noqa: PLC0415 (matplotlib is slow to load)
        from tpbso_casadi.trade_off.front_figures import front_figure  # noqa: PLC0415

        return notebook_figure(front_figure(self.trade_off))

    def save(self, folder: str | Path, figures: Sequence[str] = DEFAULT) -> Path:
        """Write the tables ``front.csv`` and ``methods.csv``, and the figure.

        Args:
            folder: to write to.
            figures: formats of the figure: ``png``, ``pdf``, ``svg``; empty for none.

        Returns:
            The path of the folder.

        Raises:
            ValueError: there is no such format.
            OutputError: it cannot be written.
        """
        save_front(Path(folder), self.trade_off, chosen("figures", figures, FORMATS))
        return Path(folder)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        least, most = self.values.min(axis=0), self.values.max(axis=0)
        ranges = (
            f"{name} {low:.4g} to {high:.4g}" for name, low, high in zip(self.objectives, least, most, strict=True)
        )
        return f"<front: {len(self)} certified plans, {', '.join(ranges)}>"

    def _repr_html_(self) -> str:
        from tpbso_casadi.figures.notebook import png_of  # noqa: PLC0415 (matplotlib is slow to load)

        rows = [list(row.values()) for row in self.table]
        return heading(repr(self)[1:-1]) + picture(png_of(self.plot()), "the front") + table(list(self.table[0]), rows)


FEWEST, MOST = 2, 1000  # points


def pareto(
    what: What | HasScenario,
    objectives: Sequence[str | type[Objective]] = ("time", "energy"),
    points: int = 8,
    *,
    method: str | None = None,
    folder: str | Path | None = None,
    overwrite: bool = False,
    plots: bool = False,
    figures: Sequence[str] = DEFAULT,
    evaluation: EvaluationOptions | None = None,
    progress: Progress = SILENT,
    told: Callable[[Point], object] = lambda point: None,
    **keys: Any,
) -> Front:
    """How much of one objective another one costs: a front of plans, each certified.

    Args:
        what: anything that :func:`plan` takes; its objective does not matter.
        objectives: two of ``time``, ``rotation``, ``length``, ``energy`` and ``work``, or classes of your own.
        points: plans to place, both ends among them. One near each end, and second attempts at what comes out
            dominated, come on top.
        method: ``epsilon-constraint``: the duration is bounded, the other objective minimised (the default where one of
            them is time); ``weighted-sum``; or ``nsga2``, to compare with.
        folder: where every point is stored the moment it is complete, each a run folder, with the tables and the figure
            of the front; the same call resumes there. Nothing is kept by default.
        overwrite: whether to drop what another scenario or setting left in the folder.
        plots: whether to draw the figures of each plan in the folder.
        figures: formats of all figures in the folder: ``png``, ``pdf``, ``svg``.
        evaluation: how populations are evaluated; changes the time, not the result.
        progress: is told what begins, and the status after every iteration.
        told: gets every point once it is stored.
        keys: that state a task, or override keys of the scenario, as for :func:`plan`.

    Raises:
        ScenarioError: naming the first wrong argument; or no plan is certified.
        ValueError: there is no such format.
        OutputError: the folder cannot be written, or holds another front.
        KeyboardInterrupt: Ctrl-C; complete points are stored where there is a folder.
    """
    with in_words_of_python(), ExitStack() as opened:
        names = tuple(plain(objective) for objective in several("objectives", objectives, "two objectives"))
        _check(points, method)
        place = None if folder is None else file_path("folder", folder)
        stated = Objectives(scenario_of(what, **keys), names)
        formats = chosen("figures", figures, FORMATS)
        place = place or Path(opened.enter_context(TemporaryDirectory()))
        made, store = open_front(stated, method, points, place, overwrite)
        with deferred_interrupt() as interruption:
            work = FrontWork(
                objectives=stated,
                store=store,
                formats=formats if plots and folder is not None else (),
                evaluation=evaluation,
                progress=progress,
                interruption=interruption,
                told=told,
            )
            trade_off = completed(made, work, formats if folder is not None else ())
            if interruption.requested:
                raise KeyboardInterrupt
        return _front(trade_off, made.name, place)


def completed(method: Method, work: FrontWork, formats: Sequence[str]) -> TradeOff:
    """All that is in a folder once a method has made its points there, or as many as Ctrl-C let it, tables included.

    Args:
        method: of :func:`open_front`.
        work: likewise.
        formats: of the figure of the front.

    Raises:
        ScenarioError: there is no such plan.
        OutputError: it cannot be written.
    """
    method.run(work)
    store = work.store
    trade_off = TradeOff(work.objectives.headings, {name: store.points(name) for name in store.methods})
    if trade_off.points:
        save_front(store.folder, trade_off, formats)
    return trade_off


def _check(points: int, method: str | None) -> None:
    if not FEWEST <= whole("points", points) <= MOST:
        raise ScenarioError(f"points: {shown_value(points)} is not within {FEWEST} and {MOST}")
    if method is not None and not (isinstance(method, str) and method in METHODS):
        raise ScenarioError(
            f"method: {in_words(list(METHODS))} is needed, not {shown_value(method)}{did_you_mean(method, METHODS)}"
        )


def _front(trade_off: TradeOff, method: str, place: Path) -> Front:
    """The front with its plans.

    Raises:
        ScenarioError: it is empty.
    """
    points = PointFront.of(trade_off.points.get(method, ())).points
    if not points:
        raise ScenarioError("no plan is certified, not even at an end of the front: more evaluations, or another seed")
    plans = [Plan(read_run(place / point.folder)) for point in points if point.folder]
    return Front(trade_off, method, points, tuple(plans))

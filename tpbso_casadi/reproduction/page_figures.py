"""Figures of the report.

Imported only where a figure is drawn: matplotlib is slow to load.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from string import ascii_lowercase
from typing import Any, TypeAlias

import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player import player
from tpbso_casadi.figures.curves import convergence_figure, curve_figures, joints_figure, progress_figures, searched
from tpbso_casadi.figures.palette import colour_of, line_of, marker_of
from tpbso_casadi.figures.path import path_figure
from tpbso_casadi.judging.figures import draw_runs
from tpbso_casadi.judging.run import Run
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.planning import plan
from tpbso_casadi.reproduction.experiment import (
    BASES,
    ITERATIONS,
    NAMES,
    PATHS,
    ROTATION,
    TIME,
    CostHistory,
    Evidence,
    Order,
    convergence_iteration,
    label,
)
from tpbso_casadi.reproduction.scaling import Pace
from tpbso_casadi.scenario import TITLES, builtin, parse_scenario
from tpbso_casadi.storage import RunResult

DPI = 200


@dataclass(frozen=True)
class ReportPicture:
    """An image for a page.

    Attributes:
        caption: what it shows.
        image: WebP.
    """

    caption: str
    image: bytes


@dataclass(frozen=True)
class Illustration:
    """A case to look at.

    Attributes:
        case: its name.
        seed: of the run that is shown.
        objective: that this run has when it is done again for the pictures.
        pictures: in the paper's order.
        player: the arm in motion, HTML.
    """

    case: str
    seed: int
    objective: float
    pictures: tuple[ReportPicture, ...]
    player: Markup


def illustrate(case: str, scenario: str, histories: Sequence[Sequence[float | None]]) -> Illustration:
    """Repeat a run and draw it.

    Args:
        case: its name.
        scenario: JSON, with solver and seed.
        histories: the best costs over the iterations of all runs of the same solver.
    """
    repeated = plan(parse_scenario(json.loads(scenario)))
    convergence = convergence_figure(repeated)
    add_other_runs(convergence, histories, searched(repeated)[0].objective_upper_bound)
    figures = [("convergence; grey: the other runs", convergence), *progress_figures(repeated).values()]
    figures.append(("path and postures", path_figure(repeated)))
    figures += curve_figures(repeated).values() or [("joints", joints_figure(repeated))]
    pictures = tuple(
        ReportPicture(f"({letter}) {caption}", webp(figure))
        for letter, (caption, figure) in zip(ascii_lowercase, figures, strict=False)
    )
    moving = player(case, frames_of(repeated.motion))
    return Illustration(case, repeated.scenario.solver.seed, repeated.objective, pictures, moving)


def add_other_runs(figure: Figure, histories: Sequence[Sequence[float | None]], feasible: float) -> None:
    """Draw the convergence of other runs behind that of the plan, where their cost is feasible: up to so much."""
    axes = figure.axes[0]
    for history in histories:
        cost = np.array(history, dtype=np.float64)
        cost[~(cost <= feasible)] = np.nan
        axes.step(np.arange(cost.size), cost, where="post", color="0.75", linewidth=0.7, zorder=0)


def webp(figure: Figure) -> bytes:
    """A figure as an image."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="webp", dpi=DPI, pil_kwargs={"lossless": True, "method": 4})
    return buffer.getvalue()


SOLVERS = ("ga", "pso", "bso")
OFFSET = 0.26  # between the solvers of one case


def figure_17(evidence: Evidence) -> ReportPicture:
    """Every run of the three solvers, two to five links: time left, rotation right, a row for each basis."""
    figure = Figure(figsize=(11.0, 7.6), layout="constrained")
    panels = figure.subplots(len(BASES), 2)
    for row, basis in zip(panels, BASES, strict=True):
        for axes, cases, quantity in zip(row, (TIME, ROTATION), ("time [s]", "joint rotation [rad]"), strict=True):
            for place, case in enumerate(cases):
                for index, solver in enumerate(SOLVERS):
                    summary, centre = evidence.of(case, solver, basis), place + OFFSET * (index - 1)
                    draw_runs(axes, centre, summary, colour_of(index), OFFSET * 0.8, marker_of(index))
            axes.set_xticks(range(len(cases)), [case.rsplit("-", 1)[1] for case in cases])
            axes.set(xlabel="links", ylabel=quantity, title=basis)
            axes.grid(axis="y", alpha=0.3)
    for index, solver in enumerate(SOLVERS):
        panels[0, 0].plot([], [], marker_of(index), color=colour_of(index), label=NAMES[solver])
    panels[0, 0].legend(loc="upper left")
    return ReportPicture("each run a point, the mean of the feasible ones a line", webp(figure))


def scaling_figure(scaling: Mapping[str, Any], orders: Mapping[str, Order], unit: str) -> ReportPicture:
    """One panel for each experiment and symbol, both axes logarithmic; dotted: the printed power."""
    panels = [(experiment, symbol) for experiment in orders for symbol in scaling[experiment]]
    columns = 4
    rows = -(-len(panels) // columns)
    figure = Figure(figsize=(11.0, 2.5 * rows), layout="constrained")
    all_axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, (experiment, symbol) in zip(all_axes, panels, strict=False):
        for solver, row in scaling[experiment][symbol].items():
            sizes, values = np.array(row["sizes"], dtype=np.float64), np.array(row["values"])
            index = SOLVERS.index(solver)
            axes.loglog(sizes, values, **line_of(index), marker=marker_of(index), label=NAMES[solver], markersize=4)
            power = orders[experiment].exponents[symbol]
            axes.loglog(sizes, values[-1] * (sizes / sizes[-1]) ** power, ":", color="0.5", zorder=0)
        axes.set_title(f"{orders[experiment].title}: ${symbol[0]}_{{{symbol[2:]}}}$", fontsize=9)
        axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
        axes.xaxis.set_minor_locator(NullLocator())
        axes.tick_params(labelsize=7, which="both")
        axes.grid(alpha=0.3)
    for axes in all_axes[len(panels) :]:
        axes.set_axis_off()
    all_axes[0].set_ylabel(unit)
    all_axes[0].legend(fontsize=7)
    return ReportPicture(f"{unit} against each size; dotted: the printed growth through the largest", webp(figure))


CompletedRun: TypeAlias = tuple[Run, RunResult]


def gather(runs: list[Run], store: RunStore, scaling: dict[str, Any], pace: Pace) -> Evidence:
    """The evidence in a store.

    Args:
        runs: all of the reproduction.
        store: those of them that were done.
        scaling: as measured by :mod:`tpbso_casadi.reproduction.scaling`.
        pace: as measured by :mod:`tpbso_casadi.reproduction.scaling`.
    """
    convergence, distances = {}, {}
    histories: dict[tuple[str, str, str], list[CostHistory]] = {}
    for case in TITLES:
        upper_bound = builtin(case).problem().objective_upper_bound
        for basis in BASES:
            for solver in NAMES:
                results = [result for _, result in completed_runs(runs, store, case, label(solver, basis))]
                histories[case, solver, basis] = [result.history.cost for result in results]
                if solver == "bso" and case in PATHS:
                    distances[case, basis] = [largest_distance(result) for result in results]
            iterations = (convergence_iteration(history, upper_bound) for history in histories[case, "bso", basis])
            convergence[case, basis] = [pair for pair in iterations if pair is not None]
    return Evidence(runs, store.records(runs), convergence, distances, histories, scaling, pace)


def completed_runs(runs: Iterable[Run], store: RunStore, case: str, solver: str) -> list[CompletedRun]:
    """The runs of one solver, by its label, on one case with their whole results; without those that failed."""
    completed = []
    for run in runs:
        if (run.case, run.solver) == (case, solver):
            try:
                completed.append((run, store.result(run)))
            except KeyError:
                continue
    return completed


def largest_distance(result: RunResult) -> float:
    """The largest distance of a plan along a path from a given point, m."""
    worst = next(constraint.worst for constraint in result.constraints if constraint.name == "accuracy")
    return float("inf") if worst is None else worst


def illustrations(runs: list[Run], store: RunStore, executor: Executor) -> list[Illustration]:
    """The median run of TPBSO at equal iterations on each case, repeated and drawn."""
    futures = []
    for case in TITLES:
        completed = completed_runs(runs, store, case, label("bso", ITERATIONS))
        if not completed:
            continue
        median, _ = median_run(completed)
        histories = [result.history.cost for run, result in completed if run is not median]
        futures.append(executor.submit(illustrate, case, median.task[0], histories))
    return [future.result() for future in futures]


def median_run(completed: list[CompletedRun]) -> CompletedRun:
    """The run in the middle, infeasible ones last; the better one of two in the middle."""

    def rank(one: CompletedRun) -> tuple[bool, float, int]:
        run, result = one
        value = result.objective.value
        return not result.feasible, float("inf") if value is None else value, run.seed

    return sorted(completed, key=rank)[(len(completed) - 1) // 2]

"""``pareto(...)``: two objectives against each other, a front of certified plans."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from problems import Objective
from problems.evaluation import EvaluationOptions
from solvers.driver.interruption import deferred_interrupt
from tpbso_casadi.facade.arguments.messages import in_words_of_python
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.facade.results.export import chosen
from tpbso_casadi.facade.results.front import Front
from tpbso_casadi.facade.results.stored_plan import StoredPlan
from tpbso_casadi.facade.statement import HasScenario, What, scenario_of
from tpbso_casadi.figures.style.formats import DEFAULT, FORMATS
from tpbso_casadi.planning.plan import SILENT
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.validation import hint, in_words
from tpbso_casadi.storage.stored_run import read_run
from tpbso_casadi.trade_off.front import Front as FrontOfPoints
from tpbso_casadi.trade_off.methods import METHODS, method_named
from tpbso_casadi.trade_off.objectives import Objectives
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.store import Store
from tpbso_casadi.trade_off.table import TradeOff
from tpbso_casadi.trade_off.work import Work

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
        names = tuple(plain(objective) for objective in objectives)
        stated = Objectives(scenario_of(what, **keys), names)
        _check(points, method)
        formats = chosen("figures", figures, FORMATS)
        made = method_named(method, stated, points)
        place = Path(opened.enter_context(TemporaryDirectory())) if folder is None else Path(folder)
        asked = {"scenario": stated.scenario.model_dump(), "objectives": stated.names}
        store = Store.open(place, asked, made.name, made.settings, overwrite)
        stated.problems()  # what cannot be planned is said before anything is
        with deferred_interrupt() as interruption:
            work = Work(
                objectives=stated,
                store=store,
                plots=plots and folder is not None,
                formats=formats,
                evaluation=evaluation,
                progress=progress,
                interruption=interruption,
                told=told,
            )
            made.run(work)
            if interruption.requested:
                raise KeyboardInterrupt
        front = _front(TradeOff(stated.headings, {made.name: store.points(made.name)}), made.name, place)
    if folder is not None:
        front.save(folder, formats)
    return front


def _check(points: int, method: str | None) -> None:
    if not isinstance(points, int | np.integer) or not FEWEST <= points <= MOST:
        raise ScenarioError(f"points: {points!r} is not within {FEWEST} and {MOST}")
    if method is not None and method not in METHODS:
        raise ScenarioError(f"method: {in_words(list(METHODS))} is needed, not {method!r}{hint(method, METHODS)}")


def _front(trade_off: TradeOff, method: str, place: Path) -> Front:
    """The front with its plans.

    Raises:
        ScenarioError: it is empty.
    """
    points = FrontOfPoints.of(trade_off.points[method]).points
    if not points:
        raise ScenarioError("no plan is certified, not even at an end of the front: more evaluations, or another seed")
    plans = [StoredPlan.of(read_run(place / point.folder)) for point in points if point.folder]
    return Front(trade_off, method, points, tuple(plans))

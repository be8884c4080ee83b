"""``tp.layout``: where the robot, bins and fixtures of a cell stand so that its cycle is short."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TextIO

from tpbso_casadi.facade.arguments import file_path, in_words_of_python, whole
from tpbso_casadi.facade.layouts import EVALUATIONS, Layouts
from tpbso_casadi.layouts import (
    EvaluatedLayouts,
    LayoutEvaluator,
    LayoutTemplate,
    Record,
    header_of,
    planned_finalists,
    read_records,
    searched,
)
from tpbso_casadi.planning import SILENT, Progress, plan
from tpbso_casadi.scenario import (
    LayoutSection,
    Scenario,
    ScenarioError,
    as_scenario_errors,
    plain,
    stated_scenario,
)
from tpbso_casadi.storage import check_writable


def layout(
    what: Scenario | str | Path,
    *,
    free: Mapping[str, Mapping[str, Any]] | None = None,
    apart: Iterable[tuple[str, str, float]] | None = None,
    solver: str | None = None,
    evaluations: int | None = None,
    restarts: int | None = None,
    time_limit: float | None = None,
    finalists: int | None = None,
    spare: float | None = None,
    seed: int | None = None,
    workers: int = 1,
    folder: str | Path | None = None,
    progress: Progress = SILENT,
) -> Layouts:
    """Search where the robot, bins and fixtures of a cell stand, and plan the best layouts with certificates.

    The search counts with the least cycle between postures, along ways of the tool that are timed and clear. Layouts
    are told apart by what was planned and certified. That a layout is the best of all is not proven: it is the best of
    those that were evaluated.

    Args:
        what: the file of a scenario of a sequence, or one as :func:`stated_scenario` reads it, with its frames.
        free: by the name of a frame, or "robot" for its base: ranges ``x``, ``y``, ``z`` in m and ``turn`` in rad about
            the vertical axis, each (least, most), and ``mountings``, quaternions to choose from. Those of the
            scenario's [layout] by default, and so are all others.
        apart: (name, name, distance in m): what keeps a distance, seen from above.
        solver: that searches.
        evaluations: of layouts, in each search.
        restarts: searches, each with a seed of its own.
        time_limit: of each search, s; certified plans come after them.
        finalists: layouts of which certified plans are made.
        spare: kept from everything in the search beyond what certificates need, m.
        seed: of the first search.
        workers: processes, which change the time and not the result; in a script with more than one, the call stands
            below ``if __name__ == "__main__":``.
        folder: where every evaluation is written; those that are there already are not made again.
        progress: is told what begins, and the status of each search.

    Raises:
        ScenarioError: naming what is wrong.
    """
    own = {"solver": solver, "evaluations": evaluations, "restarts": restarts, "time_limit": time_limit}
    own |= {"finalists": finalists, "spare": spare, "seed": seed}
    keys = {key: value for key, value in own.items() if value is not None}
    with in_words_of_python():
        count = whole("workers", workers)
        template = LayoutTemplate(_with_section(_stated(what), free, apart, keys))
        return laid_out(template, count, None if folder is None else file_path("folder", folder), progress)


def laid_out(template: LayoutTemplate, workers: int, folder: Path | None, progress: Progress) -> Layouts:
    """The layouts of a template; as :func:`layout`."""
    began = time.perf_counter()
    with _log(template, folder) as (known, file), EvaluatedLayouts(LayoutEvaluator(template), workers, file) as layouts:
        layouts.remember(known)
        progress.phase("searching layouts")
        found = searched(layouts, progress.status)
    asked = template.section.finalists

    def tell(done: int, total: int) -> None:
        progress.phase(f"planning layouts, {done} of {total} certified")

    tell(0, asked)
    planned = planned_finalists(found, plan, tell)
    return Layouts(template, found, planned, layouts.records, time.perf_counter() - began, workers)


@contextmanager
def _log(template: LayoutTemplate, folder: Path | None) -> Iterator[tuple[list[Record], TextIO | None]]:
    """The evaluations that a folder has, and the file to which others are added; none without a folder."""
    if folder is None:
        yield [], None
        return
    check_writable(folder)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / EVALUATIONS
    known, is_new = read_records(path, template), not path.exists()
    with path.open("a", encoding="utf-8") as file:
        if is_new:
            file.write(header_of(template) + "\n")
        yield known, file


def _stated(what: Scenario | str | Path) -> Scenario:
    """The scenario as it is stated, with its frames.

    Raises:
        ScenarioError: it cannot be read.
    """
    if isinstance(what, Scenario):
        return what
    if not isinstance(what, str | os.PathLike):
        raise ScenarioError("what: the file of a scenario, or one of tp.stated_scenario(...), is needed")
    return stated_scenario(what, outside_allowed=True)


def _with_section(
    scenario: Scenario,
    free: Mapping[str, Mapping[str, Any]] | None,
    apart: Iterable[tuple[str, str, float]] | None,
    keys: Mapping[str, Any],
) -> Scenario:
    """The scenario whose [layout] says what the arguments say."""
    table: dict[str, Any] = {} if scenario.layout is None else scenario.layout.table()
    table |= plain(dict(keys))
    if free is not None:
        if not isinstance(free, Mapping):
            raise ScenarioError('free: {"robot": {"x": (-0.5, 0.5)}} is needed, by the names of places')
        table["free"] = [{"place": place, **plain(dict(ranges))} for place, ranges in free.items()]
    if apart is not None:
        rows = [list(each) for each in apart]
        if any(len(row) != 3 for row in rows):
            raise ScenarioError("apart: (name, name, distance) is needed")
        table["apart"] = [{"between": row[:2], "distance": row[2]} for row in rows]
    if not table:
        return scenario
    with as_scenario_errors("layout"):
        return scenario.replaced(layout=LayoutSection.from_table(table))

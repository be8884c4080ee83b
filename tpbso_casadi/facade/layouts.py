"""The layouts that were found for a cell: table, map, plan, and the folder that holds them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w

from problems.base import FloatArray
from tpbso_casadi.facade.arguments import file_path, whole
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.layouts import (
    INFEASIBLE,
    ROBOT,
    CycleMap,
    EvaluatedLayouts,
    Finalist,
    LayoutEvaluator,
    LayoutSearch,
    LayoutTemplate,
    Record,
    cycle_map,
    header_of,
    outlines_around,
    rows_of,
)
from tpbso_casadi.scenario import Scenario, ScenarioError, plain
from tpbso_casadi.storage import check_writable, write_text, write_with

EVALUATIONS, SUMMARY, CONVERGENCE = "evaluations.jsonl", "layout.json", "convergence.png"
MAP_POINTS = 15  # of a map, in each direction


@dataclass(frozen=True, eq=False)
class Layouts:
    """The layouts that were found for a cell, those with certified plans first.

    Attributes:
        template: of the cell, with the names of the free numbers.
        found: by the search.
        finalists: the best layouts that lie apart, planned; the fastest that is certified first.
        records: of every layout that was evaluated.
        seconds: that searching and planning took.
        workers: processes that evaluated.
    """

    template: LayoutTemplate
    found: LayoutSearch
    finalists: list[Finalist]
    records: list[Record]
    seconds: float
    workers: int

    def __repr__(self) -> str:
        best = f"{self.finalists[0].seconds:.6g} s, certified" if self.is_certified else "none is certified"
        return f"<best of {len(self.records)} layouts, of which {self.feasible} can be: {best}>"

    @property
    def feasible(self) -> int:
        """How many of the evaluated layouts can be."""
        return sum(bool(np.isfinite(record.evaluation.seconds)) for record in self.records)

    @property
    def is_certified(self) -> bool:
        """Whether the plan of a layout holds for all t."""
        return bool(self.finalists) and self.finalists[0].is_certified

    @property
    def best(self) -> Finalist:
        """The layout with the fastest certified plan.

        Raises:
            ScenarioError: none has one.
        """
        if not self.is_certified:
            raise ScenarioError(f"layout: no certified plan; {self.why}")
        return self.finalists[0]

    @property
    def plan(self) -> Plan:
        """The plan of the best layout.

        Raises:
            ScenarioError: none has one.
        """
        planned = self.best.planned
        assert planned is not None
        return Plan(planned)

    @property
    def why(self) -> str:
        """The reason for which no layout was certified, as far as one is known: that of the one which came farthest."""
        notes = [finalist.note for finalist in self.finalists if finalist.note]
        if notes:
            return notes[0]
        nearest = min(self.records, key=lambda record: record.evaluation.cost, default=None)
        return "nothing was evaluated" if nearest is None else nearest.evaluation.why

    @property
    def table(self) -> list[list[str]]:
        """A row for each finalist, as text: certified cycle, what the search counted with, the layout, a remark."""
        return rows_of(self.finalists, self.template)

    def map(self, place: str = ROBOT, points: int = MAP_POINTS) -> CycleMap:
        """The least cycle where a place stands elsewhere, everything else as in the best layout.

        Args:
            place: "robot", or the name of a frame, whose x and y are free.
            points: in each direction.

        Raises:
            ScenarioError: its x and y are not free, or no layout can be.
        """
        x, mounting = self._best_point()
        with EvaluatedLayouts(LayoutEvaluator(self.template), self.workers) as layouts:
            return cycle_map(layouts, x, mounting, place, whole("points", points))

    def _best_point(self) -> tuple[FloatArray, int]:
        if not self.finalists:
            raise ScenarioError(f"layout: there is none to draw a map around; {self.why}")
        return self.finalists[0].values, self.finalists[0].mounting

    def show_map(self, drawn: CycleMap, file: str | Path | None = None) -> Any:
        """The figure of a map, in which what stands around is drawn; written where a file is named."""
        from tpbso_casadi.layouts.figures import map_figure  # noqa: PLC0415 (loads matplotlib)

        x, mounting = self._best_point()
        placed, world = self.template.placed(x, mounting), self.template.scenario(x, mounting)
        first, second = self.template.across(drawn.place)
        figure = map_figure(drawn, outlines_around(placed, world), (float(x[first]), float(x[second])))
        if file is not None:
            write_with(file_path("file", file), figure.savefig)
        return figure

    def save(self, folder: str | Path, figures: bool = True) -> Path:
        """Write the scenarios of the finalists, their table, the best plan, the evaluations and figures.

        Args:
            folder: to write.
            figures: whether to draw how the searches converged.

        Returns:
            The path of the folder.

        Raises:
            OutputError: the folder cannot be written.
        """
        place = file_path("folder", folder)
        check_writable(place)
        place.mkdir(parents=True, exist_ok=True)
        _write(place / SUMMARY, json.dumps(self._summary(), indent=1) + "\n")
        if not (place / EVALUATIONS).exists():
            lines = [header_of(self.template), *(record.line() for record in self.records)]
            _write(place / EVALUATIONS, "\n".join([*lines, ""]))
        certified = [finalist for finalist in self.finalists if finalist.is_certified]
        for number, finalist in enumerate(certified, start=1):
            _write(place / f"layout-{number}.toml", tomli_w.dumps(_without_layout(finalist.scenario)))
        if certified:
            self.plan.save(place / "best", figures=("png",) if figures else ())
        if figures:
            from tpbso_casadi.layouts.figures import convergence_figure  # noqa: PLC0415 (loads matplotlib)

            histories = [(run.history.evaluations, run.history.cost) for _, run in self.found.results]
            shown = [(evaluations, np.where(cost < INFEASIBLE, cost, np.inf)) for evaluations, cost in histories]
            figure = convergence_figure(shown, [each.seconds for each in certified])
            write_with(place / CONVERGENCE, figure.savefig)
        return place

    def _summary(self) -> dict[str, Any]:
        rows = [
            {
                "seconds": each.seconds if np.isfinite(each.seconds) else None,
                "search_seconds": each.least,
                "values": dict(zip((v.name for v in self.template.variables), each.values.tolist(), strict=True)),
                "note": each.note,
            }
            for each in self.finalists
        ]
        section = self.template.section
        return {
            "finalists": rows,
            "evaluations": len(self.records),
            "feasible": self.feasible,
            "solver": section.solver,
            "seed": section.seed,
            "seconds": self.seconds,
            "layout": section.table(),
        }


def _without_layout(scenario: Scenario) -> dict[str, Any]:
    """The tables of a scenario that is not searched any more, as TOML can say them."""
    content: dict[str, Any] = _without_none(plain(scenario.replaced(layout=None).table()))
    return content


def _write(path: Path, text: str) -> None:
    write_text(path, lambda file: file.write(text))


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_none(entry) for key, entry in value.items() if entry is not None}
    return [_without_none(entry) for entry in value] if isinstance(value, list | tuple) else value

"""The tables of a trade-off: ``front.csv``, a row a point, and ``methods.csv``, what each method's front is worth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from tpbso_casadi.storage.files import write_csv, writing
from tpbso_casadi.trade_off.front import Front, hypervolume, reference_point
from tpbso_casadi.trade_off.point import Pair, Point

FRONT, METHODS, FIGURE = "front.csv", "methods.csv", "front"  # the figure has a suffix for each format


@dataclass(frozen=True)
class Summary:
    """What the front of a method is worth, and what it took.

    Attributes:
        method: its name.
        points: made; of several runs of one point, each counts.
        on_front: of them.
        hypervolume: in the product of both units.
        evaluations: of all searches.
        seconds: of all plans.
    """

    method: str
    points: int
    on_front: int
    hypervolume: float
    evaluations: int
    seconds: float


@dataclass(frozen=True)
class TradeOff:
    """All points of all methods.

    Attributes:
        headings: the objectives with their units.
        points: by method.
    """

    headings: tuple[str, str]
    points: Mapping[str, list[Point]]

    @property
    def fronts(self) -> dict[str, Front]:
        """By method."""
        return {method: Front.of(points) for method, points in self.points.items()}

    @property
    def reference(self) -> Pair | None:
        """The point that all fronts dominate, from which the hypervolume is counted; None without a front."""
        values = np.concatenate([np.empty((0, 2)), *(front.values for front in self.fronts.values())])
        return reference_point(values) if len(values) else None

    @property
    def summaries(self) -> list[Summary]:
        """By method."""
        reference, fronts = self.reference, self.fronts
        return [
            Summary(
                method,
                len(points),
                len(fronts[method].points),
                0.0 if reference is None else hypervolume(fronts[method].values, reference),
                sum(point.evaluations for point in points),
                sum(point.seconds for point in points),
            )
            for method, points in self.points.items()
        ]

    @property
    def rows(self) -> list[list[object]]:
        """Of ``front.csv``: each method's points in the order in which they were made."""
        return [
            [
                point.number, *point.values, point.duration, "yes" if point.certified else "no",
                str(front.standings[point.number]), method, point.seed, point.evaluations, round(point.seconds, 3),
                point.folder,
            ]
            for method, front in self.fronts.items()
            for point in self.points[method]
        ]  # fmt: skip

    def write(self, folder: Path) -> None:
        """Write both tables.

        Raises:
            OutputError: they cannot be written.
        """
        first, second = self.headings
        header = ["point", first, second, "duration [s]", "certified", "standing", "method", "seed", "evaluations"]
        unit = f"hypervolume [{_unit(first)} {_unit(second)}]"
        with writing(folder):
            write_csv(folder / FRONT, [*header, "seconds", "folder"], self.rows)
            write_csv(
                folder / METHODS,
                ["method", "points", "on front", unit, "evaluations", "seconds"],
                [
                    [s.method, s.points, s.on_front, s.hypervolume, s.evaluations, round(s.seconds, 3)]
                    for s in self.summaries
                ],
            )


def _unit(heading: str) -> str:
    return heading[heading.index("[") + 1 : -1]

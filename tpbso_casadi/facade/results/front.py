"""The front of two objectives, as Python code meets it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.facade.results.data_frame import data_frame
from tpbso_casadi.facade.results.export import chosen
from tpbso_casadi.facade.results.html import heading, picture, table
from tpbso_casadi.facade.results.stored_plan import StoredPlan
from tpbso_casadi.figures.style.formats import DEFAULT, FORMATS
from tpbso_casadi.trade_off.point import Point
from tpbso_casadi.trade_off.table import TradeOff

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
    plans: tuple[StoredPlan, ...]

    @property
    def objectives(self) -> tuple[str, str]:
        """Both with their units."""
        return self.trade_off.headings

    @property
    def values(self) -> FloatArray:
        """Of both objectives in their units, (n, 2)."""
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
        from tpbso_casadi.facade.results.figures import shown  # noqa: PLC0415 (matplotlib is slow to load)
        from tpbso_casadi.trade_off.figures import front_figure  # noqa: PLC0415

        return shown(front_figure(self.trade_off))

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
        from tpbso_casadi.trade_off.figures import draw_front  # noqa: PLC0415 (matplotlib is slow to load)

        formats = chosen("figures", figures, FORMATS)
        self.trade_off.write(Path(folder))
        if formats:
            draw_front(Path(folder), self.trade_off, formats)
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
        from tpbso_casadi.facade.results.figures import png_of  # noqa: PLC0415 (matplotlib is slow to load)

        rows = [list(row.values()) for row in self.table]
        return heading(repr(self)[1:-1]) + picture(png_of(self.plot()), "the front") + table(list(self.table[0]), rows)

"""Programs for KUKA controllers: points for ``SPTP`` in KRL, and rows of axis angles for RSI.

[1] KUKA System Software, Operating and Programming Instructions for System Integrators: axes of a PTP motion start and
stop together, and the exact path is not predictable.
[2] KUKA.RobotSensorInterface: axis corrections every 4 ms (``IPO_FAST``) or 12 ms.
"""

from __future__ import annotations

from typing import ClassVar

from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import Signal
from tpbso_casadi.programs.streams import RowTable

AXES = ("A1", "A2", "A3", "A4", "A5", "A6", "E1", "E2", "E3", "E4", "E5", "E6")
HEAD = "&ACCESS RVP\n&REL 1\n"


class Krl(PointExporter):
    """KRL with an exact stop at each point: ``SPTP`` to an ``E6AXIS``; a ``.src`` and a ``.dat``."""

    title: ClassVar[str] = "KUKA KRL, SPTP"
    axes: ClassVar[int] = len(AXES)
    path: ClassVar[str] = "KUKA says that axes start and stop together, not how they go in between"
    corner: ClassVar[str] = "C_PTP begins at half of a move, $APO.CPTP=50; KUKA does not say along which path"

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        rows = map(route.coding.text, route.values)
        points = [", ".join(map(" ".join, zip(AXES, row, strict=False))) for row in rows]
        data = [f"DECL E6AXIS XP{number}={{{point}}}" for number, point in enumerate(points)]
        lines = [f";{note}" for note in notes]
        lines += [
            "INT I",
            "BAS(#INITMOV,0)",
            "FOR I=1 TO 6",
            f"   $VEL_AXIS[I]={self.speed:g}",
            "ENDFOR",
            "$APO.CPTP=50",
            "PTP XP0",
        ]
        for step in route.numbered:
            if isinstance(step, int):
                lines.append(f"PTP XP{step} C_PTP" if step in route.corners else f"SPTP XP{step}")
            elif isinstance(step, Signal):
                state = "TRUE" if step.on else "FALSE"
                lines.append(f";{step.said}" if step.output is None else f"$OUT[{step.output}]={state}")
            else:
                lines.append(f"WAIT SEC {step:.3f}")
        source = [f"DEF {self.name}()", *lines, "END", ""]
        return {
            f"{self.name}.src": HEAD + "\n".join(source),
            f"{self.name}.dat": HEAD + "\n".join([f"DEFDAT {self.name}", *data, "ENDDAT", ""]),
        }


class Rsi(RowTable):
    """Rows of axis angles every 4 ms, for a server of yours that sends them to RSI."""

    title: ClassVar[str] = "KUKA RSI, rows"
    axes: ClassVar[int] = len(AXES)
    columns: ClassVar[str] = "A{}"
    joined: ClassVar[str] = (
        "rows are axis angles in degrees, of which RSI takes the differences from the first as corrections; the drives "
        "filter what comes"
    )

"""Programs for ABB controllers: points for ``MoveAbsJ`` in RAPID, and rows of joint angles for EGM.

[1] ABB, Technical reference manual, RAPID Instructions: with ``MoveAbsJ`` all axes reach the destination at the same
time, along a path that is not linear.
[2] ABB, Application manual, Externally Guided Motion: positions of joints every 4 ms.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from problems.base import Checked
from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import Signal, identifier, is_identifier
from tpbso_casadi.programs.streams import RowTable

ROBOT_AXES, EXTERNAL_AXES, NONE = 6, 6, "9E9"


class Rapid(PointExporter):
    """RAPID with ``MoveAbsJ`` to a ``fine`` point each; axes beyond the sixth are external ones."""

    title: ClassVar[str] = "ABB RAPID, MoveAbsJ"
    axes: ClassVar[int] = ROBOT_AXES + EXTERNAL_AXES
    path: ClassVar[str] = "ABB says that all axes arrive together, not how they go in between"
    corner: ClassVar[str] = "a zone is at most half of a move, and its path a parabola, as ABB says of the tool"

    tool: Annotated[str, Checked(identifier)] = "tool0"
    zone: Annotated[str, Checked(identifier)] = "z10"

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        points = [self._target(row) for row in map(route.coding.text, route.values)]
        lines = [f"    VelSet {self.speed:g}, 5000;", f"    MoveAbsJ p0, v1000, fine, {self.tool};"]
        for step in route.numbered:
            if isinstance(step, int):
                zone = self.zone if step in route.corners else "fine"
                lines.append(f"    MoveAbsJ p{step}, v1000, {zone}, {self.tool};")
            elif isinstance(step, Signal):
                known = step.output is not None and is_identifier(step.name)
                lines.append(f"    SetDO {step.name}, {int(step.on)};" if known else f"    ! {step.said}")
            else:
                lines.append(f"    WaitTime {step:.3f};")
        module = [
            f"MODULE {self.name}",
            *(f"  ! {note}" for note in notes),
            *(f"  CONST jointtarget p{number} := {point};" for number, point in enumerate(points)),
            f"  PROC run_{self.name}()",
            *lines,
            "  ENDPROC",
            "ENDMODULE",
            "",
        ]
        return {f"{self.name}.mod": "\n".join(module)}

    def signal(self, name: str, value: bool | float | str) -> Signal:
        """Signals are told by their names, so that one that is true or false needs no number."""
        told = super().signal(name, value)
        return told._replace(output=0) if isinstance(value, bool) and is_identifier(name) else told

    def _target(self, row: list[str]) -> str:
        own, external = row[:ROBOT_AXES], row[ROBOT_AXES:]
        own += ["0"] * (ROBOT_AXES - len(own))
        external += [NONE] * (EXTERNAL_AXES - len(external))
        return f"[[{', '.join(own)}], [{', '.join(external)}]]"


class Egm(RowTable):
    """Rows of joint angles every 4 ms, for a program of yours that sends them by EGM."""

    title: ClassVar[str] = "ABB EGM, rows"
    axes: ClassVar[int] = ROBOT_AXES + EXTERNAL_AXES
    columns: ClassVar[str] = "j{}"
    joined: ClassVar[str] = "rows are joint angles in degrees; EGM filters what comes, and ABB does not say how"

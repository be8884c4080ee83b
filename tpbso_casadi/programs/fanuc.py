"""Programs for FANUC controllers: points for joint moves in an LS file, which the controller or WinTPE makes a TP of.

[1] FANUC, Operator's Manual: the axes of a joint motion start and stop together; its path is neither a line nor an arc.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from problems import Robot
from problems.base import FloatArray, Range
from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import Coding, Signal

ATTRIBUTES = """\
/ATTR
OWNER\t\t= MNEDITOR;
COMMENT\t\t= "";
PROG_SIZE\t= 0;
FILE_NAME\t= ;
VERSION\t\t= 0;
LINE_COUNT\t= {};
MEMORY_SIZE\t= 0;
PROTECT\t\t= READ_WRITE;
TCD:  STACK_SIZE\t= 0,
      TASK_PRIORITY\t= 50,
      TIME_SLICE\t= 0,
      BUSY_LAMP_OFF\t= 0,
      ABORT_REQUEST\t= 0,
      PAUSE_REQUEST\t= 0;
DEFAULT_GROUP\t= 1,*,*,*,*;
CONTROL_CODE\t= 00000000 00000000;"""


class Fanuc(PointExporter):
    """An LS file with a joint move to each point, ``FINE``.

    Attributes:
        j23: what the controller's J3 has of the second joint: J3 = joint 3 + j23 times joint 2. FANUC counts J3 from
            the horizontal, most URDFs from the upper arm.
        cnt: of corners, the larger the rounder.
        tool, frame: numbers of the user tool and frame of the points.
    """

    title: ClassVar[str] = "FANUC LS, J moves"
    axes: ClassVar[int] = 9
    path: ClassVar[str] = "FANUC says that axes start and stop together, not how they go in between"
    corner: ClassVar[str] = "FANUC does not say how far from a point CNT begins"

    cnt: Annotated[int, Range(least=0, most=100)] = 100
    j23: Annotated[int, Range(least=-1, most=1)] = 0
    tool: Annotated[int, Range(least=1, most=29)] = 1
    frame: Annotated[int, Range(least=0, most=61)] = 0

    def coding(self, robot: Robot) -> Coding:
        plain = super().coding(robot)
        matrix = plain.matrix.copy()
        matrix[2, 1] = self.j23 * matrix[1, 1]
        return Coding(matrix, plain.digits)

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        name, percent = self.name.upper(), max(1, round(self.speed))
        lines = [f"! {name}.TXT", f"J P[1] {percent}% FINE"]
        for step in route.numbered:
            if isinstance(step, int):
                end = f"CNT{self.cnt}" if step in route.corners else "FINE"
                lines.append(f"J P[{step + 1}] {percent}% {end}")
            elif isinstance(step, Signal):
                state = "ON" if step.on else "OFF"
                lines.append(f"! {step.said}" if step.output is None else f"DO[{step.output}]={state}")
            else:
                lines.append(f"WAIT {step:.2f}(sec)")
        positions = [self._position(number, route, values) for number, values in enumerate(route.values, start=1)]
        program = [
            f"/PROG  {name}",
            ATTRIBUTES.format(len(lines)),
            "/MN",
            *(f"{number:4}:{line} ;" for number, line in enumerate(lines, start=1)),
            "/POS",
            *positions,
            "/END",
            "",
        ]
        return {f"{name}.LS": "\n".join(program), f"{name}.TXT": "\n".join([*notes, ""])}

    def _position(self, number: int, route: Route, values: FloatArray) -> str:
        units = ["deg" if unit == "rad" else "mm" for unit in route.robot.joints.units]
        axes = [
            f"\tJ{axis}= {value} {unit}"
            for axis, (value, unit) in enumerate(zip(route.coding.text(values), units, strict=True), start=1)
        ]
        return f"P[{number}]{{\n   GP1:\n\tUF : {self.frame}, UT : {self.tool},\n" + ",\n".join(axes) + "\n};"

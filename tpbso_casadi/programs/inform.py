"""Programs for Yaskawa controllers: jobs in INFORM with points in pulses of the encoders.

[1] Yaskawa, INFORM Manual: ``MOVJ`` moves by joint interpolation; ``PL=0`` stops exactly at a point.
"""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, ClassVar

import numpy as np

from problems import Robot
from problems.base import Range
from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import Coding, Signal
from tpbso_casadi.storage import OutputError


class Inform(PointExporter):
    """A job with ``MOVJ`` to each point, in pulses.

    Attributes:
        pulses_per_degree: of each axis, per mm of one that slides, with a sign where the axis turns the other way; the
            controller's parameter file ``ALL.PRM`` has them.
        position_level: of corners, the larger the rounder.
    """

    title: ClassVar[str] = "Yaskawa INFORM, MOVJ"
    axes: ClassVar[int] = 8
    digits: ClassVar[int] = 0
    corner: ClassVar[str] = "Yaskawa states radii for position levels, not along which path they are rounded"
    path: ClassVar[str] = "Yaskawa speaks of joint interpolation, and does not say how axes go in between"

    position_level: Annotated[int, Range(least=1, most=8)] = 1
    pulses_per_degree: list[float] = field(default_factory=list)

    def coding(self, robot: Robot) -> Coding:
        plain, pulses = super().coding(robot), np.array(self.pulses_per_degree)
        if len(pulses) != robot.dof or not pulses.all():
            raise OutputError(
                f"pulses_per_degree: {robot.dof} numbers other than zero are needed, of each axis, from the "
                f"controller's ALL.PRM; not {len(pulses)}"
            )
        return Coding(plain.matrix * pulses[:, None], plain.digits)

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        name = self.name.upper()
        points = [f"C{number:05}={','.join(route.coding.text(values))}" for number, values in enumerate(route.values)]
        lines = ["'SEE THE TXT FILE", f"MOVJ C00000 VJ={self.speed:.2f} PL=0"]
        for step in route.numbered:
            if isinstance(step, int):
                level = self.position_level if step in route.corners else 0
                lines.append(f"MOVJ C{step:05} VJ={self.speed:.2f} PL={level}")
            elif isinstance(step, Signal):
                state = "ON" if step.on else "OFF"
                lines.append(f"'{step.said}" if step.output is None else f"DOUT OT#({step.output}) {state}")
            else:
                lines.append(f"TIMER T={step:.2f}")
        job = [
            "/JOB", f"//NAME {name}", "//POS", f"///NPOS {len(points)},0,0,0,0,0", "///TOOL 0", "///POSTYPE PULSE",
            "///PULSE", *points, "//INST", "///DATE 2000/01/01 00:00", "///ATTR SC,RW", "///GROUP1 RB1",
            "NOP", *lines, "END", "",
        ]  # fmt: skip
        return {f"{name}.JBI": "\n".join(job), f"{name}-JBI.TXT": "\n".join([*notes, ""])}

"""Programs for Universal Robots in URScript: rows for ``servoj``, and points for ``movej``.

[1] Universal Robots, The URScript Programming Language: ``movej`` moves linearly in joint space, ``a`` and ``v`` are
those of the leading axis; ``servoj`` is for online control, and how it joins two calls is not said.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import casadi as ca
import numpy as np

from problems.base import Range, as_array
from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import IN_RADIANS, Signal
from tpbso_casadi.programs.streams import Stream, StreamExporter

BLENDED = 0.9  # share of the way of the tool to the middle of a line that a blend takes at most
AT_START = 0.01  # rad: an arm that is farther from the first row does not begin


def script(name: str, notes: list[str], start: list[str], lines: list[str]) -> str:
    """A program that stops at once where the arm does not stand at its first row."""
    guard = f"""\
  start = [{", ".join(start)}]
  now = get_actual_joint_positions()
  axis = 0
  while axis < {len(start)}:
    if norm(now[axis] - start[axis]) > {AT_START}:
      popup("move the arm to the start of {name} first", "{name}", error=True, blocking=True)
      halt
    end
    axis = axis + 1
  end"""
    return "\n".join([f"def {name}():", *(f"  # {note}" for note in notes), guard, *lines, "end", ""])


def set_output(signal: Signal) -> str:
    """The line that tells a signal."""
    if signal.output is None:
        return f"  # {signal.said}"
    return f"  set_digital_out({signal.output}, {signal.on})"


class ServoJ(StreamExporter):
    """URScript for e-Series: a row for ``servoj`` every 2 ms; ``period = 0.008`` of CB3."""

    title: ClassVar[str] = "URScript, servoj"
    axes: ClassVar[int] = 6
    per_unit: ClassVar[tuple[float, float]] = IN_RADIANS
    digits: ClassVar[int] = 9
    joined: ClassVar[str] = (
        "the manual does not say how servoj joins rows; lookahead_time and gain make the arm lag behind: "
        "state a tracking_error and plan with it"
    )

    period: Annotated[float, Range(least=0.002, most=0.1)] = 0.002
    lookahead_time: Annotated[float, Range(least=0.03, most=0.2)] = 0.03
    gain: Annotated[int, Range(least=100, most=2000)] = 300

    def text(self, stream: Stream, notes: list[str]) -> dict[str, str]:
        told: dict[int, list[str]] = {}
        for row, signal in stream.signals:
            told.setdefault(row, []).append(set_output(signal))
        form = f"  servoj([{{}}], t={self.period:g}, lookahead_time={self.lookahead_time:g}, gain={self.gain})"
        rows = [stream.coding.text(values) for values in stream.values]
        lines = [
            line for row, values in enumerate(rows) for line in (*told.get(row, ()), form.format(", ".join(values)))
        ]
        return {f"{self.name}.script": script(self.name, notes, rows[0], [*lines, "  stopj(2.0)"])}


def blend_radii(route: Route) -> dict[int, float]:
    """The radii of corners in m, rounded down to mm: no farther than to the middles of both lines."""
    points = route.coding.decoded(route.values)
    middles = (points[:-1] + points[1:]) / 2.0
    tool, half = (as_array(route.robot.tool.position(ca.DM(rows))) for rows in (points, middles))
    reach = np.linalg.norm(np.stack([half[:-1], half[1:]]) - tool[1:-1], axis=2).min(axis=0)
    radii = np.floor(1000.0 * BLENDED * reach) / 1000.0
    return {number: float(radii[number - 1]) for number in sorted(route.corners)}


class MoveJ(PointExporter):
    """URScript with ``movej`` from point to point."""

    title: ClassVar[str] = "URScript, movej"
    axes: ClassVar[int] = 6
    per_unit: ClassVar[tuple[float, float]] = IN_RADIANS
    digits: ClassVar[int] = 9
    documented: ClassVar[bool] = True
    path: ClassVar[str] = "movej moves linearly in joint space, as its manual says"
    corner: ClassVar[str] = "blends begin within the radii r, which end before the middles of lines"

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        lines, limits, radii = [], route.robot.limits, blend_radii(route)
        v, a = (self.speed / 100.0 * min(limit) for limit in (limits.speed, limits.acceleration))
        for step in route.numbered:
            if isinstance(step, int):
                blend = f", r={radius:.3f}" if (radius := radii.get(step, 0.0)) else ""
                row = ", ".join(route.coding.text(route.values[step]))
                lines.append(f"  movej([{row}], a={a:.6f}, v={v:.6f}{blend})")
            else:
                lines.append(set_output(step) if isinstance(step, Signal) else f"  sleep({step:.3f})")
        start = route.coding.text(route.values[0])
        return {f"{self.name}-movej.script": script(self.name, notes, start, lines)}

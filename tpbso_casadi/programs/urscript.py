"""Programs for Universal Robots in URScript: rows for ``servoj``, and points for ``movej``.

[1] Universal Robots, The URScript Programming Language: ``movej`` moves linearly in joint space, ``a`` and ``v`` are
those of the leading axis; ``servoj`` is for online control, and how it joins two calls is not said.
"""

from __future__ import annotations

from typing import Annotated, ClassVar

from problems.base import Range
from tpbso_casadi.programs.points import PointExporter, Route
from tpbso_casadi.programs.program import IN_RADIANS, Signal
from tpbso_casadi.programs.streams import Stream, StreamExporter

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


class MoveJ(PointExporter):
    """URScript with ``movej`` from point to point."""

    title: ClassVar[str] = "URScript, movej"
    axes: ClassVar[int] = 6
    per_unit: ClassVar[tuple[float, float]] = IN_RADIANS
    digits: ClassVar[int] = 9
    documented: ClassVar[bool] = True
    path: ClassVar[str] = "movej moves linearly in joint space, as its manual says"

    def text(self, route: Route, notes: list[str]) -> dict[str, str]:
        lines, limits = [], route.robot.limits
        v, a = (self.speed / 100.0 * min(limit) for limit in (limits.speed, limits.acceleration))
        for step in route.numbered:
            if isinstance(step, int):
                lines.append(f"  movej([{', '.join(route.coding.text(route.values[step]))}], a={a:.6f}, v={v:.6f})")
            else:
                lines.append(set_output(step) if isinstance(step, Signal) else f"  sleep({step:.3f})")
        start = route.coding.text(route.values[0])
        return {f"{self.name}.script": script(self.name, notes, start, lines)}

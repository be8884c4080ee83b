"""Limits that are expressions of the user's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.base import STEP, FloatArray, InvalidProblem, Matrix, Parametric, Relaxation, entry_changed, largest
from problems.core import CoreExpression
from problems.limits.limit import Constraint, Limit
from problems.motions import SampleFunction, Samples, random_states
from problems.robots import Robot
from problems.scene import Obstacle

PROBES = 8  # random states at which it is seen how an expression depends on how fast a motion is run
PROBE_FACTOR = 1.7  # the factor there
DEGREES = (1.0, 2.0, 3.0, 4.0, 6.0)  # with which an expression may fall as a motion is run more slowly
PROBE_TOLERANCE = 1e-9  # relative
MOVING = ("speed", "acceleration", "jerk", "torque", "tool_velocity")  # what may fall
FAR = 100.0  # times the nearer bound

Bound = tuple[float, ...] | None


@dataclass(frozen=True)
class ExpressionLimit(Limit):
    """The limit ``lower <= f(one instant) <= upper`` at every time.

    Args:
        name: of its constraint.
        robot: that moves.
        function: f, m values.
        unit: of its values.
        lower: of each value, m numbers; None where there is none.
        upper: likewise.
        scale: the usual size of each value, m positive numbers: what an excess and margins are relative to.
        degree: with which power of the factor the values fall where a motion is run more slowly, if 0 keeps the
            bounds: every shape keeps them then if it is run slowly enough; None where that is not so.
    """

    numbers: ClassVar[tuple[str, ...]] = ("lower", "upper", "scale")
    bends: ClassVar[bool] = True

    name: str  # type: ignore[misc]  # a class attribute of other limits
    robot: Robot
    function: SampleFunction
    unit: str
    lower: Bound
    upper: Bound
    scale: tuple[float, ...]
    degree: float | None = None

    @cached_property
    def in_core(self) -> CoreExpression | None:
        """The expression in the compiled core, where that knows it and the robot."""
        return CoreExpression.of(self.robot, self.function)

    def constraints_at(self, samples: Samples, margin: float = 0.0) -> list[Constraint]:
        searched = any(isinstance(part, ca.SX) for part in (*samples.derivatives, samples.times))
        return self._bounding(self._values(samples, searched), margin)

    def _values(self, samples: Samples, smooth: bool) -> Matrix:
        """The values at n samples, (n, m); by the core of a finished motion, where that knows them."""
        if samples.is_finished and self.in_core is not None:
            return ca.DM(self.in_core.values(samples.states, float(samples.duration)))
        return self.function.at(samples, smooth)

    def exact_constraints_at(self, samples: Samples) -> list[Constraint]:
        return self._bounding(self.function.at(samples), 0.0)

    def _bounding(self, values: Matrix, margin: float) -> list[Constraint]:
        """The bounds of values (n, m)."""
        scale = ca.horzcat(*self.scale)
        spare = margin * scale if margin else ca.DM.zeros(1, len(self.scale))
        is_length = self.function.is_root and self.lower is None
        return [
            Constraint(
                name=self.name,
                unit=self.unit,
                expression=values,
                lower=None if self.lower is None else ca.horzcat(*self.lower) + spare,
                upper=None if self.upper is None else ca.horzcat(*self.upper) - spare,
                columns=self.columns,
                scale=scale,
                transform=_squared if is_length and self.degree is not None else None,
                formula=self.formula,
            )
        ]

    @property
    def numbers_of_bounds(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Lower and upper bounds, infinite where there is none, and the usual sizes, (m,) each."""
        none = np.full(len(self.scale), np.inf)
        lower, upper = (none if side is None else np.array(side, dtype=np.float64) for side in (self.lower, self.upper))
        return (-none if self.lower is None else lower), upper, np.array(self.scale, dtype=np.float64)

    @property
    def relaxations(self) -> tuple[Relaxation, ...]:

        def farther(place: int, by: float) -> dict[str, object]:
            sides = {"lower": (self.lower, -by), "upper": (self.upper, by)}
            return {
                side: entry_changed(bound, place, bound[place] + out)
                for side, (bound, out) in sides.items()
                if bound is not None
            }

        return tuple(
            Relaxation(
                limit=self.name, of=column, statement=self, values=partial(farther, place), size=self._size(place),
                unit=self.unit,
                least_step=STEP * self.scale[place],
            )
            for place, column in enumerate(self.columns)
        )  # fmt: skip

    def _size(self, place: int) -> float:
        """The size of the bound of a value, of one that is the same on both sides too; else the width between them."""
        low, high = (None if bound is None else bound[place] for bound in (self.lower, self.upper))
        if low is None or high is None or low == -high:
            return abs(high if high is not None else low or 0.0)
        return high - low

    @property
    def columns(self) -> tuple[str, ...]:
        """The names of the values of the expression, for tables."""
        width = self.function.width
        return ("value",) if width == 1 else tuple(f"value {number}" for number in range(1, width + 1))

    @property
    def formula(self) -> str:
        """The formula, for a reader."""
        parts = (_written(self.lower), self.function.formula, _written(self.upper))
        return f"{' <= '.join(part for part in parts if part)}, at every sample t_j"

    def near(self, samples: Samples) -> ExpressionLimit:
        """The whole limit, as it is not known how far from its bounds it could get."""
        return self

    @property
    def scales_with_time(self) -> bool:
        return self.degree is not None

    def magnitudes(self, samples: Samples) -> Matrix:
        """Shares of the bounds, (n, m)."""
        values, shares = self._values(samples, isinstance(samples.duration, ca.SX)), []
        for bound in (self.lower, self.upper):
            if bound is not None:
                shares.append(values / ca.repmat(ca.horzcat(*bound), samples.count, 1))
        return shares[0] if len(shares) == 1 else ca.fmax(*shares)

    def time_scale(self, peaks: Matrix) -> Matrix:
        assert self.degree is not None
        share = ca.fmax(0.0, largest(peaks))
        return share if self.degree == 1.0 else share ** (1.0 / self.degree)


def _squared(values: Matrix) -> Matrix:
    """Squares of values that are roots, which are smooth where those are zero, for nonlinear programs."""
    return values * values


def _written(bound: Bound) -> str:
    if bound is None:
        return ""
    return ", ".join(str(value) for value in bound) if len(set(map(str, bound))) > 1 else str(bound[0])


@dataclass(frozen=True)
class StatedExpression(Parametric):
    """A kind of limit for any robot that has what the expression depends on.

    Args:
        name: of the limit.
        unit: of its values.
        function: m values.
        lower: m numbers or one for all of them; None where there is none.
        upper: likewise.

    Raises:
        InvalidProblem: no bounds, not as many as there are values, or none between which a value can be.
    """

    name: str
    unit: str
    function: SampleFunction
    lower: Bound = None
    upper: Bound = None

    def __post_init__(self) -> None:
        if self.lower is None and self.upper is None:
            raise InvalidProblem("constraints", f"{self.name!r} has no bounds: say lower, upper, or both")
        width = self.function.width
        for key in ("lower", "upper"):
            bound: Bound = getattr(self, key)
            if bound is not None and len(bound) not in (1, width):
                raise InvalidProblem(
                    "constraints", f"{self.name!r}: {key} has {len(bound)} numbers, the expression {width}"
                )
        for low, high in self._pairs:
            if not low < high:
                raise InvalidProblem("constraints", f"{self.name!r}: lower {low:g} is not below upper {high:g}")

    def for_robot(self, robot: Robot, obstacles: Sequence[Obstacle]) -> ExpressionLimit:
        """The limit of a robot.

        Raises:
            InvalidProblem: the robot has not what the expression depends on.
        """
        self.function.check(robot, "constraints", self.name)
        low, high = zip(*self._pairs, strict=True)
        return ExpressionLimit(
            name=self.name,
            robot=robot,
            function=self.function,
            unit=self.unit,
            lower=None if self.lower is None else low,
            upper=None if self.upper is None else high,
            scale=tuple(_scale(*pair) for pair in self._pairs),
            degree=degree_of(self.function, robot) if max(low) < 0.0 < min(high) else None,
        )

    @property
    def _pairs(self) -> list[tuple[float, float]]:
        """Lower and upper bound of each value; infinite where there is none."""
        width = self.function.width
        sides = (
            (missing,) * width if bound is None else bound if len(bound) == width else bound * width
            for bound, missing in ((self.lower, -np.inf), (self.upper, np.inf))
        )
        return list(zip(*sides, strict=True))


def _scale(low: float, high: float) -> float:
    """The usual size of values between bounds; of the nearer one, where the other is far off."""
    near = min(abs(bound) or 1.0 for bound in (low, high) if np.isfinite(bound))
    return min(high - low, FAR * near) if np.isfinite(high - low) else near


def degree_of(function: SampleFunction, robot: Robot) -> float | None:
    """The power of the factor with which all values fall if a motion is run more slowly; None if no one power.

    Seen at random states, where every derivative falls with its order.
    """
    if function.uses("time", "duration") or not function.uses(*MOVING):
        return None
    states, powers = random_states(robot, PROBES), np.repeat(np.arange(4), robot.dof)
    slower, in_core = states / PROBE_FACTOR ** np.append(powers, 0), CoreExpression.of(robot, function)
    probed = partial(function.probed, robot) if in_core is None else in_core.values
    before, after = (probed(each, duration=1.0) for each in (states, slower))
    return next((degree for degree in DEGREES if _falls(before, after, degree)), None)


def _falls(before: FloatArray, after: FloatArray, degree: float) -> bool:
    size = float(np.max(np.abs(before)))
    return size > 0.0 and bool(
        np.allclose(after * PROBE_FACTOR**degree, before, rtol=PROBE_TOLERANCE, atol=PROBE_TOLERANCE * size)
    )

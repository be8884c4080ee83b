"""Expressions in the core, bounded to the last digits: against numbers of 64 binary digits, where there are such."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.space import LENGTHS, TOOL, small_arm

from problems import Trajectory
from problems.certify.time_cells import PieceTimes
from problems.core import CoreExpression
from problems.motions import traced

ARM = small_arm(4)
LONG = np.longdouble
FINE = LONG(2.0) ** -58  # more than these numbers lose, and less than a double's last digit
UNARY: dict[str, Callable[[Any], Any]] = {
    "neg": np.negative, "sq": np.square, "twice": lambda x: x + x, "inv": np.reciprocal, "sqrt": np.sqrt,
    "fabs": np.abs, "sin": np.sin, "cos": np.cos, "asin": np.arcsin, "acos": np.arccos, "atan": np.arctan,
    "exp": np.exp, "log": np.log,
}  # fmt: skip
BINARY: dict[str, Callable[[Any, Any], Any]] = {
    "add": np.add, "sub": np.subtract, "mul": np.multiply, "div": np.divide, "fmin": np.minimum, "fmax": np.maximum,
    "atan2": np.arctan2,
}  # fmt: skip


class Finely:
    """An interpreter in such numbers."""

    def constant(self, value: float) -> Any:
        return LONG(value)

    def unary(self, name: str, a: Any) -> Any:
        return UNARY[name](a)

    def binary(self, name: str, a: Any, b: Any) -> Any:
        return BINARY[name](a, b)


def tool(q: Any) -> list[Any]:
    """The coordinates of the tool in postures, from the last joint back."""
    x, y, z = LONG(0.0), LONG(0.0), LONG(TOOL)
    for joint in range(3, -1, -1):
        c, s = np.cos(q[joint]), np.sin(q[joint])
        x, y, z = (c * x + s * z, y, c * z - s * x) if joint % 2 else (c * x - s * y, s * x + c * y, z)
        z = z + LONG(LENGTHS[joint])
    return [x, y, z]


FORMULAS: dict[str, Any] = {
    "place": lambda m: m.tool[0] + m.tool[1],
    "length": lambda m: ca.norm_2(m.tool),
    "angle": lambda m: ca.atan2(m.tool[1], m.tool[0] + 2.0),
    "sums and products": lambda m: (m.q[0] - m.q[1]) * (m.q[2] + 0.1) - m.q[3] ** 2 / (2.0 + m.q[0]),
    "waves": lambda m: ca.sin(3.0 * m.q[0]) * ca.cos(m.q[1]),
    "roots": lambda m: ca.sqrt(2.0 + m.q[1]) + 1.0 / (3.0 + m.q[2]),
    "kinks": lambda m: ca.fmax(m.q[0], m.q[1]) + ca.fabs(m.q[2]) - ca.fmin(m.q[3], 0.1),
    "arcs": lambda m: ca.asin(m.q[0] / 2.0) + ca.acos(m.q[1] / 2.0) - ca.atan(m.q[2]),
    "growth": lambda m: ca.exp(m.q[0]) + ca.log(2.0 + m.q[1]),
}


@pytest.mark.skipif(np.finfo(LONG).nmant < 63, reason="no finer numbers here")
@pytest.mark.parametrize("stated", FORMULAS.values(), ids=FORMULAS)
def test_no_bound_below_the_exact_value_is_proven_however_little(stated: Any) -> None:
    function = traced(stated, ARM, "c")
    core, names, rng = CoreExpression.of(ARM, function), ("q", "tool"), np.random.default_rng(3)
    assert core is not None
    for number in range(30):
        coefficients = rng.normal(size=(1 + number % 6, 1, 4)) * 0.3
        motion, times = Trajectory(np.array([0.0, 0.5]), coefficients), np.linspace(0.0, 0.5, 101).astype(LONG)
        q = [np.polyval(coefficients[:, 0, joint].astype(LONG), times) for joint in range(4)]
        known = dict(zip(names, (q, tool(q)), strict=True))
        values = function.interpreted([known[name][index] for name, index in function.entries], Finely())[0]
        highest = np.max(values)
        below = np.nextafter(float(highest - FINE * (1.0 + abs(highest))), -np.inf)
        moments = PieceTimes.at(motion, np.zeros(0)).numbers
        for bound, kept in ((below, False), (float(highest) + 1e-4, True)):
            bounds = np.array([-np.inf]), np.array([bound]), np.ones(1)
            assert (core.settle(moments, bounds, 0.0, (16, 4_000), 0.01).kept is True) is kept


@pytest.mark.parametrize(
    "stated",
    [*FORMULAS.values(), lambda m: ca.dot(m.tool_velocity, m.rotation[:3]) + m.acceleration[1] / m.speed[0]],
    ids=[*FORMULAS, "rates"],
)
def test_slopes_are_those_that_casadi_derives(stated: Any) -> None:
    function, rng = traced(stated, ARM, "c"), np.random.default_rng(5)
    core, states = CoreExpression.of(ARM, function), rng.uniform(0.1, 0.9, (11, 4 * ARM.dof + 1))
    state = ca.SX.sym("state", states.shape[1])
    derived = ca.Function("slopes", [state], [ca.jacobian(function.of_state(ARM)(state, 1.0), state)])
    assert core is not None
    for row, slopes in zip(states, core.slopes(states, 1.0), strict=True):
        np.testing.assert_allclose(slopes.ravel(), derived(row).full().ravel()[: 3 * ARM.dof], rtol=1e-9, atol=1e-11)

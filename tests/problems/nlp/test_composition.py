"""The Hessian in two steps is the one that CasADi derives in one."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from helpers.cases import moving

from problems import Ellipse, PlanarArm
from problems.nlp import composed_hessian

ARM = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, ((-3.0, 3.0), (-2.9, 2.9), (-2.9, 2.9)))
OBSTACLES = (Ellipse((0.8, 0.8), (0.15, 0.25), 0.3),)


@pytest.mark.parametrize("objective", ["time", "rotation", "length"])
def test_hessian_of_a_program(objective: str) -> None:
    program = moving(ARM, (1.0, 0.0), (0.5, 1.5), objective, "up", samples=8, obstacles=OBSTACLES).nlp()
    rng = np.random.default_rng(0)
    forces, x = rng.normal(size=program.g.shape[0]), next(program.starts(rng))
    lagrangian = 1.3 * program.f + ca.dot(ca.DM(forces), program.g)
    expected = ca.Function("h", [program.x], [ca.triu(ca.hessian(lagrangian, program.x)[0])])(x)
    assert program.hessian is not None
    composed = program.hessian(x, [], 1.3, forces)
    assert np.asarray(composed.full()) == pytest.approx(np.asarray(expected.full()), rel=1e-9, abs=1e-8)


def test_by_hand() -> None:
    """f = y^2 with y = x^3: (x^6)'' = 30 x^4; g = x^2 + y: 2 + 6 x."""
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    composed = composed_hessian(x, y, x**3, y**2, x**2 + y)(2.0, [], 1.0, 10.0)
    assert float(composed) == pytest.approx(30.0 * 16.0 + 10.0 * (2.0 + 12.0))


def test_a_term_of_both_is_refused() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    with pytest.raises(ValueError, match="mixes"):
        composed_hessian(x, y, x**3, x * y, y)

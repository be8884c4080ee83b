"""Second derivatives of a program in two steps: from the variables to a motion's samples, from there to the rows.

Every row with an obstacle depends on one or two samples, that is on few angles; each of these depends on few
variables. Written out over the variables, the Hessian of the Lagrangian repeats the way from the variables to the
angles in every row. With y = y(x), L = L(x, y) and no term that mixes both,

    H = L_xx + J' L_yy J + sum_i (L_y)_i (y_i)_xx,   J = dy/dx,

which around an obstacle takes less than half of the operations.
"""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix
from problems.motions.samples import Samples


def composed_hessian(x: Matrix, y: Matrix, inner: Matrix, f: Matrix, g: Matrix) -> ca.Function:
    """The Hessian of lam_f f + lam_g' g with respect to x, as CasADi's ``nlpsol`` takes it.

    Args:
        x: symbols of the variables, (n, 1).
        y: symbols that stand for ``inner``, (m, 1).
        inner: y(x), (m, 1).
        f: the objective, of x and y.
        g: the rows, of x and y, (r, 1).

    Returns:
        Of x, p (empty), lam_f and lam_g: the upper triangle, (n, n).

    Raises:
        ValueError: a term mixes x and y.
    """
    used = np.flatnonzero(ca.which_depends(ca.vertcat(f, g), y, 1, False)).tolist()
    y, inner = y[used], inner[used]
    of_f, of_g, of_y = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", g.shape[0]), ca.SX.sym("lam_y", y.shape[0])
    lagrangian = of_f * f + ca.dot(of_g, g)
    own, slope = ca.gradient(lagrangian, x), ca.gradient(lagrangian, y)
    if ca.jacobian(own, y).nnz():
        raise ValueError("a row mixes the variables with what depends on them")
    outer = ca.Function(
        "outer", [x, y, of_f, of_g], [ca.jacobian(own, x), ca.jacobian(slope, y, {"symmetric": True}), slope]
    )
    bend = ca.Function("bend", [x, of_y], [ca.hessian(ca.dot(of_y, inner), x)[0]])
    first = ca.Function("inner", [x], [inner, ca.jacobian(inner, x)])
    point, nothing = ca.MX.sym("x", x.shape[0]), ca.MX.sym("p", 0, 0)
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.shape[0])
    value, jacobian = first(point)
    of_x, of_values, forces = outer(point, value, lam_f, lam_g)
    hessian = of_x + ca.mtimes([jacobian.T, of_values, jacobian]) + bend(point, forces)
    names = ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
    return ca.Function("nlp_hess_l", [point, nothing, lam_f, lam_g], [ca.triu(hessian)], *names)


def stand_in(samples: Samples) -> tuple[ca.SX, Matrix, Samples]:
    """Symbols in the place of a motion's samples, all of whose parts are known, and of those for integrals.

    Returns:
        The symbols (m, 1), what they stand for (m, 1), and the samples made of them.
    """
    given = (*samples.derivatives, samples.duration, samples.times, samples.weights)
    parts = [part for part in given if part is not None]  # all of them are
    symbols = [ca.SX.sym("y", *part.shape) for part in parts]
    *derivatives, duration, times, weights = symbols
    of_symbols = replace(samples, derivatives=tuple(derivatives), duration=duration, times=times, weights=weights)
    y, inner = ca.veccat(*symbols), ca.densify(ca.veccat(*parts))
    if samples.quadrature is None:
        return y, inner, of_symbols
    further, further_inner, points = stand_in(samples.quadrature)
    return ca.vertcat(y, further), ca.vertcat(inner, further_inner), replace(of_symbols, quadrature=points)

"""Redundancy angles normalised to [0, 1]: (7), generalised to every extra link of any arm.

The links 1..j-1 below link j reach an annulus around the base. Link j may stand at any angle phi_j that leaves
the end of link j - 1 inside it: with rho and alpha the polar coordinates of what link j has to reach, the law of
cosines turns the outer radius R and the inner radius r into

    beta_in <= |phi_j - alpha| <= beta_out,
    cos(beta_out) = (rho^2 + l_j^2 - R^2) / (2 rho l_j),   cos(beta_in) = (rho^2 + l_j^2 - r^2) / (2 rho l_j),

one interval when beta_in = 0 and two otherwise. Choosing from link k down to link 3 never meets an empty range.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from problems.base.matrix import Matrix, Operand, largest

SCALE_FLOOR = 1e-300  # least divisor: at a target on the base every angle will do, and none may become NaN


def annulus(lengths: Sequence[Operand]) -> tuple[Matrix, Operand]:
    """Inner and outer radius in m of what the end of a chain of links can reach."""
    outer = sum(lengths)
    return ca.fmax(0.0, 2.0 * largest(ca.vertcat(*lengths)) - outer), outer


def angular_range(lengths: Sequence[Operand], link: int, target: Matrix) -> tuple[Matrix, Matrix, Matrix]:
    """The angles at which ``link`` (3..k) can stand when its end is at ``target``.

    Args:
        lengths: of all links, m.
        link: the link's number j, counted from 1.
        target: where the end of link j is, (2, 1), m, within reach of links 1..j.

    Returns:
        alpha, beta_in, beta_out in rad: the allowed angles are alpha ± [beta_in, beta_out].
    """
    length = lengths[link - 1]
    inner, outer = annulus(lengths[: link - 1])
    square = ca.sumsqr(target) + length**2
    scale = ca.fmax(2.0 * length * ca.sqrt(ca.sumsqr(target)), SCALE_FLOOR)
    beta_in, beta_out = (_arccos((square - radius**2) / scale) for radius in (inner, outer))
    return ca.atan2(target[1], target[0]), beta_in, beta_out


def restore(lengths: Sequence[Operand], target: Matrix, normalised: Matrix) -> Matrix:
    """Redundancy angles of normalised values, (7) for each of the links k..3.

    Args:
        lengths: of all k links, m.
        target: the tip position, (2, 1), m, within reach.
        normalised: values in [0, 1] for the links 3..k, (k - 2, 1).

    Returns:
        phi of links 3..k, (k - 2, 1), rad. Every one can be reached; where the inner radius splits the range,
        [0, 1/2) runs through the interval on one side and [1/2, 1] through the other.
    """
    phi: list[Matrix] = []
    for link in range(len(lengths), 2, -1):
        alpha, beta_in, beta_out = angular_range(lengths, link, target)
        share = 2.0 * normalised[link - 3] - 1.0
        side = ca.if_else(share < 0.0, -1.0, 1.0)
        phi.insert(0, alpha + side * beta_in + share * (beta_out - beta_in))
        target = target - lengths[link - 1] * ca.vertcat(ca.cos(phi[0]), ca.sin(phi[0]))
    return ca.vertcat(*phi) if phi else ca.DM(0, 1)


def _arccos(cosine: Matrix) -> Matrix:
    return ca.acos(ca.fmin(1.0, ca.fmax(-1.0, cosine)))

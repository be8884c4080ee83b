"""Conditions on single points of a motion: its ends, and whether inverse kinematics reaches them."""

from __future__ import annotations

import casadi as ca

from problems.base.matrix import Matrix
from problems.limits.constraint import Constraint

POINT_TOLERANCE = 1e-9  # of the reach; allows for rounding only


def reach_limit(cosines: Matrix) -> Constraint:
    """(13), with absolute values: cos(theta_2) at both ends, (1, 2)."""
    one = ca.DM.ones(1, 2)
    return Constraint(
        name="reach",
        equation="(13)",
        unit="1",
        expression=cosines,
        lower=-one,
        upper=one,
        symmetric=True,
        columns=("k_s", "k_f"),
        for_all_t=False,
        formula="|k_s|, |k_f| <= 1: cos(theta_2) that (1) asks for at start and goal",
    )


def end_point(name: str, tool: Matrix, point: tuple[float, ...], reach: float) -> Constraint:
    """The tool (1, dim) of a robot with that reach is where the task wants it, m: a distance, up to rounding."""
    bound = ca.DM([[POINT_TOLERANCE * reach]])
    return Constraint(
        name=name,
        unit="m",
        expression=ca.norm_2(tool - ca.horzcat(*point)),
        lower=-bound,
        upper=bound,
        symmetric=True,
        columns=("tip",),
        scale=bound,
        for_all_t=False,
        formula=f"|tip at the {name} - {name}| <= {POINT_TOLERANCE:g} x reach",
    )

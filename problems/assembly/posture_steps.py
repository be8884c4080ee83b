"""Postures at the knots of a path, as steps of a program: one after the other, each near the one before."""

from __future__ import annotations

from typing import Any

import casadi as ca

from problems.encodings.knot_postures import KnotPostures
from problems.evaluation import Loop, Step


def posture_steps(encoding: KnotPostures[Any], joints: int, x: ca.SX, p: ca.SX) -> list[Step]:
    """The steps that write ``theta``, joint angles of all rows of the knots, ((lead + M) k, 1), from the candidate.

    Args:
        encoding: the symbolic twin of the encoding.
        joints: the number k of them.
        x: symbol of the candidate, (d, 1).
        p: symbol of all numbers of the statement, (q, 1).
    """
    rows = encoding.knot_rows
    row, posture = ca.SX.sym("row", rows.shape[1]), ca.SX.sym("posture", joints)
    theta = encoding.posture_at(x, row, posture.T).T
    start = Step.of("start", {"x": x, "p": p}, {"posture": ca.SX(encoding.posture_before(x).T)})
    inputs = {"x": x, "p": p, "row": row, "posture": posture}
    return [start, Step.of("knots", inputs, {"posture": theta, "theta": theta}, Loop(rows=rows), stacked=("theta",))]

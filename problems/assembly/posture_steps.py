"""Postures at the knots of a path, as steps of a program: one after the other, each near the one before."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from problems.encodings.path_encoding import PathEncoding
from problems.evaluation import Loop, Step


def posture_steps(encoding: PathEncoding[Any], x: ca.SX, p: ca.SX) -> list[Step]:
    """The steps that write ``theta``, joint angles at all knots, (M k, 1), from the candidate.

    Args:
        encoding: the symbolic twin of the encoding.
        x: symbol of the candidate, (d, 1).
        p: symbol of all numbers of the statement, (q, 1).
    """
    weights, points = encoding.interpolation, encoding.knot_points
    row = ca.SX.sym("row", weights.shape[1] + points.shape[1])
    posture = ca.SX.sym("posture", encoding.robot.dof)
    values, elbow, _ = encoding.parts(x)
    share, point = row[: weights.shape[1]].T, row[weights.shape[1] :]
    theta = encoding.posture(point, encoding.redundancy_at(share, point, values), elbow, posture.T).T
    start = Step.of("start", {"p": p}, {"posture": ca.SX(encoding.first_turn.T)})
    inputs = {"x": x, "p": p, "row": row, "posture": posture}
    loop = Loop(rows=np.column_stack([weights, points]))
    return [start, Step.of("knots", inputs, {"posture": theta, "theta": theta}, loop, stacked=("theta",))]

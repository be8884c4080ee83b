"""What a number of the model is worth at an optimum: the partial derivative of the Lagrangian with respect to it.

With f* the optimum of a program whose objective f and rows g depend on a number p, d f* / d p is the partial derivative
of f + lambda' g at the optimum: neither the variables nor the multipliers have to follow. The program is written
anew with a symbol for the number; the rest of it stays as it is.
"""

from __future__ import annotations

from dataclasses import fields, replace

import casadi as ca
import numpy as np

from problems.base.arguments import Arguments, Statement
from problems.base.matrix import FloatArray, as_array
from problems.nlp.optimum.prices import Sensitivity
from problems.nlp.program import TimedProgram
from problems.robots.rigid.payload import Payload
from problems.robots.robot import Robot

PAYLOAD = "payload"


def payload_price(
    program: TimedProgram, z: FloatArray, multipliers: FloatArray, objective_unit: str
) -> Sensitivity | None:
    """What a payload that is lighter by one unit of mass is worth; None where nothing with a mass is carried.

    Args:
        program: whose optimum it is.
        z: the optimum, (n,).
        multipliers: of the rows, (r,): positive at an upper bound.
        objective_unit: of the program's objective.
    """
    payload = payload_of(program.task.robot)
    if payload is None or payload.mass == 0.0:
        return None
    slope = float(parameter_slopes(program, z, multipliers, payload, "mass")[0])
    unit = f"{objective_unit} / (kg)"
    return Sensitivity(PAYLOAD, "mass", 0, -slope, unit, payload.mass, "kg") if slope else None


def payload_of(robot: Robot) -> Payload | None:
    """What its tool carries, if it can carry anything."""
    payload = getattr(robot, PAYLOAD, None)
    return payload if isinstance(payload, Payload) else None


def parameter_slopes(
    program: TimedProgram, z: FloatArray, multipliers: FloatArray, statement: Statement, field: str
) -> FloatArray:
    """Derivatives of the optimum with respect to the numbers of a field of a statement, (m,), in their units.

    Args:
        program: whose optimum it is, (n,); the statement is in its task or its limits.
        z: the optimum, (n,).
        multipliers: of the rows, (r,): positive at an upper bound.
        statement: the robot, what it carries, an obstacle.
        field: one of its ``numbers``, on which no bound of a row or of a variable depends.
    """
    arguments = Arguments(lambda owner, name: owner is statement and name == field)
    own = {part.name: arguments.twin(getattr(program, part.name)) for part in fields(program)}  # type: ignore[arg-type]
    twin = replace(program, **own)  # type: ignore[type-var]
    size = program.objective_size
    lagrangian = size * (twin.f * twin.objective_size / size + ca.dot(ca.DM(multipliers), twin.g))
    slope = ca.gradient(lagrangian, arguments.symbols)
    at = ca.Function("slope", [twin.x, arguments.symbols], [slope])
    return np.asarray(as_array(at(z, arguments.values)).ravel())

"""Shadow prices against finite differences of programs that are solved again with one number changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from problems import PlanarArm, PointToPoint, Problem, Robot, point_to_point
from problems.assembly.move import move
from problems.base.matrix import FloatArray
from problems.nlp.optimum.prices import Sensitivity
from problems.robots.rigid.inertia import Payload
from problems.tasks.move import Move
from problems.tasks.place import Joints
from solvers import IPOPT, Descent, Solution, StopReason
from tpbso_casadi.audit.optimum import prices_of

STEP = 0.005  # of a number, up and down
EXACT = IPOPT(tolerance=1e-9)


def arm(**changes: Any) -> PlanarArm:
    """Two rods with a kilogram in the hand, which strong motors at the shoulder and weak ones at the elbow move."""
    settings: dict[str, Any] = {
        "link_lengths": (0.5, 0.5), "max_speed": (4.0, 5.0), "max_acceleration": (40.0, 60.0),
        "link_masses": (2.0, 2.0), "max_torque": (45.0, 12.0), "payload": Payload(mass=1.0),
    }  # fmt: skip
    return PlanarArm(**(settings | changes))


def spline(robot: Robot) -> Problem[Any]:
    task = Move(robot, Joints((0.4, -1.6)), (Joints((1.9, -1.6)),))
    return move(task, "time", samples=40, pieces=6)


def paper(robot: Robot) -> Problem[Any]:
    return point_to_point(PointToPoint(robot, (0.6, -0.3), (0.3, 0.6), elbow="down"), "time", "reduced", 50)


FORMS: dict[str, Callable[[Robot], Problem[Any]]] = {"spline": spline, "paper": paper}


@dataclass(frozen=True)
class Solved:
    """A program, solved."""

    problem: Problem[Any]
    solution: Solution

    @property
    def objective(self) -> float:
        return self.solution.objective * self.problem.nlp().objective_size


def solved(problem: Problem[Any], start: FloatArray | None = None) -> Solved:
    program = problem.nlp()
    descent = Descent(program, EXACT)
    starts = program.starts(np.random.default_rng(1)) if start is None else iter([start])
    for _ in range(5):
        solution = descent(next(starts))
        if solution.stop_reason is StopReason.CONVERGED:
            return Solved(problem, solution)
    raise AssertionError(solution.status)


@cache
def base(form: str) -> tuple[Solved, tuple[Sensitivity, ...]]:
    found = solved(FORMS[form](arm()))
    return found, prices_of(found.problem.nlp(), found.solution, found.problem)


def slope(form: str, changed: Callable[[float], PlanarArm]) -> float:
    """The derivative of the optimum with respect to the logarithm of a number."""
    start = base(form)[0].solution.x
    up, down = (solved(FORMS[form](changed(1.0 + side * STEP)), start).objective for side in (1.0, -1.0))
    return (up - down) / (2.0 * STEP)


def scaled(values: tuple[float, ...], joint: int, factor: float) -> tuple[float, ...]:
    return tuple(value * (factor if place == joint else 1.0) for place, value in enumerate(values))

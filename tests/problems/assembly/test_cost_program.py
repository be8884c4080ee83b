"""The program of a cost against the model of all samples at once; and what has to be compiled anew."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import OVAL, THREE_METRES, changed, equal_links, following, moving
from helpers.searching import VM, sampled, source

from problems import Ellipse, PlanarArm, Problem, pentagram
from problems.base import FloatArray, as_array
from problems.limits import Constraint, PenaltyKind

START, GOAL = (1.0, 0.0), (0.5, 1.5)
TURNED = Ellipse((0.8, 0.8), (0.15, 0.25), 0.4)
BEHIND = Ellipse((-0.4, 0.9), (0.3, 0.1), 0.7)
LIMITED = equal_links(3, joint_limits=((-2.5, 3.0), (-2.0, 2.5), (-1.0, 5.0)))
STAR = pentagram((0.1, 0.0), 0.8, 0.4, 30)
BESIDE = Ellipse((1.2, 0.3), (0.1, 0.2), 0.3)


def penalty(constraint: Constraint, values: FloatArray, graded: bool) -> float:
    """What the rows of a constraint add to a cost."""
    lower, upper = constraint.bounds
    if graded:
        return float((np.maximum(0.0, np.maximum(lower - values, values - upper)) / constraint.scales).sum())
    broken = (values < lower) | (values > upper)
    return float(broken.sum() if constraint.penalty is PenaltyKind.COUNT else np.abs(values)[broken].sum())


def expected_cost(problem: Problem[Any], candidates: FloatArray) -> FloatArray:
    """From the model: everything at once, put together by the rules of the two formulations."""
    graded = problem.encoding.name == "reduced"
    restored = {"speed", "acceleration"} if graded else set()
    model = problem.model
    penalised = [c for c in model.constraints if c.name not in {"reach", *restored}]
    reach = [c for c in model.constraints if c.name == "reach"]
    outputs = [model.objective, *(c.expression for c in (*penalised, *reach))]
    evaluate = ca.Function("model", [model.x], [ca.densify(ca.SX(part)) for part in outputs], {"cse": True})
    costs = []
    for x in candidates:
        first, *values = (as_array(part) for part in evaluate.call([ca.DM(x)]))
        objective, cosines = float(first[0, 0]), np.abs(values[len(penalised)]).ravel() if reach else np.zeros(2)
        broken = sum(penalty(c, v, graded) for c, v in zip(penalised, values[: len(penalised)], strict=True))
        if graded:
            costs.append(problem.weights.objective_upper_bound + broken if broken > 0.0 else objective)
        elif cosines.max() <= 1.0:
            costs.append(objective + problem.weights.limit * broken)
        else:
            costs.append(problem.weights.reach * cosines.sum())
    return np.array(costs)


def check_costs(costs: FloatArray, expected: FloatArray) -> None:
    """The same to 1e-9; but where an arm is stretched out, square roots make 1e-8 of a rounding error of 1e-16."""
    assert (np.abs(costs - expected) <= 1e-9 * np.abs(expected)).mean() > 0.95
    np.testing.assert_allclose(costs, expected, rtol=1e-7)


# What has to be compiled


@cache
def stated(kind: str, formulation: str) -> Problem[Any]:
    if kind == "move":
        return moving(LIMITED, START, GOAL, "length", "free", formulation, obstacles=(TURNED,), segment_time=(0.1, 4.0))
    return following(
        THREE_METRES, STAR, 0.1, "rotation", "free", formulation, obstacles=(BESIDE,), total_time=(0.1, 10.0)
    )


FASTER = PlanarArm((0.6, 0.7, 0.8), (5.0, 6.0, 7.0), (30.0, 20.0, 10.0), ((-2.6, 3.1), (-2.2, 2.4), (-1.2, 4.0)))
OTHER_SCENE: dict[str, dict[str, Any]] = {
    "move": {
        "robot": FASTER, "start": (0.9, -0.3), "goal": (-0.5, 1.2), "segment_time": (0.2, 3.0), "samples": 23,
        "obstacles": (Ellipse((0.7, 0.9), (0.2, 0.1), -0.8),),
    },
    "trace": {
        "robot": PlanarArm((1.0, 0.9, 1.1), (90.0,) * 3, (2000.0, 3000.0, 4000.0)), "accuracy": 0.05,
        "path": pentagram((0.0, -0.1), 0.9, 0.1, 30), "total_time": (0.2, 3.0), "samples": 100,
        "obstacles": (Ellipse((1.15, 0.35), (0.15, 0.1), 0.1),),
    },
}  # fmt: skip
OTHER_STRUCTURE: dict[str, tuple[str, dict[str, Any]]] = {
    "objective": ("move", {"objective": "rotation"}),
    "elbow": ("move", {"elbow": "up"}),
    "one more obstacle": ("move", {"obstacles": (TURNED, BEHIND)}),
    "obstacle that is not turned": ("move", {"obstacles": (OVAL,)}),
    "no joint limits": ("move", {"robot": equal_links(3)}),
    "links": ("move", {"robot": equal_links(4, joint_limits=((-3.0, 3.0),) * 4)}),
    "objective on a path": ("trace", {"objective": "time"}),
    "knots": ("trace", {"knots": 9}),
    "redundancy values": ("trace", {"redundancy_values": 4}),
    "no obstacle beside a path": ("trace", {"obstacles": ()}),
}
each_formulation = pytest.mark.parametrize("formulation", ["paper", "reduced"])


@each_formulation
@pytest.mark.parametrize("kind", OTHER_SCENE)
def test_another_scene_of_the_same_structure_has_the_same_source(kind: str, formulation: str) -> None:
    """Every number is another one at once: whatever was built in would be seen in the source or in a cost."""
    problem = stated(kind, formulation)
    other = changed(problem, **OTHER_SCENE[kind])
    assert source(problem) == source(other)
    x = sampled(other, 40)
    check_costs(other.evaluator(VM)(x), expected_cost(other, x))


@pytest.mark.parametrize(("kind", "changes"), OTHER_STRUCTURE.values(), ids=OTHER_STRUCTURE)
def test_another_structure_has_another_source(kind: str, changes: dict[str, Any]) -> None:
    problem = stated(kind, "reduced")
    assert source(problem) != source(changed(problem, **changes))


def test_formulations_have_sources_of_their_own() -> None:
    for kind in OTHER_SCENE:
        assert source(stated(kind, "paper")) != source(stated(kind, "reduced"))

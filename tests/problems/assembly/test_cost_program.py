"""The program of a cost against the model of all samples at once; and what has to be compiled anew."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, OVAL, THREE_METRES, builtin, changed, equal_links, following, moving

from problems import Ellipse, PlanarArm, Problem, pentagram
from problems.base import FloatArray, as_array
from problems.evaluation import EvaluationOptions
from problems.evaluation.codegen import cpp
from problems.evaluation.kernel import kernels
from problems.limits import Constraint, PenaltyKind
from solvers import PSO, Box, Budget, minimize

START, GOAL = (1.0, 0.0), (0.5, 1.5)
TURNED = Ellipse((0.8, 0.8), (0.15, 0.25), 0.4)
BEHIND = Ellipse((-0.4, 0.9), (0.3, 0.1), 0.7)
RANGES = ((-2.5, 3.0), (-2.0, 2.5), (-1.0, 5.0))
STAR = pentagram((0.1, 0.0), 0.8, 0.4, 30)
BESIDE = Ellipse((1.2, 0.3), (0.1, 0.2), 0.3)

OTHERS: dict[str, Problem[Any]] = {
    "free elbow": moving(equal_links(3), START, GOAL, "time", "free"),
    "elbow down": moving(equal_links(4), START, GOAL, "rotation", "down"),
    "joint limits": moving(equal_links(3, joint_limits=RANGES), START, GOAL, "rotation", "free"),
    "turned ellipse": moving(equal_links(3), START, GOAL, "length", "up", obstacles=(TURNED,)),
    "turned ellipse, least time": moving(equal_links(4), START, GOAL, "time", "free", obstacles=(TURNED,)),
    "two obstacles": moving(equal_links(4), START, GOAL, "length", "down", obstacles=(OVAL, BEHIND)),
    "five links": moving(equal_links(5), START, GOAL, "rotation", "free", obstacles=(OVAL,)),
    "few samples": moving(equal_links(3), START, GOAL, "length", "up", samples=2),
    "path, free elbow": following(THREE_METRES, STAR, 0.1, "length", "free"),
    "path, joint limits": following(replace(THREE_METRES, joint_limits=((-9.0, 9.0),) * 3), STAR, 0.3, "time", "up"),
    "path, two obstacles": following(THREE_METRES, STAR, 0.3, "rotation", "free", obstacles=(BESIDE, BEHIND)),
    "path, five links": following(
        PlanarArm((0.6,) * 5, (100.0,) * 5, (3000.0,) * 5), STAR, 0.2, "length", "down", redundancy_values=3, knots=9
    ),
    "bounded segment times": moving(equal_links(3), START, GOAL, "rotation", "up", segment_time=(0.5, 0.7)),
    "bounded total time": following(THREE_METRES, STAR, 0.3, "length", "up", total_time=(0.3, 0.4)),
    "two points": following(THREE_METRES, STAR.resampled(6), 0.9, "time", "up", samples=2, knots=2),
}
EVERY = [*product(BUILTIN, ("paper", "reduced")), *product(OTHERS, ("paper", "reduced"))]


def case(name: str, formulation: str) -> Problem[Any]:
    return changed(OTHERS[name], formulation=formulation) if name in OTHERS else builtin(name, formulation)


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


@pytest.mark.parametrize(("name", "formulation"), EVERY)
def test_steps_over_samples_cost_what_the_model_costs(name: str, formulation: str) -> None:
    problem, rng = case(name, formulation), np.random.default_rng(5)
    box, evaluate = Box(*problem.bounds), problem.evaluator(EvaluationOptions("vm"))
    best = minimize(evaluate, box, PSO(population=20), Budget(1500), 5).x
    around = best + 10.0 ** rng.uniform(-5.0, -1.0, (60, 1)) * rng.normal(size=(60, box.dimension))
    candidates = np.concatenate([box.sample(rng, 60), box.clip(around), [best, box.lower, box.upper]])
    costs = evaluate(candidates)
    assert np.isfinite(costs).all()
    assert len(np.unique(costs)) > 60
    check_costs(costs, expected_cost(problem, candidates))


def check_costs(costs: FloatArray, expected: FloatArray) -> None:
    """The same to 1e-9; but where an arm is stretched out, square roots make 1e-8 of a rounding error of 1e-16."""
    assert (np.abs(costs - expected) <= 1e-9 * np.abs(expected)).mean() > 0.95
    np.testing.assert_allclose(costs, expected, rtol=1e-7)


# What has to be compiled


def source(problem: Problem[Any]) -> str:
    return cpp(kernels(problem.program), problem.program.sizes)


LIMITED = equal_links(3, joint_limits=RANGES)
MOVE = moving(LIMITED, START, GOAL, "length", "free", obstacles=(TURNED,))
FASTER = PlanarArm((0.6, 0.7, 0.8), (5.0, 6.0, 7.0), (30.0, 20.0, 10.0), ((-2.6, 3.1), (-2.2, 2.4), (-1.2, 4.0)))
TRACE = following(THREE_METRES, STAR, 0.1, "rotation", "free", obstacles=(BESIDE,))
SAME_STRUCTURE: dict[str, tuple[Problem[Any], dict[str, Any]]] = {
    "start": (MOVE, {"start": (0.9, -0.3)}),
    "goal": (MOVE, {"goal": (-0.5, 1.2)}),
    "arm and its limits": (MOVE, {"robot": FASTER}),
    "obstacle": (MOVE, {"obstacles": (Ellipse((0.7, 0.9), (0.2, 0.1), -0.8),)}),
    "segment time": (changed(MOVE, segment_time=(0.1, 4.0)), {"segment_time": (0.2, 3.0)}),
    "samples": (MOVE, {"samples": 23}),
    "path": (TRACE, {"path": pentagram((0.0, -0.1), 0.9, 0.1, 30)}),
    "accuracy": (TRACE, {"accuracy": 0.05}),
    "arm on a path": (TRACE, {"robot": PlanarArm((1.0, 0.9, 1.1), (90.0,) * 3, (2000.0, 3000.0, 4000.0))}),
    "obstacle beside a path": (TRACE, {"obstacles": (Ellipse((1.15, 0.35), (0.15, 0.1), 0.1),)}),
    "total time": (changed(TRACE, total_time=(0.1, 10.0)), {"total_time": (0.2, 3.0)}),
    "samples of a path": (TRACE, {"samples": 200}),
}
DIFFERENT_STRUCTURE: dict[str, tuple[Problem[Any], dict[str, Any]]] = {
    "objective": (MOVE, {"objective": "rotation"}),
    "elbow": (MOVE, {"elbow": "up"}),
    "one more obstacle": (MOVE, {"obstacles": (TURNED, BEHIND)}),
    "obstacle that is not turned": (MOVE, {"obstacles": (OVAL,)}),
    "no joint limits": (MOVE, {"robot": equal_links(3)}),
    "links": (MOVE, {"robot": equal_links(4, joint_limits=((-3.0, 3.0),) * 4)}),
    "objective on a path": (TRACE, {"objective": "time"}),
    "knots": (TRACE, {"knots": 9}),
    "redundancy values": (TRACE, {"redundancy_values": 4}),
    "no obstacle beside a path": (TRACE, {"obstacles": ()}),
}


@pytest.mark.parametrize("formulation", ["paper", "reduced"])
@pytest.mark.parametrize(("problem", "changes"), SAME_STRUCTURE.values(), ids=SAME_STRUCTURE)
def test_another_scene_of_the_same_structure_has_the_same_source(
    problem: Problem[Any], changes: dict[str, Any], formulation: str
) -> None:
    problem = changed(problem, formulation=formulation)
    other = changed(problem, **changes)
    assert source(problem) == source(other)
    candidates = Box(*problem.bounds).sample(np.random.default_rng(0), 40)
    vm = EvaluationOptions("vm")
    only_bounds = set(changes) <= {"segment_time", "total_time"}
    assert (problem.evaluator(vm)(candidates) != other.evaluator(vm)(candidates)).any() or only_bounds
    inside = Box(*other.bounds).clip(candidates)  # bounds of times are bounds of variables too
    check_costs(other.evaluator(vm)(inside), expected_cost(other, inside))


@pytest.mark.parametrize("formulation", ["paper", "reduced"])
@pytest.mark.parametrize(("problem", "changes"), DIFFERENT_STRUCTURE.values(), ids=DIFFERENT_STRUCTURE)
def test_another_structure_has_another_source(problem: Problem[Any], changes: dict[str, Any], formulation: str) -> None:
    problem = changed(problem, formulation=formulation)
    assert source(problem) != source(changed(problem, **changes))


def test_formulations_have_sources_of_their_own() -> None:
    for problem in (MOVE, TRACE):
        assert source(problem) != source(changed(problem, formulation="reduced"))

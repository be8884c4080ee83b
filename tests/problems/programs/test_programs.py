"""The nonlinear programs: motions and limits of the search, own limits too; right derivatives, no NaN anywhere."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import islice, product
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import builtin, changed, equal_links, following, moving
from helpers.own_limits import FASTEST, NotTooSoon, TipSpeed

from problems import (
    CertificateStatus,
    Ellipse,
    Limit,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    closed_curve,
    path_following,
    pentagram,
    point_to_point,
)
from problems.base import FloatArray, as_array
from problems.certify import exact_time_scale
from problems.limits import SAMPLING_MARGIN
from problems.programs import NonlinearProgram, composed_hessian
from solvers import IPOPT, Descent, SearchBox, StopReason

ARM = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, ((-3.0, 3.0), (-2.9, 2.9), (-2.9, 2.9)))
OVAL = Ellipse((0.8, 0.8), (0.15, 0.25), 0.3)
CURVE = closed_curve((0.1, 0.0), 1.0, 0.0, 3, 0.1, 20)
CASES: dict[str, Problem[Any]] = {
    "time": moving(ARM, (1.0, 0.0), (0.5, 1.5), "time", "up"),
    "rotation": moving(ARM, (1.0, 0.0), (0.5, 1.5), "rotation", "free"),
    "length": moving(ARM, (1.0, 0.0), (0.5, 1.5), "length", "down", obstacles=(OVAL,)),
    "path, time": following(ARM, CURVE, 0.05, "time", "free"),
    "path, rotation": following(ARM, CURVE, 0.05, "rotation", "up"),
    "path, length, values": following(ARM, CURVE, 0.05, "length", "up", knot_redundancy="values"),
    "path, obstacle": following(ARM, CURVE, 0.05, "time", "free", obstacles=(Ellipse((0.4, 0.0), (0.1, 0.1)),)),
}


SLOW = {"time", "path, rotation"}  # much like the others
each_case = pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in SLOW)) for name in CASES]
)


@cache
def reduced_form(name: str) -> tuple[Problem[Any], NonlinearProgram]:
    problem = changed(CASES[name], formulation="reduced")
    return problem, problem.nlp()


def candidate(problem: Problem[Any]) -> FloatArray:
    """A search vector that the arm can reach."""
    x = SearchBox(*problem.bounds).sample(np.random.default_rng(0), 1)[0]
    return np.clip(x, problem.bounds[0] + 1e-3, problem.bounds[1] - 1e-3)


@each_case
def test_a_search_vector_keeps_its_motion(name: str) -> None:
    reduced, program = reduced_form(name)
    x = candidate(reduced)
    program_motion, expected = program.trajectory(program.from_search(x)), reduced.trajectory(x)
    share = np.linspace(0.0, 1.0, 50)
    theta, again = (as_array(motion.samples(share * motion.duration).theta) for motion in (expected, program_motion))
    assert again == pytest.approx(theta, abs=1e-6)
    assert exact_time_scale(reduced.criteria.limits, program_motion) <= 1.0
    assert set(program.quantities(program.from_search(x))) == set(reduced.quantities(x))


@each_case
def test_a_start_meets_the_equalities(name: str) -> None:
    problem, program = reduced_form(name)
    rows = ca.Function("g", [program.x], [program.g])
    starts = islice(program.starts(np.random.default_rng(0)), 5)
    for x in (program.from_search(candidate(problem)), *starts):
        lower, upper = program.row_bounds()
        g = np.asarray(rows(x)).ravel()
        equal = lower == upper
        names = np.concatenate([[c.name] * c.expression.numel() for c in program.constraints(SAMPLING_MARGIN)])
        broken = set(names[equal][np.abs(g[equal] - lower[equal]) > 1e-6])
        assert broken <= {"redundancy"}  # a search cuts interpolated values off at 0 and 1, the program may not
        low, high = program.bounds_near(x)
        assert (low < high).all()


@each_case
def test_derivatives_agree_with_finite_differences(name: str) -> None:
    _, program = reduced_form(name)
    both = ca.vertcat(program.f, program.g)
    values = ca.Function("v", [program.x], [both])
    jacobian = ca.Function("j", [program.x], [ca.jacobian(both, program.x)])
    x = next(program.starts(np.random.default_rng(1)))
    rng, exact, h = np.random.default_rng(2), np.asarray(jacobian(x).full()), 1e-6
    for _ in range(4):
        d = rng.normal(size=x.size)
        numeric = np.asarray(values(x + h * d) - values(x - h * d)).ravel() / (2.0 * h)
        scale = 1.0 + np.abs(exact) @ np.abs(d)
        smooth = np.abs(exact @ d - numeric) <= 1e-5 * scale
        assert smooth.mean() > 0.98  # a row may stand at a kink of its closest point


@each_case
def test_no_derivative_is_nan_at_awkward_postures(name: str) -> None:
    problem, program = reduced_form(name)
    lagrangian = program.f + ca.sum1(program.g)
    every = ca.Function("d", [program.x], [program.g, ca.gradient(lagrangian, program.x)])
    x = next(program.starts(np.random.default_rng(3)))
    time_scaled, still = np.zeros_like(x), x.copy()
    k = problem.criteria.robot.dof
    still[: 4 * k] = 0.7  # all postures the same: no step, no chord
    for z in (time_scaled + 0.5 * (np.arange(x.size) >= 4 * k), still):
        assert all(np.isfinite(np.asarray(part)).all() for part in every(z))


@pytest.mark.parametrize("name", ["time-3", "rotation-2", "obstacle-3", "pentagram-rotation"])
def test_limits_have_the_names_that_the_search_has(name: str) -> None:
    problem = builtin(name)
    ours = {c.name for c in problem.nlp().constraints(SAMPLING_MARGIN)}
    time_alone = set() if problem.criteria.objective.name == "time" else {"speed", "acceleration"}
    assert {c.name for c in problem.model.constraints} - {"reach"} - time_alone <= ours


@each_case
def test_a_margin_moves_bounds_alone_and_may_be_zero(name: str) -> None:
    _, program = reduced_form(name)
    none, usual, wide = (np.array(program.row_bounds(margin)) for margin in (0.0, None, 10.0 * SAMPLING_MARGIN))
    assert (usual == np.array(program.row_bounds(SAMPLING_MARGIN))).all()
    assert (none[0] <= usual[0]).all()
    assert (usual[0] <= wide[0]).all()
    assert (none[1] >= usual[1]).all()
    assert (usual[1] >= wide[1]).all()
    assert (none != usual).any()  # all of these arms have joint limits


@pytest.mark.parametrize(
    ("start", "goal", "links", "objective"),
    [
        ((2.0, 0.0), (0.0, 2.0), 3, "length"),
        ((1.0, 0.0), (1.0, 0.0), 3, "rotation"),
        ((0.0, 0.0), (1.0, 0.5), 2, "length"),
        ((2.0, 0.0), (0.0, 0.0), 2, "time"),
    ],
    ids=["stretched", "nowhere to go", "from the base", "to the base"],
)
def test_moves_at_the_edge_do_not_break_anything(
    start: tuple[float, float], goal: tuple[float, float], links: int, objective: str
) -> None:
    arm = PlanarArm((2.0 / links,) * links, (4.0,) * links, (20.0,) * links)
    program = moving(arm, start, goal, objective, "free").nlp()
    result = Descent(program, IPOPT())(next(program.starts(np.random.default_rng(0))))
    motion = program.trajectory(result.x)
    assert np.isfinite(result.x).all()
    assert np.isfinite(motion.coefficients).all()


@pytest.mark.slow
def test_pentagram_may_be_followed_with_a_value_at_every_knot_or_with_few() -> None:
    arm = PlanarArm((1.0, 1.0, 1.0), (40.0,) * 3, (2000.0,) * 3)
    free = following(arm, pentagram((0.0, 0.0), 0.9, 0.4, 30), 0.1, "rotation", "up")
    costs = []
    for problem in (free, changed(free, knot_redundancy="values")):
        program = problem.nlp()
        descent = Descent(program, IPOPT())
        results = [descent(x) for x in islice(program.starts(np.random.default_rng(0)), 4)]
        motions = [program.trajectory(f.x) for f in results if f.stop_reason is StopReason.CONVERGED]
        feasible = [m for m in motions if all(v.satisfied for v in problem.criteria.verify(m))]
        costs.append(min(problem.criteria.objective_value(m, problem.criteria.row_times(m, 201)) for m in feasible))
    assert costs[0] < costs[1]


# The Hessian in two steps is the one that CasADi derives in one


@pytest.mark.parametrize("objective", ["time", "length"])
def test_hessian_of_a_program(objective: str) -> None:
    program = moving(ARM, (1.0, 0.0), (0.5, 1.5), objective, "up", samples=8, obstacles=(OVAL,)).nlp()
    rng = np.random.default_rng(0)
    forces, x = rng.normal(size=program.g.shape[0]), next(program.starts(rng))
    lagrangian = 1.3 * program.f + ca.dot(ca.DM(forces), program.g)
    expected = ca.Function("h", [program.x], [ca.triu(ca.hessian(lagrangian, program.x)[0])])(x)
    assert program.hessian is not None
    composed = program.hessian(x, [], 1.3, forces)
    assert np.asarray(composed.full()) == pytest.approx(np.asarray(expected.full()), rel=1e-9, abs=1e-8)


def test_a_term_of_both_is_refused() -> None:
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    with pytest.raises(ValueError, match="mixes"):
        composed_hessian(x, y, x**3, x * y, y)


# Limits beyond the paper's: on jerk, on the speed of the tip, on speeds that do not scale; kept by both programs

PLAIN = equal_links(3)
BETWEEN = 0.03  # may be broken between samples in a single descent


@cache
def with_limits(kind: str, robot: PlanarArm, *limits: type[Limit], objective: str = "time") -> Problem[Any]:
    if kind == "point to point":
        return point_to_point(PointToPoint(robot, (1.0, 0.0), (0.5, 1.5), elbow="up"), objective, limits=limits)
    path = CURVE
    return path_following(PathFollowing(robot, path, 0.05, elbow="up"), objective, limits=limits)


@pytest.mark.parametrize(
    ("kind", "limits", "objective"),
    [
        pytest.param(kind, limits, objective, marks=[pytest.mark.slow] * ((place + other) % 2))
        for other, kind in enumerate(("point to point", "path"))
        for place, (limits, objective) in enumerate(product(((), (TipSpeed,), (NotTooSoon,)), ("time", "rotation")))
    ],
)
def test_ipopt_keeps_them(kind: str, limits: tuple[type[Limit], ...], objective: str) -> None:
    stated = with_limits(kind, PLAIN if limits else replace(PLAIN, max_jerk=(150.0,) * 3), *limits, objective=objective)
    program = stated.nlp()
    solution = Descent(program, IPOPT())(next(program.starts(np.random.default_rng(1))))
    verdicts = stated.criteria.verify(program.trajectory(solution.x))
    names = [verdict.name for verdict in verdicts]
    assert ("jerk" if not limits else limits[0].name) in names
    broken = [v for v in verdicts if v.status is CertificateStatus.VIOLATED and v.worst > v.bound * (1.0 + BETWEEN)]
    assert not broken


def test_the_time_scale_of_a_limit_without_closed_form() -> None:
    stated = with_limits("point to point", PLAIN)
    motion = stated.trajectory(np.mean(stated.bounds, axis=0))
    limit = TipSpeed(stated.criteria.robot)
    scaled = motion.time_scaled(exact_time_scale([limit], motion))
    fastest = float(ca.mmax(limit.magnitudes(scaled.samples(scaled.times(5001), stated.criteria.robot))))
    assert fastest <= FASTEST
    assert fastest > FASTEST * 0.99

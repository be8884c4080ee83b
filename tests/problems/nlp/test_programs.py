"""The nonlinear programs: the same motions and limits as the search, derivatives that are right, no NaN anywhere."""

from __future__ import annotations

from itertools import islice
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import BUILTIN, builtin, changed, following, moving
from scipy.optimize import NonlinearConstraint
from scipy.optimize import minimize as scipy_minimize

from problems import Ellipse, PlanarArm, Problem, closed_curve, pentagram
from problems.base import as_array
from problems.certify import exact_time_scale
from problems.families.knots.motion import NodeForm, RestSpline
from problems.limits import SAMPLING_MARGIN
from solvers import IPOPT, Box, Descent, StopReason

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


@pytest.fixture(params=CASES.values(), ids=CASES)
def problem(request: pytest.FixtureRequest) -> Problem[Any]:
    case = request.param
    assert isinstance(case, Problem)
    return case


def candidate(problem: Problem[Any], seed: int = 0) -> np.ndarray:
    """A search vector that the arm can reach."""
    reduced = changed(problem, formulation="reduced")
    x = Box(*reduced.bounds).sample(np.random.default_rng(seed), 1)[0]
    return np.clip(x, reduced.bounds[0] + 1e-3, reduced.bounds[1] - 1e-3)


def test_a_search_vector_keeps_its_motion(problem: Problem[Any]) -> None:
    reduced = changed(problem, formulation="reduced")
    x, program = candidate(problem), reduced.nlp()
    program_motion, expected = program.trajectory(program.from_search(x)), reduced.trajectory(x)
    share = np.linspace(0.0, 1.0, 50)
    theta, again = (as_array(motion.samples(share * motion.duration).theta) for motion in (expected, program_motion))
    assert again == pytest.approx(theta, abs=1e-6)
    assert exact_time_scale(problem.limits, program_motion) <= 1.0
    assert set(program.quantities(program.from_search(x))) == set(reduced.quantities(x))


def test_a_start_meets_the_equalities(problem: Problem[Any]) -> None:
    program = changed(problem, formulation="reduced").nlp()
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


def test_derivatives_agree_with_finite_differences(problem: Problem[Any]) -> None:
    program = problem.nlp()
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


def test_no_derivative_is_nan_at_awkward_postures(problem: Problem[Any]) -> None:
    program = problem.nlp()
    lagrangian = program.f + ca.sum1(program.g)
    every = ca.Function("d", [program.x], [program.g, ca.gradient(lagrangian, program.x)])
    x = next(program.starts(np.random.default_rng(3)))
    time_scaled, still = np.zeros_like(x), x.copy()
    k = problem.robot.dof
    still[: 4 * k] = 0.7  # all postures the same: no step, no chord
    for z in (time_scaled + 0.5 * (np.arange(x.size) >= 4 * k), still):
        assert all(np.isfinite(np.asarray(part)).all() for part in every(z))


def test_values_of_redundancy_that_stay_inside_are_met() -> None:
    problem = changed(CASES["path, length, values"], formulation="reduced")
    program = problem.nlp()
    rows = {c.name: c for c in program.constraints(SAMPLING_MARGIN)}
    both = ca.Function("r", [program.x], [rows["redundancy"].expression, rows["x_phi"].expression])
    miss, share = both(program.from_search(np.array([0.4, 0.5, 0.45, 0.5, 0.55])))
    assert np.asarray(miss) == pytest.approx(0.0, abs=1e-9)
    assert 0.35 < float(ca.mmin(share)) < float(ca.mmax(share)) < 0.6


@pytest.mark.parametrize("name", BUILTIN)
def test_limits_have_the_names_that_the_search_has(name: str) -> None:
    problem = builtin(name)
    ours = {c.name for c in problem.nlp().constraints(SAMPLING_MARGIN)}
    time_alone = set() if problem.objective.name == "time" else {"speed", "acceleration"}
    assert {c.name for c in problem.constraints} - {"reach"} - time_alone <= ours


def test_a_margin_moves_bounds_alone_and_may_be_zero(problem: Problem[Any]) -> None:
    program = problem.nlp()
    none, usual, wide = (np.array(program.row_bounds(margin)) for margin in (0.0, None, 10.0 * SAMPLING_MARGIN))
    assert (usual == np.array(program.row_bounds(SAMPLING_MARGIN))).all()
    assert (none[0] <= usual[0]).all()
    assert (usual[0] <= wide[0]).all()
    assert (none[1] >= usual[1]).all()
    assert (usual[1] >= wide[1]).all()
    assert (none != usual).any()  # all of these arms have joint limits


def test_scipy_stays_at_the_same_optimum() -> None:
    program = changed(builtin("time-2"), samples=15).nlp()
    ours = Descent(program, IPOPT(tolerance=1e-9))(next(program.starts(np.random.default_rng(4))))
    symbols = program.x
    f, df, g, dg = (
        ca.Function("f", [symbols], [ca.densify(part)])
        for part in (program.f, ca.gradient(program.f, symbols), program.g, ca.jacobian(program.g, symbols))
    )
    low, high = program.row_bounds()
    rows = [
        NonlinearConstraint(
            lambda z, kind=kind: np.asarray(g(z)).ravel()[kind],
            low[kind],
            high[kind],
            jac=lambda z, kind=kind: np.asarray(dg(z))[kind],
        )
        for kind in (low == high, low != high)
    ]
    theirs = scipy_minimize(
        lambda z: float(f(z)),
        ours.x + 0.02 * np.random.default_rng(0).normal(size=ours.x.size),
        jac=lambda z: np.asarray(df(z)).ravel(),
        bounds=list(zip(*program.bounds_near(ours.x), strict=True)),
        constraints=rows,
        method="SLSQP",
        options={"maxiter": 500, "ftol": 1e-10},
    )
    assert theirs.success
    assert ours.stop_reason is StopReason.CONVERGED
    assert ours.objective == pytest.approx(theirs.fun, rel=1e-6)


def test_node_form_is_the_spline_of_its_angles() -> None:
    spline = RestSpline(np.array([0.0, 0.02, 0.06, 0.1, 0.5, 0.52, 0.9, 0.98, 1.0]))
    form, angles = NodeForm(spline), np.random.default_rng(0).normal(size=(9, 3))
    shape = spline.coefficients(ca.DM(angles))
    at_nodes = ca.mtimes(spline.sampling_matrix(spline.nodes), shape)
    bends = spline.accelerations(shape) * form.unit
    assert np.asarray(form.joins(at_nodes, bends)) == pytest.approx(0.0, abs=1e-9)
    assert np.asarray(at_nodes[form.knots, :]) == pytest.approx(angles)
    u = np.linspace(0.0, 1.0, 77)
    for derivative, node_samples in enumerate(form.samples(at_nodes, bends, u)):
        expected = np.asarray(ca.mtimes(spline.sampling_matrix(u, derivative), shape))
        assert np.asarray(node_samples) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("start", "goal", "links"),
    [
        ((2.0, 0.0), (0.0, 2.0), 3),
        ((1.0, 0.0), (1.0, 0.0), 3),
        ((0.0, 0.0), (1.0, 0.5), 2),
        ((2.0, 0.0), (0.0, 0.0), 2),
    ],
    ids=["time_scaled", "nowhere to go", "from the base", "to the base"],
)
@pytest.mark.parametrize("objective", ["time", "rotation", "length"])
def test_moves_at_the_edge_do_not_break_anything(
    start: tuple[float, float], goal: tuple[float, float], links: int, objective: str
) -> None:
    arm = PlanarArm((2.0 / links,) * links, (4.0,) * links, (20.0,) * links)
    program = moving(arm, start, goal, objective, "free").nlp()
    result = Descent(program, IPOPT())(next(program.starts(np.random.default_rng(0))))
    motion = program.trajectory(result.x)
    assert np.isfinite(result.x).all()
    assert np.isfinite(motion.coefficients).all()


def test_pentagram_may_be_followed_with_a_value_at_every_knot_or_with_few() -> None:
    arm = PlanarArm((1.0, 1.0, 1.0), (40.0,) * 3, (2000.0,) * 3)
    free = following(arm, pentagram((0.0, 0.0), 0.9, 0.4, 30), 0.1, "rotation", "up")
    costs = []
    for problem in (free, changed(free, knot_redundancy="values")):
        program = problem.nlp()
        descent = Descent(program, IPOPT())
        results = [descent(x) for x in islice(program.starts(np.random.default_rng(0)), 4)]
        motions = [program.trajectory(f.x) for f in results if f.stop_reason is StopReason.CONVERGED]
        feasible = [m for m in motions if all(v.satisfied for v in problem.verify(m))]
        costs.append(min(problem.objective_value(m, problem.row_times(m, 201)) for m in feasible))
    assert costs[0] < costs[1]

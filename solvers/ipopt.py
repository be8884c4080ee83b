"""IPOPT: a gradient-based interior-point method, from one start or from many.

Wächter and Biegler, "On the Implementation of an Interior-Point Filter Line-Search Algorithm for Large-Scale
Nonlinear Programming", 2006; called through CasADi, which supplies exact first and second derivatives.

It does not draw candidates from a box and is no :class:`solvers.solver.Solver`: it descends from a start, on a
program whose derivatives it knows. :func:`descend` is its driver; its result is that of the other solvers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import casadi as ca
import numpy as np

from solvers.box import FloatArray
from solvers.budget import Budget, StopReason
from solvers.minimize import History, Result, Status, deferred_interrupt
from solvers.solver import require

REASONS = {
    "Solve_Succeeded": StopReason.CONVERGED,
    "Solved_To_Acceptable_Level": StopReason.CONVERGED,
    "Maximum_Iterations_Exceeded": StopReason.ITERATIONS,
    "Maximum_WallTime_Exceeded": StopReason.SECONDS,
    "Maximum_CpuTime_Exceeded": StopReason.SECONDS,
    "User_Requested_Stop": StopReason.INTERRUPTED,
}  # every other status is StopReason.FAILED


class Program(Protocol):
    """What is minimised: f(x), subject to bounds of x and of the rows g(x)."""

    @property
    def x(self) -> Any:
        """The variables, CasADi symbols (n, 1)."""

    @property
    def f(self) -> Any:
        """The objective, a scalar expression of x."""

    @property
    def g(self) -> Any:
        """The rows, expressions of x, (r, 1)."""

    def row_bounds(self, margin: float | None = None) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the rows, both (r,)."""

    def bounds_near(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the variables, both (n,), for a start (n,)."""


@dataclass(frozen=True)
class Solution:
    """Where one descent ended.

    Attributes:
        x: the variables, (n,).
        objective: f(x).
        status: IPOPT's own word.
        stop_reason: the same in ours.
        iterations: of IPOPT.
        evaluations: of f.
        seconds: wall-clock time.
        row_multipliers: of g, (r,): positive at an upper bound, negative at a lower one.
        bound_multipliers: of the bounds of x, (n,).
        residuals: "stationarity" |grad f + J' row + bound multipliers|, "violation" of bounds and rows,
            "complementarity": largest absolute values, unscaled; all about 0 at a KKT point.
    """

    x: FloatArray
    objective: float
    status: str
    stop_reason: StopReason
    iterations: int
    evaluations: int
    seconds: float
    row_multipliers: FloatArray
    bound_multipliers: FloatArray
    residuals: dict[str, float]

    def after(self, before: Solution) -> Solution:
        """This solution with the effort of the one that it went on from added to its own."""
        return replace(
            self,
            iterations=before.iterations + self.iterations,
            evaluations=before.evaluations + self.evaluations,
            seconds=before.seconds + self.seconds,
        )


@dataclass(frozen=True)
class DescentResult(Result):
    """The result of many descents: the best, and how it ended.

    ``x`` holds the program's variables, ``iterations`` the starts, ``history`` the best after each start.
    """

    solution: Solution


@dataclass(frozen=True)
class IPOPT:
    """IPOPT with the settings that matter here.

    Raises:
        ValueError: a setting outside the range stated beside it.
    """

    tolerance: float = 1e-6  # > 0, of the scaled KKT residual
    acceptable: float = 1e-5  # > 0, a residual that is good enough when five iterations do not improve it
    max_iterations: int = 300  # >= 1, of one descent
    warm: bool = False  # start near the solution: a small barrier, and a start that is hardly moved off its bounds
    print_level: int = 0  # 0 to 12, what IPOPT itself prints

    def __post_init__(self) -> None:
        require(self.tolerance > 0.0 and self.acceptable > 0.0, "tolerances are positive")
        require(self.max_iterations >= 1, f"max_iterations = {self.max_iterations} is less than 1")
        require(0 <= self.print_level <= 12, f"print_level = {self.print_level} is not in 0..12")

    def options(self) -> dict[str, Any]:
        """As CasADi takes them."""
        ipopt = {
            "tol": self.tolerance,
            "acceptable_tol": self.acceptable,
            "acceptable_iter": 5,
            "max_iter": self.max_iterations,
            "print_level": self.print_level,
            "sb": "yes",
        }
        if self.warm:
            ipopt |= {"mu_init": 1e-2, "bound_push": 1e-6, "bound_frac": 1e-6}
        return {"print_time": False, "calc_lam_p": False, "ipopt": ipopt}


class Stop(ca.Callback):
    """Asked by IPOPT after every iteration whether to stop."""

    def __init__(self, variables: int, rows: int) -> None:
        ca.Callback.__init__(self)
        self.sizes = {"x": variables, "f": 1, "g": rows, "lam_x": variables, "lam_g": rows, "lam_p": 0}
        self.interrupted = False
        self.deadline = np.inf
        self.construct("stop", {})

    def get_n_in(self) -> int:  # noqa: D102 (CasADi's own interface, as the next three)
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:  # noqa: D102
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:  # noqa: D102
        return ca.Sparsity.dense(self.sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[float]:  # noqa: D102
        return [float(self.interrupted or time.perf_counter() > self.deadline)]


class Descent:
    """A program compiled for IPOPT; reusable for any number of starts.

    Args:
        program: what is minimised.
        solver: with which settings.
    """

    def __init__(self, program: Program, solver: IPOPT) -> None:
        self.program = program
        self.stop = Stop(program.x.shape[0], program.g.shape[0])
        nlp = {"x": program.x, "f": program.f, "g": program.g}
        self._solve = ca.nlpsol("ipopt", "ipopt", nlp, {**solver.options(), "iteration_callback": self.stop})

    def __call__(self, start: FloatArray, margin: float | None = None) -> Solution:
        """Descend from a start (n,), with the rows' bounds at a margin of the program's own kind."""
        began = time.perf_counter()
        lower, upper = self.program.bounds_near(start)
        row_lower, row_upper = self.program.row_bounds(margin)
        found = self._solve(x0=start, lbx=lower, ubx=upper, lbg=row_lower, ubg=row_upper)
        stats = self._solve.stats()
        x, g, lam_x, lam_g = (np.asarray(found[key]).ravel() for key in ("x", "g", "lam_x", "lam_g"))
        status = str(stats["return_status"])
        residuals = {
            "stationarity": self._stationarity(x, lam_x, lam_g),
            "violation": max(_violation(x, lower, upper), _violation(g, row_lower, row_upper)),
            "complementarity": max(_slackness(x, lower, upper, lam_x), _slackness(g, row_lower, row_upper, lam_g)),
        }
        return Solution(
            x,
            float(found["f"]),
            status,
            REASONS.get(status, StopReason.FAILED),
            int(stats["iter_count"]),
            int(stats["n_call_nlp_f"]),
            time.perf_counter() - began,
            lam_g,
            lam_x,
            residuals,
        )

    def _stationarity(self, x: FloatArray, lam_x: FloatArray, lam_g: FloatArray) -> float:
        _, _, gradient, _ = self._solve.get_function("nlp_grad")(x, [], 1.0, lam_g)
        return float(np.abs(np.asarray(gradient).ravel() + lam_x).max())


def descend(
    solve: Callable[[FloatArray], Solution],
    stop: Stop,
    starts: Iterable[FloatArray],
    price: Callable[[Solution], float],
    budget: Budget,
    seed: int | None = None,
    callback: Callable[[Status], object] | None = None,
) -> DescentResult:
    """Descend from one start after the other and keep the best.

    Args:
        solve: from a start (n,) to a solution: a :class:`Descent`, or something that makes more of one.
        stop: of the descent.
        starts: each (n,).
        price: what a solution is really worth, lower is better; finite.
        budget: how long; its iterations are starts, its evaluations those of the objective.
        seed: from which the starts were drawn, for the record.
        callback: gets the status after every start.

    Returns:
        The best by price. After Ctrl-C too, with ``StopReason.INTERRUPTED``.
    """
    began = time.perf_counter()
    if budget.seconds is not None:
        stop.deadline = began + budget.seconds
    best: tuple[float, Solution] | None = None
    records: list[tuple[int, float, FloatArray]] = []
    evaluations, improved, reason = 0, 0, StopReason.EXHAUSTED
    with deferred_interrupt(stop):
        for number, start in enumerate(starts, start=1):
            found = solve(start)
            evaluations += found.evaluations
            cost = price(found)
            if best is None or cost < best[0]:
                best, improved = (cost, found), number
            records.append((evaluations, best[0], best[1].x))
            status = Status(evaluations, number, time.perf_counter() - began, best[0], 0.0)
            progress = _progress(budget, status)
            if callback is not None:
                callback(replace(status, progress=progress))
            spent = _spent(budget, status, stop.interrupted, number - improved)
            if spent is not None:
                reason = spent
                break
    if best is None:
        raise ValueError("there was no start to descend from")
    return DescentResult(
        x=best[1].x,
        cost=best[0],
        evaluations=evaluations,
        iterations=len(records),
        seconds=time.perf_counter() - began,
        seed=seed,
        stop_reason=reason,
        history=History(*(np.array(column) for column in zip(*records, strict=True))),
        solution=best[1],
    )


def _progress(budget: Budget, status: Status) -> float:
    """Share of the budget used."""
    used = (
        (status.evaluations, budget.evaluations),
        (status.iterations, budget.iterations),
        (status.seconds, budget.seconds),
    )
    return min(1.0, max(amount / limit for amount, limit in used if limit is not None))


def _spent(budget: Budget, status: Status, interrupted: bool, unimproved: int) -> StopReason | None:
    """Which limit is reached."""
    reached = (
        (StopReason.INTERRUPTED, interrupted or None, True),
        (StopReason.TARGET, budget.target, budget.target is not None and status.cost <= budget.target),
        (StopReason.EVALUATIONS, budget.evaluations, status.evaluations >= (budget.evaluations or 0)),
        (StopReason.ITERATIONS, budget.iterations, status.iterations >= (budget.iterations or 0)),
        (StopReason.SECONDS, budget.seconds, status.seconds >= (budget.seconds or 0.0)),
        (StopReason.STAGNATION, budget.stagnation, unimproved >= (budget.stagnation or 0)),
    )
    return next((reason for reason, limit, met in reached if limit is not None and met), None)


def _violation(values: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    return float(max(0.0, np.max(lower - values, initial=0.0), np.max(values - upper, initial=0.0)))


def _slackness(values: FloatArray, lower: FloatArray, upper: FloatArray, multipliers: FloatArray) -> float:
    """Largest product of a multiplier and the distance to the bound that it stands for."""
    gap = np.where(multipliers > 0.0, upper - values, values - lower)
    held = (multipliers != 0.0) & np.isfinite(gap)
    return float(np.max(np.abs(multipliers[held] * gap[held]), initial=0.0))

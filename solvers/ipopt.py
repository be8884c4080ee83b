"""Descent on smooth programs: IPOPT, from one start or many.

Wächter and Biegler, "On the Implementation of an Interior-Point Filter Line-Search Algorithm for Large-Scale
Nonlinear Programming", 2006; called through CasADi, which supplies exact first and second derivatives.

It does not draw candidates from a box and is no :class:`solvers.solver.Solver`: it descends from a start, on a
program whose derivatives are known. :func:`solvers.ipopt.descend` is its driver.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal, Protocol

import casadi as ca
import numpy as np

from solvers.budget import Budget, Interruption, StopReason, Usage, deferred_interrupt
from solvers.driver import History, Result, Status, keep_best
from solvers.solver import STARTS, FloatArray, SolverTraits, Steps, require

STOP_REASONS = {
    "Solve_Succeeded": StopReason.CONVERGED,
    "Solved_To_Acceptable_Level": StopReason.CONVERGED,
    "Maximum_Iterations_Exceeded": StopReason.ITERATIONS,
    "Maximum_WallTime_Exceeded": StopReason.SECONDS,
    "Maximum_CpuTime_Exceeded": StopReason.SECONDS,
    "User_Requested_Stop": StopReason.INTERRUPTED,
}  # every other status is StopReason.FAILED


class Program(Protocol):
    """A smooth nonlinear program: minimise f(x), subject to bounds of x and of the rows g(x)."""

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


@dataclass(frozen=True, kw_only=True)
class Solution:
    """The end of one descent, with its multipliers.

    Attributes:
        x: the variables, (n,).
        objective: f(x).
        status: IPOPT's return status.
        stop_reason: the status, as the reason of ours that it corresponds to.
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

    def after(self, earlier: Solution) -> Solution:
        """The solution with the effort of the earlier one that it was started from added to its own."""
        return replace(
            self,
            iterations=earlier.iterations + self.iterations,
            evaluations=earlier.evaluations + self.evaluations,
            seconds=earlier.seconds + self.seconds,
        )


@dataclass(frozen=True)
class IPOPT(SolverTraits):
    """The settings of IPOPT.

    Raises:
        ValueError: a setting outside the range stated beside it.
    """

    default_budget: ClassVar[Budget] = Budget(iterations=20)
    has_population: ClassVar[bool] = False
    solves_program: ClassVar[Literal[True]] = True
    steps: ClassVar[Steps] = STARTS

    tolerance: float = 1e-6  # > 0, of the scaled KKT residual
    acceptable: float = 1e-5  # > 0, a residual that is accepted when five iterations do not improve it
    max_iterations: int = 300  # >= 1, of one descent
    warm: bool = True  # starts lie near a solution: a small barrier, and a start that is hardly moved off its bounds
    print_level: int = 0  # 0 to 12, how much IPOPT itself prints

    def __post_init__(self) -> None:
        require(self.tolerance > 0.0 and self.acceptable > 0.0, "tolerances are positive")
        require(self.max_iterations >= 1, f"max_iterations = {self.max_iterations} is less than 1")
        require(0 <= self.print_level <= 12, f"print_level = {self.print_level} is not in 0..12")

    def options(self) -> dict[str, Any]:
        """The options as CasADi takes them."""
        ipopt = {
            "tol": self.tolerance,
            "acceptable_tol": self.acceptable,
            "acceptable_iter": 5,
            "max_iter": self.max_iterations,
            "print_level": self.print_level,
            "sb": "yes",
        }
        if self.warm:
            ipopt |= {"mu_init": 1e-4, "bound_push": 1e-6, "bound_frac": 1e-6}
        return {"print_time": False, "calc_lam_p": False, "ipopt": ipopt}


class Stop(ca.Callback):
    """IPOPT's iteration callback: stops it when the user interrupts or time is up.

    Attributes:
        interruption: says whether to stop; set by the driver.
        deadline: of ``time.perf_counter``, s.
    """

    def __init__(self, variables: int, rows: int) -> None:
        ca.Callback.__init__(self)
        self.sizes = {"x": variables, "f": 1, "g": rows, "lam_x": variables, "lam_g": rows, "lam_p": 0}
        self.interruption = Interruption()
        self.deadline = np.inf
        self.construct("stop", {})

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        return ca.Sparsity.dense(self.sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arg: Sequence[ca.DM]) -> list[float]:
        return [float(self.interruption.requested or time.perf_counter() > self.deadline)]


class Descent:
    """A program compiled for IPOPT; reusable for any number of starts.

    Args:
        program: to be minimised.
        solver: the settings.
    """

    def __init__(self, program: Program, solver: IPOPT) -> None:
        self.program = program
        self.stop = Stop(program.x.shape[0], program.g.shape[0])
        nlp = {"x": program.x, "f": program.f, "g": program.g}
        options = {**solver.options(), "iteration_callback": self.stop}
        hessian = getattr(program, "hessian", None)  # a program may have a faster one than CasADi derives
        if hessian is not None:
            options["hess_lag"] = hessian
        self._solve = ca.nlpsol("ipopt", "ipopt", nlp, options)

    def __call__(self, start: FloatArray, margin: float | None = None) -> Solution:
        """Descend from a start (n,); ``margin`` is passed on to the program's ``row_bounds``."""
        start_time = time.perf_counter()
        lower, upper = self.program.bounds_near(start)
        row_lower, row_upper = self.program.row_bounds(margin)
        solution = self._solve(x0=start, lbx=lower, ubx=upper, lbg=row_lower, ubg=row_upper)
        stats = self._solve.stats()
        x, g, lam_x, lam_g = (np.asarray(solution[key]).ravel() for key in ("x", "g", "lam_x", "lam_g"))
        status = str(stats["return_status"])
        residuals = {
            "stationarity": self._stationarity(x, lam_x, lam_g),
            "violation": max(_violation(x, lower, upper), _violation(g, row_lower, row_upper)),
            "complementarity": max(_slackness(x, lower, upper, lam_x), _slackness(g, row_lower, row_upper, lam_g)),
        }
        return Solution(
            x=x,
            objective=float(solution["f"]),
            status=status,
            stop_reason=STOP_REASONS.get(status, StopReason.FAILED),
            iterations=int(stats["iter_count"]),
            evaluations=int(stats["n_call_nlp_f"]),
            seconds=time.perf_counter() - start_time,
            row_multipliers=lam_g,
            bound_multipliers=lam_x,
            residuals=residuals,
        )

    def _stationarity(self, x: FloatArray, lam_x: FloatArray, lam_g: FloatArray) -> float:
        _, _, gradient, _ = self._solve.get_function("nlp_grad")(x, [], 1.0, lam_g)
        return float(np.abs(np.asarray(gradient).ravel() + lam_x).max())


def _violation(values: FloatArray, lower: FloatArray, upper: FloatArray) -> float:
    return float(max(0.0, np.max(lower - values, initial=0.0), np.max(values - upper, initial=0.0)))


def _slackness(values: FloatArray, lower: FloatArray, upper: FloatArray, multipliers: FloatArray) -> float:
    """The largest product of a multiplier and the distance to its bound."""
    gap = np.where(multipliers > 0.0, upper - values, values - lower)
    active = (multipliers != 0.0) & np.isfinite(gap)
    return float(np.max(np.abs(multipliers[active] * gap[active]), initial=0.0))


@dataclass(frozen=True, kw_only=True, repr=False)
class DescentResult(Result):
    """The result of many descents.

    ``x`` holds the program's variables, ``iterations`` counts the starts, ``history`` has the best after each start.

    Attributes:
        solution: the best descent, and how it ended.
    """

    in_program_variables: ClassVar[bool] = True

    solution: Solution


def descend(
    solve: Callable[[FloatArray], Solution],
    stop: Stop,
    starts: Iterable[FloatArray],
    merit: Callable[[Solution], float],
    budget: Budget,
    seed: int | None = None,
    callback: Callable[[Status], object] | None = None,
) -> DescentResult:
    """Descend from one start after the other and keep the best.

    Args:
        solve: from a start (n,) to a solution: a :class:`Descent`, or a function that improves what it returns.
        stop: of the descent.
        starts: each (n,).
        merit: by which solutions are compared, lower is better. One that is not finite counts as worst.
        budget: how long; its iterations are starts, its evaluations those of the objective. At least one start is done.
        seed: from which the starts were drawn, for the record.
        callback: gets the status after every start.

    Returns:
        The best by merit. After Ctrl-C too, with ``StopReason.INTERRUPTED``.

    Raises:
        ValueError: there is no start.
        BaseException: whatever descents and callback raise, with the result until then as its attribute
            ``best_so_far`` where there is one.
    """
    if budget.seconds is not None:
        stop.deadline = time.perf_counter() + budget.seconds
    run = _Descents(merit, budget, seed)
    with deferred_interrupt() as interruption:
        stop.interruption = interruption
        try:
            for start in starts:
                run.add(solve(start))
                usage = run.usage(interruption.requested)
                if callback is not None:
                    callback(Status.of(usage, budget, STARTS))
                reached = budget.reached(usage)
                if reached is not None:
                    run.stop_reason = reached
                    break
        except BaseException as error:
            run.stop_reason = StopReason.ERROR
            if run.best is not None:
                keep_best(error, run.result())
            raise
    return run.result()


class _Descents:
    """The descents so far, and the best of them.

    Args:
        merit: of solutions; one that is not finite, or of a solution that is not, counts as worst.
        budget: how long.
        seed: for the record.
    """

    def __init__(self, merit: Callable[[Solution], float], budget: Budget, seed: int | None) -> None:
        self.best: Solution | None = None
        self.stop_reason = StopReason.EXHAUSTED
        self._merit, self._budget, self._seed = merit, budget, seed
        self._start_time = time.perf_counter()
        self._cost, self._evaluations, self._last_improvement = np.inf, 0, 0
        self._records: list[tuple[int, float, FloatArray]] = []

    def add(self, solution: Solution) -> None:
        """Add the end of the next descent."""
        self._evaluations += solution.evaluations
        value = self._merit(solution) if np.isfinite(solution.x).all() else np.inf
        value = value if np.isfinite(value) else np.inf
        if self.best is None or value < self._cost:
            self.best, self._cost, self._last_improvement = solution, value, len(self._records) + 1
        self._records.append((self._evaluations, self._cost, self.best.x))

    def usage(self, interrupted: bool) -> Usage:
        """The effort so far."""
        return Usage(
            evaluations=self._evaluations,
            requested=self._evaluations + 1,  # another start needs one at least
            iterations=len(self._records),
            seconds=time.perf_counter() - self._start_time,
            cost=self._cost,
            unimproved=len(self._records) - self._last_improvement,
            interrupted=interrupted,
        )

    def result(self) -> DescentResult:
        """The best of them.

        Raises:
            ValueError: there was none.
        """
        if self.best is None:
            raise ValueError("there was no start to descend from")
        return DescentResult(
            x=self.best.x,
            cost=self._cost,
            evaluations=self._evaluations,
            iterations=len(self._records),
            seconds=time.perf_counter() - self._start_time,
            seed=self._seed,
            stop_reason=self.stop_reason,
            history=History.of(self._records, STARTS),
            solution=self.best,
        )

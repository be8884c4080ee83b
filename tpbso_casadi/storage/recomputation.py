"""What follows from the scenario and the motions of a stored result, computed again and compared path by path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from problems import Problem, Trajectory
from problems.assembly import Criteria
from problems.certify import WorstIs
from problems.motions import CONTINUOUS_ORDERS, SMOOTH_ORDERS, JointPath
from problems.tasks import RecordedMotion
from problems.timing import departure, least_durations
from solvers import StopReason
from tpbso_casadi.plain import CORE, plain, versions
from tpbso_casadi.planning import (
    AS_FAST,
    CANDIDATES,
    POLISHED,
    RESTARTS,
    SAME_PATH,
    JudgedMotion,
    Retiming,
    has_descents,
    may_start_again,
    motion_of,
)
from tpbso_casadi.storage.result import RunResult, of_motion, of_timing
from tpbso_casadi.storage.tables import (
    ConstraintResult,
    PiecesResult,
    PolishedMotion,
    SolverResult,
    TimedMotion,
    quantities_of,
)

ROUNDING = 1e-9  # relative
JOINED = 1e-9  # relative: jumps up to this are rounding of a stored motion
TIMED_AGAIN = 1e-6  # relative: of a timing, which another machine does not compute to the last digits
OTHER_PROOF = 0.6  # of a clearance beyond what is kept: two proven bounds of it differ by no more
PATH_TOLERANCE = 1e-9  # rad, for angles up to 1 rad, and of larger ones
MOST_COEFFICIENTS = 50  # of a piece: a path of degree 5 timed twice has 21
LONGEST_VALUE = 200  # characters of a value in a message


class Contradiction(ValueError):
    """A stored value that contradicts its recomputation; the message is one line: ``key.path: reason``."""


class Tolerance(NamedTuple):
    """How far a stored number may be from the computed one.

    Attributes:
        relative: to the size of the computed number.
        least: which that size counts as at least, in its unit.
        beside: another number of the same table whose size counts if it is larger.
    """

    relative: float = ROUNDING
    least: float = 0.0
    beside: str = ""


TOLERANCES = {
    "objective.value": Tolerance(),
    "objective.parts.*.value": Tolerance(),
    "constraints.*.worst": Tolerance(least=ROUNDING, beside="bound"),
    "constraints.*.bound": Tolerance(),
    "stages.*.start": Tolerance(),
    "stages.*.end": Tolerance(),
    "stages.*.constraints.*.worst": Tolerance(least=ROUNDING, beside="bound"),
    "stages.*.constraints.*.bound": Tolerance(),
    "closest_approach.distance": Tolerance(1e-6, 1.0),  # a smallest distance is searched for
    "closest_approach.time": Tolerance(1e-3, 1.0),
    "at_goal.clear_until": Tolerance(1e-3, 1.0),
    "cost": Tolerance(),
    "solution.time_scale": Tolerance(),
    "solution.quantities": Tolerance(least=1.0),
    "solution.breakpoints": Tolerance(),
    "solution.coefficients": Tolerance(least=1.0),
    "polish.*.objective": Tolerance(),
    "polish.*.worst_violation": Tolerance(least=1.0),
    "retiming.*.objective": Tolerance(),
    "retiming.*.worst_violation": Tolerance(least=1.0),
    "retiming.*.duration": Tolerance(),
    "retiming.motion.breakpoints": Tolerance(),
    "retiming.motion.coefficients": Tolerance(least=1.0),
}  # by path, of all numbers below it; anything else has to be the same
TIMED_AGAIN_SEARCHED = {"solution.time_scale": Tolerance(TIMED_AGAIN)}
TIMED_AGAIN_POLISHED = {
    "polish.before.objective": Tolerance(TIMED_AGAIN),
    "polish.before.worst_violation": Tolerance(TIMED_AGAIN, 1.0),
}


def compare(
    stored: Any,
    computed: Any,
    tolerances: Mapping[str, Tolerance] = TOLERANCES,
    path: tuple[str, ...] = (),
    table: Mapping[str, Any] | None = None,
) -> None:
    """Compare two trees of plain data; entries of lists go by their names where they have any.

    Args:
        stored: one of them.
        computed: the other.
        tolerances: of numbers, by path.
        path: at which both are.
        table: of computed values that they are in.

    Raises:
        Contradiction: naming the first path at which they differ.
    """
    if stored == computed:
        return
    branches: Iterator[tuple[str, Any, Any]]
    if isinstance(stored, dict) and isinstance(computed, dict):
        for key in [*computed, *stored]:
            if key not in stored:
                raise Contradiction(f"{_joined(*path, key)}: missing key")
            if key not in computed:
                raise Contradiction(f"{_joined(*path, key)}: {_shown(stored[key])} is stored, nothing is computed")
        branches = ((key, stored[key], value) for key, value in computed.items())
    elif isinstance(stored, list) and isinstance(computed, list) and _names(stored) == _names(computed):
        branches = zip(_names(computed), stored, computed, strict=True)
    elif _near(stored, computed, _tolerance_at(path, tolerances), table or {}):
        return
    else:
        raise Contradiction(f"{_joined(*path)}: {_shown(stored)} is stored, {_shown(computed)} is computed")
    for name, one, other in branches:
        compare(one, other, tolerances, (*path, name), computed if isinstance(computed, dict) else None)


def _names(entries: list[Any]) -> list[str]:
    return [str(each.get("name", n)) if isinstance(each, dict) else str(n) for n, each in enumerate(entries)]


def _tolerance_at(path: tuple[str, ...], tolerances: Mapping[str, Tolerance]) -> Tolerance | None:
    """The tolerance of the pattern that fits with the fewest wildcards; None where none does."""

    def fits(pattern: str) -> bool:
        keys = pattern.split(".")
        return len(keys) <= len(path) and all(key in ("*", own) for key, own in zip(keys, path, strict=False))

    fitting = sorted(filter(fits, tolerances), key=lambda pattern: pattern.count("*"))
    return tolerances[fitting[0]] if fitting else None


def _near(stored: Any, computed: Any, tolerance: Tolerance | None, table: Mapping[str, Any]) -> bool:
    if tolerance is None or not isinstance(stored, float) or not isinstance(computed, float):
        return False
    size = max(abs(computed), tolerance.least, abs(table.get(tolerance.beside) or 0.0))
    return bool(np.isfinite(computed) and abs(stored - computed) <= tolerance.relative * size)


def _joined(*path: str) -> str:
    return ".".join(key[:LONGEST_VALUE] for key in path)


def _shown(value: Any) -> str:
    """A value in a message; of tables in a list their names."""
    tables = isinstance(value, list) and any(isinstance(each, dict) for each in value)
    text = repr(_names(value) if tables else value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."


def check_result(result: RunResult, problem: Problem[Any] | None, found: JudgedMotion, motion: JudgedMotion) -> None:
    """Make sure that a result says what follows from its scenario, its search vector and its motions.

    Args:
        result: to be checked.
        problem: that was searched; None where a given path was timed.
        found: the motion that search and polish led to.
        motion: the plan; the same unless it was timed anew.

    Raises:
        Contradiction: naming the first key that does not.
    """
    keys, tolerances = of_motion(motion), TOLERANCES
    if result.versions.get(CORE) != versions()[CORE]:
        keys["constraints"] = _proven_otherwise(result, keys["constraints"])
    names = (name for name in ("python", *versions()) if name != CORE or name in result.versions)
    keys["versions"] = {name: result.versions.get(name, "") for name in names}
    if problem is None:
        nothing: dict[str, Any] = {"variables": None, "branches": None, "time_scale": 1.0}
        if not result.scenario.task.has_solver:
            nothing["quantities"] = {}
        solution = result.solution.replaced(**nothing)
        keys |= of_timing(result.seconds) | {"retiming": None, "solution": solution}
    else:
        for reason in (*impossible(result, problem), *_unsearched(result, motion)):
            raise Contradiction(reason)
        vector = result.solution.vector
        searched = None if vector is None else motion_of(problem, vector)
        keys |= _of_search(result, problem, searched, found, motion)
        for reason in unlike(result, problem, searched, found, motion):
            raise Contradiction(reason)
        if problem.criteria.free_timing:
            tolerances = TOLERANCES | (TIMED_AGAIN_POLISHED if _is_polished(result) else TIMED_AGAIN_SEARCHED)
    computed = result.replaced(**keys)  # what does not follow, such as seconds, is left as it is stored
    trees = (each.table() for each in (result, computed))
    stored, follows = ({key: tree[key] for key in keys if key in tree} for tree in trees)  # in the order of the keys
    compare(stored, follows, tolerances)


def _proven_otherwise(result: RunResult, rows: Sequence[ConstraintResult]) -> list[ConstraintResult]:
    """The rows, where bounds were proven by other code, which comes near at other times: about the same is believed."""
    stated = {row.name: row for row in result.constraints}

    def believed(row: ConstraintResult) -> ConstraintResult:
        other = stated.get(row.name, row)
        if None in (row.worst, row.bound, other.worst) or row.worst_is is WorstIs.EXACT:
            return row
        bound, own, stored = (np.nan if number is None else number for number in (row.bound, row.worst, other.worst))
        size = max(abs(own - bound), abs(stored - bound))
        if other.satisfied != row.satisfied or not abs(stored - own) <= OTHER_PROOF * size:
            return row
        return row.replaced(worst=other.worst, where=other.where)

    return [believed(row) for row in rows]


def _of_search(
    result: RunResult, problem: Problem[Any], searched: JudgedMotion | None, found: JudgedMotion, motion: JudgedMotion
) -> dict[str, Any]:
    """The keys of a search, its polish and its last stage that follow from their motions.

    Args:
        result: whose keys they are.
        problem: that was searched.
        searched: the motion of the search vector; None where there is none.
        found: as in :func:`check_result`.
        motion: likewise.
    """
    polish, retiming, vector = result.polish, result.retiming, result.solution.vector
    keys: dict[str, Any] = {"solver": SolverResult.of(result.scenario), "seed": result.scenario.solver.seed}
    of_solution: dict[str, Any] = {}
    of_polish: dict[str, Any] = {}
    of_retiming: dict[str, Any] = {}
    if vector is not None:
        keys["cost"] = plain(float(problem.cost(vector[None])[0]))
    if searched is not None and not _is_polished(result):
        of_solution |= {"time_scale": searched.time_scale, "quantities": quantities_of(searched)}
        pieces = PiecesResult.of(searched.trajectory)
        if not problem.criteria.free_timing and found is motion:
            of_solution |= pieces.values()
        elif not problem.criteria.free_timing:
            of_retiming["motion"] = pieces
    if polish is not None:
        before, after = polish.before.objective, polish.after.objective
        better = before is None or (after is not None and after < before)
        of_polish["accepted"] = polish.after.feasible and (better or not polish.before.feasible)
        of_polish["after" if polish.accepted else "before"] = PolishedMotion.like(found)
        if polish.accepted and searched is not None:
            of_polish["before"] = PolishedMotion.like(searched)
        keys["polish"] = polish.replaced(**of_polish)
    if retiming is not None:
        of_retiming["before"] = TimedMotion.of(found)
        if retiming.accepted:
            accepted = Retiming(found, motion, retiming.candidate, retiming.seconds).accepted
            of_retiming |= {"after": TimedMotion.of(motion), "accepted": accepted}
        keys["retiming"] = retiming.replaced(**of_retiming)
    return keys | {"solution": result.solution.replaced(**of_solution)}


def _is_polished(result: RunResult) -> bool:
    return result.polish is not None and result.polish.accepted


def impossible(result: RunResult, problem: Problem[Any]) -> Iterator[str]:
    """Contradictions that no search leaves in its result, whatever its motions are: ``key: reason``."""
    if result.solver is None:
        yield "solver: a table is needed"
    if result.stop_reason is None:
        yield "stop_reason: missing"
    yield from _of_history(result)
    yield from _of_polish(result, problem)
    yield from _of_retiming(result)
    stored = [(variable.name, variable.unit) for variable in result.solution.variables or ()]
    variables = [(variable.name, variable.unit) for variable in problem.variables]
    if result.solution.variables is not None and len(stored) != len(variables):
        yield f"solution.variables: {len(stored)} are stored, {len(variables)} are searched"
    elif result.solution.variables is not None and stored != variables:
        number, one, other = next((k, a, b) for k, (a, b) in enumerate(zip(stored, variables, strict=True)) if a != b)
        yield f"solution.variables.{number}: {_shown(one)} is stored, {_shown(other)} is computed"


def _of_history(result: RunResult) -> Iterator[str]:
    """Faults of a history: unequal lengths, evaluations that do not grow, costs that do not fall to the result's."""
    history = result.history
    if not history.evaluations or len(history.evaluations) != len(history.cost):
        yield "history: as many costs as evaluations are needed, and one at least"
    cost = [np.inf if value is None else value for value in history.cost]
    if any(later <= earlier for earlier, later in pairwise(history.evaluations)):
        yield "history.evaluations: do not grow"
    if any(later > earlier for earlier, later in pairwise(cost)):
        yield "history.cost: the best so far grows"
    for key, last in (("evaluations", history.evaluations[-1]), ("cost", history.cost[-1])):
        if getattr(result, key) != last:
            yield f"{key}: {getattr(result, key)!r} is stored, {last!r} is the last of the history"
    if not len(cost) - 2 <= result.iterations <= len(cost):  # the last may have been cut short
        yield f"iterations: {result.iterations} with {len(cost)} entries of the history"


def _of_polish(result: RunResult, problem: Problem[Any]) -> Iterator[str]:
    """A polish where one is asked for and possible, and no other; more than one round only within a time."""
    solver, polish = result.scenario.solver, result.polish
    most = 1 + (RESTARTS if may_start_again(result.scenario, problem) else 0)
    if solver.within is None:
        if polish is not None and not solver.polish_starts:
            yield "polish: the scenario asks for none"
        expected = solver.polish_starts and has_descents(problem) and result.evaluations
        if polish is None and expected and not result.interrupted:
            yield "polish: missing key"
        if polish is not None and polish.starts > solver.polish_starts:
            yield f"polish.starts: {polish.starts} where the scenario asks for {solver.polish_starts}"
        if result.rounds > most and result.solution.branches is None:
            yield f"rounds: {'one is' if most == 1 else f'{most} are'} all that the scenario asks for"
    if _is_polished(result) and result.solution.time_scale != 1.0:
        yield f"solution.time_scale: {result.solution.time_scale!r} is stored, a polished motion has 1.0"


def _of_retiming(result: RunResult) -> Iterator[str]:
    """A last stage where the scenario asks for one, and no other."""
    retiming, asked = result.retiming, result.scenario.model.retime
    if retiming is None:
        if asked and not result.interrupted and result.evaluations:
            yield "retiming: missing key"
        return
    if not asked:
        yield "retiming: the scenario asks for none"
    if retiming.candidate not in {"", *CANDIDATES} or (retiming.after is None) != (retiming.candidate == ""):
        yield f"retiming.candidate: one of {', '.join(CANDIDATES)} is needed with a motion after"
    if retiming.accepted and retiming.after is None:
        yield "retiming.accepted: there is no motion"


def _unsearched(result: RunResult, motion: JudgedMotion) -> Iterator[str]:
    """Faults of a plan without a search: another solver, or a duration above the bound that it is said to reach."""
    if result.evaluations or result.solver is None or result.retiming is not None:
        return
    if not result.scenario.solver.is_direct:
        yield f"evaluations: {result.scenario.solver.name} needs some"
    ends, trajectory = motion.trajectory.breakpoints[[0, -1]], motion.trajectory
    bound = least_durations(np.subtract(*trajectory.at(ends)), motion.criteria.robot.limits).max()
    if result.stop_reason == StopReason.TARGET and not trajectory.duration <= AS_FAST * bound:
        longer = f"{trajectory.duration:.6g} s are more than the bound, {bound:.6g} s"
        yield f"stop_reason: {result.stop_reason}, though {longer}"
    if result.cost != motion.objective:
        yield f"cost: {result.cost!r} is stored, {motion.objective!r} is computed"


def unlike(
    result: RunResult, problem: Problem[Any], searched: JudgedMotion | None, found: JudgedMotion, motion: JudgedMotion
) -> Iterator[str]:
    """How motions do not belong together that are timed path by path: ``key: reason``; as in :func:`check_result`."""
    vector = result.solution.vector
    if vector is not None and searched is not None and problem.criteria.free_timing and not _is_polished(result):
        stored, computed = found.trajectory.duration, searched.trajectory.duration
        if not abs(stored - computed) <= TIMED_AGAIN * computed:
            yield f"solution.variables: a motion of {stored!r} s is stored, one of {computed!r} s is computed"
        yield from _departures("solution.variables", problem.path(vector), found.trajectory)
    if result.retiming is None or not result.retiming.accepted or result.retiming.candidate == POLISHED:
        return  # a polish may choose another posture at its goal
    if result.retiming.candidate == SAME_PATH:
        yield from _departures("solution.coefficients", found.path, motion.trajectory)
    else:
        ends, own = (m.trajectory.at(m.trajectory.breakpoints[[0, -1]]) for m in (found, motion))
        if not np.allclose(own, ends, rtol=ROUNDING, atol=ROUNDING):
            yield "solution.coefficients: the motion has not the ends of retiming.motion"


def _departures(key: str, path: JointPath, trajectory: Trajectory) -> Iterator[str]:
    """A reason where a motion leaves a path at any t, whatever its timing, or that it does not cannot be proven."""
    away = departure(path, trajectory)
    if not away <= PATH_TOLERANCE * max(1.0, float(np.abs(path.at(path.breakpoints)).max())):
        yield f"{key}: the motion leaves its path, by up to {away:.2g} rad"


def check_trajectory(key: str, motion: JudgedMotion, problem: Problem[Any] | None) -> None:
    """Pieces one after the other from t = 0, as smooth as they have to be, with the velocities of the task at the ends.

    Args:
        key: of the motion in the result, for messages.
        motion: that is stored.
        problem: that has been searched; its motions have a fixed number of pieces unless they are timed path by path.

    Raises:
        Contradiction: they are not.
    """
    trajectory, criteria = motion.trajectory, motion.criteria
    (order, pieces, joints), dof = trajectory.coefficients.shape, criteria.robot.dof
    if problem is None or criteria.free_timing:
        fits = order <= MOST_COEFFICIENTS and joints == dof
        needed = f"at most {MOST_COEFFICIENTS} coefficients of {dof} joints"
    else:
        lower, upper = problem.bounds
        shape = problem.trajectory((lower + upper) / 2.0).coefficients.shape
        fits = (order, pieces, joints) == shape
        needed = "{} coefficients of {} pieces and {} joints".format(*shape)
    if not fits or trajectory.breakpoints[0] != 0.0:
        raise Contradiction(f"{key}: {needed} from t = 0 are needed")
    if trajectory.breakpoints.size != pieces + 1 or not (np.diff(trajectory.breakpoints) > 0.0).all():
        raise Contradiction(f"{key}.breakpoints: increasing times are needed, one more than pieces")
    misfit = _misfit(criteria, trajectory)
    if misfit:
        raise Contradiction(f"{key}.coefficients: {misfit}")


def _misfit(criteria: Criteria, trajectory: Trajectory) -> str:
    """Why a motion cannot be one of these; empty where it can. Accelerations may jump where the timing is free."""
    task = criteria.task
    if isinstance(task, RecordedMotion):  # which may jump, and that is what it is judged for
        same = np.array_equal(trajectory.breakpoints, task.motion.breakpoints)
        same = same and np.array_equal(trajectory.coefficients, task.motion.coefficients)
        return "" if same else "not the task's motion"
    orders = CONTINUOUS_ORDERS if criteria.free_timing else SMOOTH_ORDERS
    jump = trajectory.largest_jump(task.end_velocities, orders, task.end_accelerations)
    if jump <= JOINED:
        return ""
    how = "at rest" if task.at_rest else "with the velocities and accelerations of the task"
    return f"the pieces do not join smoothly, or not {how} (by {jump:.2g})"

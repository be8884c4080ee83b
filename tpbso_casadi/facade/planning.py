"""``plan(...)``: a motion from a scenario, or from a robot and a task."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from problems import Obstacle
from problems.evaluation import EvaluationOptions
from tpbso_casadi.facade.own import AnyConstraint, AnyObjective
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.statement import AnySolverChoice, What, scenario_of
from tpbso_casadi.planning.plan import SILENT
from tpbso_casadi.planning.plan import plan as plan_scenario
from tpbso_casadi.planning.progress import Progress


def plan(
    what: What,
    *,
    start: Any = None,
    goal: Any = None,
    via: Any = None,
    path: Any = None,
    accuracy: float | None = None,
    obstacles: Iterable[Obstacle | dict[str, Any]] | None = None,
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None,
    objective: AnyObjective | None = None,
    solver: AnySolverChoice | None = None,
    evaluations: int | None = None,
    seed: int | None = None,
    polish: bool | None = None,
    within: float | None = None,
    warm_start: Plan | None = None,
    evaluation: EvaluationOptions | None = None,
    progress: Progress = SILENT,
    **keys: Any,
) -> Plan:
    """Plan a motion, and judge it for all t.

    Args:
        what: a scenario, the path of a scenario file (``.toml``), or the name of a built-in scenario; or a robot (see
            :func:`robot`), for which the other arguments state the task.
        start: where the robot is at t = 0: joint values (dof,) in rad, a point (2,) or (3,) of the tool in m, or a
            :class:`Joints`, :class:`Position` or :class:`Pose`.
        goal: where it is at t = T, likewise; or a list of places, any of which will do.
        via: places to pass in this order, at free times.
        path: points (n, 2) or (n, 3) for the tool to trace, m, in place of start and goal.
        accuracy: how far the tool may leave the path, m.
        obstacles: to keep clear of.
        constraints: of your own, to be kept at every time: :class:`Constraint`, or classes derived from ``Limit``.
        objective: ``time``, ``rotation``, ``length``, ``energy``, ``work``; a :class:`Cost` of your own; a table of
            weights or pairs of weights and objectives; or a plug-in.
        solver: name of a solver, or a solver with its settings; the best there is, polished, by default.
        evaluations: budget of the search.
        seed: same seed, same result; 1 by default.
        polish: whether IPOPT refines the best candidate.
        within: the best plan in so many seconds, s.
        warm_start: a plan of a similar task, with which the search begins.
        evaluation: how populations are evaluated; changes the time, not the result.
        progress: is told what begins, and the status after every iteration.
        keys: further keys of the scenario's tables [task], [model] and [solver], such as ``margin`` or ``motion``.

    Raises:
        ScenarioError: naming the first wrong key, and what is wrong with it.
        TypeError: a keyword that no table has.
    """
    scenario = scenario_of(
        what,
        solver,
        polish,
        start=start,
        goal=goal,
        via=via,
        path=path,
        accuracy=accuracy,
        obstacles=None if obstacles is None else list(obstacles),
        constraints=constraints,
        objective=objective,
        evaluations=evaluations,
        seed=seed,
        within=within,
        **keys,
    )
    before = None if warm_start is None else warm_start.planned
    return Plan(plan_scenario(scenario, progress, evaluation, warm_start=before))

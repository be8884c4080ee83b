"""``tp.plan``, ``tp.replan``, ``tp.read_run`` and ``tp.audit``."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, TypeAlias

from problems import Obstacle, Trajectory
from problems.base import shown_value
from problems.evaluation import EvaluationOptions
from solvers import best_so_far, keep_best
from tpbso_casadi.audit_report import audit_scenario
from tpbso_casadi.facade.arguments import AnySolverChoice, file_path, in_words_of_python
from tpbso_casadi.facade.audit import Audit, ScenarioAudit
from tpbso_casadi.facade.frames import Frame
from tpbso_casadi.facade.own import AnyConstraint, AnyObjective
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.statement import HasScenario, What, check_plannable, given_scenario, scenario_of
from tpbso_casadi.planning import SILENT, EarlierMotion, PlannedMotion, Progress
from tpbso_casadi.planning import plan as plan_scenario
from tpbso_casadi.replanning import Step
from tpbso_casadi.replanning import replan as replan_motion
from tpbso_casadi.scenario import TITLES, Scenario, is_folder, plugin_failures_named
from tpbso_casadi.storage import read_earlier
from tpbso_casadi.storage import read_run as read_stored_run


def plan(
    what: What | HasScenario,
    *,
    start: Any = None,
    goal: Any = None,
    via: Any = None,
    path: Any = None,
    accuracy: float | None = None,
    obstacles: Iterable[Obstacle | dict[str, Any]] | str | Path | None = None,
    carried: Iterable[Obstacle | dict[str, Any]] | None = None,
    may_touch: Iterable[tuple[str, str]] | None = None,
    frames: Iterable[Frame | dict[str, Any]] | None = None,
    constraints: AnyConstraint | Iterable[AnyConstraint] | None = None,
    objective: AnyObjective | None = None,
    solver: AnySolverChoice | None = None,
    evaluations: int | None = None,
    seed: int | None = None,
    polish: bool | int | None = None,
    within: float | None = None,
    first: bool | None = None,
    warm_start: Plan | str | Path | None = None,
    evaluation: EvaluationOptions | None = None,
    progress: Progress = SILENT,
    **keys: Any,
) -> Plan:
    """Plan a motion, and judge it for all t.

    Args:
        what: a scenario, or what has one, as a plan; the path of a scenario file (``.toml``), or the name of a built-in
            scenario; a task as an object, such as :class:`PointToPoint` or :class:`Move`; or a robot (see
            :func:`robot`), for which the other arguments state the task.
        start: where the robot is at t = 0: joint values (dof,) in rad; a point (2,) or (3,) of the tool in m, which two
            numbers for a planar arm of two links are too; a :class:`Joints`, :class:`Position` or :class:`Pose`; or the
            tool's frame, a homogeneous matrix (4, 4).
        goal: where it is at t = T, likewise; or a list of places, any of which will do.
        via: places to pass in this order, at free times.
        path: points (n, 2) or (n, 3) for the tool to trace, m, in place of start and goal; poses (n, 7), the quaternion
            as x, y, z, w, with ``angular_accuracy``; a :class:`Path`; or a CSV file of points.
        accuracy: how far the tool may leave the path, m.
        obstacles: to keep clear of, such as :class:`Box` or :class:`Sphere`, or tables of a scenario; an empty list for
            none; or the path of a MoveIt scene file (``.scene``).
        carried: what the tool holds, in its frame: shapes as of obstacles, or their tables with a ``mass`` in kg.
        may_touch: pairs of names of links, of what is carried and of obstacles, whose contact is allowed.
        frames: in which places and obstacles of this call, and the robot's base, may be stated, each by its name; of
            the file of a scenario they take the place of its own of these names.
        constraints: of your own, to be kept at every time: :class:`Constraint`, or classes derived from ``Limit``.
        objective: ``time``, ``rotation``, ``length``, ``energy``, ``work``; a :class:`Cost` of your own; a table of
            weights or pairs of weights and objectives; or a class derived from ``Objective``.
        solver: name of a solver, its class, or a solver with its settings, your own too; the best there is, polished,
            by default.
        evaluations: budget of the search.
        seed: same seed, same result; 1 by default.
        polish: whether IPOPT refines the best candidate; or how many candidates it starts from.
        within: the best plan in so many seconds, s.
        first: whether the first certified plan is enough, where nothing is searched: in space, in least time.
        warm_start: a plan of a similar task or its run folder, with which the search begins. A sequence keeps the
            motions of stages that are stated as they were, and plans the others.
        evaluation: how populations are evaluated; changes the time, not the result.
        progress: is told what begins, and the status after every iteration.
        keys: further keys of the scenario's tables [task], [model] and [solver], such as ``margin`` or ``motion``.

    Raises:
        ScenarioError: naming the first wrong argument or key, what is wrong with it, and what to do.
        TypeError: a keyword that no table has; a plan or options that are none.
        BaseException: whatever a solver of your own or ``progress`` raises. Once there is a candidate, the exception's
            attribute ``best_so_far`` is the plan until then, as after Ctrl-C.
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
        obstacles=obstacles,
        carried=carried,
        may_touch=may_touch,
        frames=frames,
        constraints=constraints,
        objective=objective,
        evaluations=evaluations,
        seed=seed,
        within=within,
        first=first,
        **keys,
    )
    for name, value, kind in (("evaluation", evaluation, EvaluationOptions), ("progress", progress, Progress)):
        if value is not None and not isinstance(value, kind):
            raise TypeError(f"{name}: a tp.{kind.__name__} is needed, not {shown_value(value)}")
    before = _earlier(warm_start)
    with nullcontext() if given_scenario(what) is not None else in_words_of_python():
        try:
            return Plan(plan_scenario(scenario, progress, evaluation, warm_start=before))
        except BaseException as error:
            found = best_so_far(error, PlannedMotion)
            if found is not None:
                keep_best(error, Plan(found))
            raise


def _earlier(given: Plan | str | Path | None) -> PlannedMotion | EarlierMotion | None:
    """The plan with which another one begins."""
    if given is None or isinstance(given, Plan):
        return None if given is None else given.planned
    if not isinstance(given, str | Path):
        raise TypeError(f"warm_start: a tp.Plan or the folder of a run is needed, not {shown_value(given)}")
    return read_earlier(Path(given))


Executed: TypeAlias = Plan | PlannedMotion | Step | Trajectory


def replan(
    previous: Executed,
    at_time: float,
    scene: Scenario | HasScenario | str | Path | Iterable[Obstacle],
    within: float | None = None,
    *,
    every: float = 0.1,
    fail_safe_rate: float = 0.0,
) -> Step:
    """Plan again for an arm that has executed a plan up to some time and then sees another scene.

    Args:
        previous: a plan, a step, or a motion alone.
        at_time: up to which it has been executed, s on its own clock; the new clock starts then.
        scene: the obstacles as seen then, on clocks that start then; or a scenario that states them so, and maybe
            another goal: itself, its file, its name or a plan. For a motion alone a scenario is needed.
        within: s that the search may take; as many evaluations as usual where None.
        every: how long the decision may take, s: the motion goes on for as long.
        fail_safe_rate: how fast obstacles that move may leave their prediction, m/s, in any direction.

    Raises:
        InvalidProblem: the time is not within the motion, or motion, robot and obstacles do not fit together.
        ScenarioError: the scenario is of another robot, or no move to a goal at rest.
    """
    executed = previous.planned if isinstance(previous, Plan) else previous
    given = given_scenario(scene)
    obstacles: Any = scene
    seen = obstacles if given is None else given
    return replan_motion(executed, at_time, seen, within, every=every, fail_safe_rate=fail_safe_rate)


def audit(what: Plan | What | HasScenario) -> Audit:
    """Audit a plan, a run folder or a scenario.

    Args:
        what: a plan, or the path of a run folder: its certificate, its optimality, prices of its limits, as
            :meth:`Plan.audit`. Or anything else that :func:`plan` takes: the structure of the constraints of its search
            model and of its nonlinear program, before anything is searched.

    Raises:
        InvalidRun: the folder has been changed, or a number in it is not what a recomputation gives.
        ScenarioError: the task cannot be done.
    """
    if isinstance(what, Plan):
        return what.audit()
    if isinstance(what, str | Path) and what not in TITLES and is_folder(str(what)):
        return read_run(what).audit()
    check_plannable("what", what, "a plan, the folder of a run")
    scenario = scenario_of(what)
    with plugin_failures_named(scenario):
        return ScenarioAudit(audit_scenario(scenario))


def read_run(folder: str | Path) -> Plan:
    """The plan in a run folder, all of it computed again; of its search there is only the record, in its ``result``.

    Args:
        folder: that ``plan.save(folder)`` or ``tpbso solve`` wrote.

    Raises:
        TypeError: the folder is no path.
        InvalidRun: a file is missing or was changed, or a number is not what a recomputation gives.
    """
    return Plan(read_stored_run(file_path("folder", folder)))

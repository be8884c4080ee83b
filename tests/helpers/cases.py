"""Problems for tests: made with all options at once, changed; and the built-in cases of Section IV.

The values of the built-in cases are those of the scenarios of the same names.
"""

from __future__ import annotations

from dataclasses import fields, replace
from functools import cache
from typing import Any, TypeVar

from problems import (
    LIMITS,
    Ellipse,
    Path,
    PathFollowing,
    PathFollowingProblem,
    PlanarArm,
    PointToPoint,
    PointToPointProblem,
    Problem,
    closed_curve,
    path_following,
    pentagram,
    point_to_point,
)

P = TypeVar("P", PointToPointProblem, PathFollowingProblem)

REACH = 2.0
OVAL = Ellipse((0.8, 0.8), (0.15, 0.25))
THREE_METRES = PlanarArm((1.0, 1.0, 1.0), (100.0,) * 3, (3000.0,) * 3)
PATHS = {"pentagram": pentagram((0.0, 0.0), 0.9), "closed-curve": closed_curve((0.0, 0.0), 1.45, 0.0, 6, -0.35, 50)}
BUILTIN = (
    *(f"time-{k}" for k in range(2, 6)),
    *(f"rotation-{k}" for k in range(2, 6)),
    *(f"obstacle-{k}" for k in range(3, 6)),
    *(f"{shape}-{objective}" for shape in PATHS for objective in ("time", "rotation")),
)


def equal_links(k: int, **more: Any) -> PlanarArm:
    """An arm that reaches 2 m with k equal links."""
    return PlanarArm((REACH / k,) * k, (4.0,) * k, (20.0,) * k, **more)


def moving(
    robot: PlanarArm,
    start: tuple[float, float],
    goal: tuple[float, float],
    objective: Any = "time",
    elbow: Any = "free",
    formulation: str = "paper",
    *,
    samples: int = 50,
    limits: Any = (),
    **more: Any,
) -> PointToPointProblem:
    """A point-to-point problem; ``more`` belongs to the statement."""
    task = PointToPoint(robot, start, goal, elbow=elbow, **more)
    return point_to_point(task, objective, formulation, samples, limits)


def following(
    robot: PlanarArm,
    path: Path,
    accuracy: float,
    objective: Any = "time",
    elbow: Any = "free",
    formulation: str = "paper",
    *,
    samples: int = 50,
    redundancy_values: int = 5,
    limits: Any = (),
    **more: Any,
) -> PathFollowingProblem:
    """A path-following problem; ``more`` belongs to the statement."""
    task = PathFollowing(robot, path, accuracy, elbow=elbow, **more)
    return path_following(task, objective, formulation, samples, redundancy_values, limits)


def changed(problem: P, **changes: Any) -> P:
    """The problem made again, with other fields of its statement or other options."""
    stated = {field.name for field in fields(problem.criteria.task)}
    task = replace(problem.criteria.task, **{name: value for name, value in changes.items() if name in stated})
    options: dict[str, Any] = {
        "objective": problem.criteria.objective,
        "formulation": problem.encoding.name,
        "limits": tuple(type(limit) for limit in problem.criteria.limits if limit.name not in LIMITS),
    }
    make: Any
    if isinstance(problem, PointToPointProblem):
        make, options["samples"] = point_to_point, problem.motion.steps
    else:
        make = path_following
        options["samples"] = problem.motion.steps * (problem.motion.points - 1)
        options["redundancy_values"] = problem.encoding.redundancy_values
    unknown = set(changes) - stated - set(options)
    assert not unknown, unknown
    return make(task, **(options | {name: value for name, value in changes.items() if name not in stated}))


@cache
def builtin(name: str, formulation: str = "paper", elbow: str = "up") -> Problem[Any]:
    """A built-in case."""
    kind, detail = name.rsplit("-", 1)
    if kind in PATHS:
        return following(THREE_METRES, PATHS[kind], 0.1, detail, elbow, formulation)
    objective, obstacles = ("length", (OVAL,)) if kind == "obstacle" else (kind, ())
    robot = equal_links(int(detail))
    return moving(robot, (1.0, 0.0), (0.5, 1.5), objective, elbow, formulation, obstacles=obstacles)

"""Random scenarios for tuning, tests and comparisons of solvers; the same generator state gives the same scenario."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np

from problems import Problem, Trajectory
from problems.certify import exact_time_scale
from problems.families.two_segments import Quantities
from tpbso_casadi.scenario import Scenario, ScenarioError, parse_scenario

ACCURACY_FACTOR = 1.5  # accuracy limit of a path over what the motion it is built around reaches
PATH_SHARE = 0.25  # of paths among the scenarios
SAMPLED_OBJECTIVES = (
    "time",
    "rotation",
    "length",
)  # a fixed choice: more registered ones must not change what a seed gives
SAMPLED_FORMULATIONS = ("paper", "reduced")  # likewise


def random_scenarios(seed: int, count: int) -> list[Scenario]:
    """The first ``count`` scenarios of a seed; a larger count begins with the same ones."""
    return list(islice(_endless(np.random.default_rng(seed)), count))


def random_scenario(rng: np.random.Generator) -> Scenario:
    """The next scenario: three in four from point to point, among up to two obstacles; else along a path.

    Arms have 2 to 6 links of 0.2 to 1 m (3 or more on a path) and limits of their own for each joint.
    """
    return next(_endless(rng))


def _endless(rng: np.random.Generator) -> Iterator[Scenario]:
    while True:
        scenario = _random_path(rng) if rng.random() < PATH_SHARE else _random_point_to_point(rng)
        if scenario is not None:
            yield scenario


def _random_point_to_point(rng: np.random.Generator) -> Scenario | None:
    """Two postures, a motion between them, obstacles that it does not meet; None if that fails."""
    links = int(rng.integers(2, 7))
    arm = _arm(rng, links)
    theta_s = rng.uniform(-2.5, 2.5, links)
    theta_f = np.clip(theta_s + rng.uniform(-2.0, 2.0, links), -2.9, 2.9)
    ends = [_tip(arm["link_lengths"], theta).tolist() for theta in (theta_s, theta_f)]
    center = rng.uniform(-1.0, 1.0, (int(rng.integers(0, 3)), 2)) * sum(arm["link_lengths"])
    obstacles = [{"center": c.tolist(), "semi_axes": rng.uniform(0.05, 0.25, 2).tolist()} for c in center]
    task = {"kind": "point-to-point", "start": ends[0], "goal": ends[1], "objective": _objective(rng), "elbow": "free"}
    stated = _scenario(rng, arm, task, obstacles)
    if stated is None:
        return None
    scenario, problem = stated
    middle, at_rest = (theta_s + theta_f) / 2.0, np.zeros(links)
    first, via, speed, last = (ca.DM(angles).T for angles in (theta_s, middle, at_rest, theta_f))
    quantities = Quantities(first, via, speed, last, ca.DM(1.0), ca.DM(1.0))
    return scenario if _keeps_its_limits(problem, quantities.trajectory()) else None


def _random_path(rng: np.random.Generator) -> Scenario | None:
    """A closed curve within reach; the motion in the middle of its redundancy says how accurate one can ask to be."""
    arm = _arm(rng, int(rng.integers(3, 6)))
    reach = sum(arm["link_lengths"])
    shape: dict[str, Any] = {"shape": "pentagram", "radius": rng.uniform(0.15, 0.3) * reach}
    if rng.random() < 0.5:
        shape |= {"shape": "closed-curve", "waves": int(rng.integers(2, 6)), "depth": float(rng.uniform(0.05, 0.3))}
    direction, distance = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 0.5) * reach
    center = [float(distance * np.cos(direction)), float(distance * np.sin(direction))]
    task = {"kind": "path", "objective": _objective(rng), "elbow": "up", "center": center, "accuracy": reach, **shape}
    stated = _scenario(rng, arm, task, [])
    if stated is None:
        return None
    scenario, problem = stated
    x = np.full(len(problem.variables), 0.5)
    trajectory = problem.trajectory(x)
    trajectory = trajectory.time_scaled(max(1.0, exact_time_scale(problem.criteria.limits, trajectory)))
    [accuracy] = problem.progress_measures()
    task["accuracy"] = ACCURACY_FACTOR * accuracy.of_trajectory(trajectory)
    return parse_scenario(scenario.table() | {"task": task})


def _arm(rng: np.random.Generator, links: int) -> dict[str, Any]:
    return {
        "link_lengths": rng.uniform(0.2, 1.0, links).tolist(),
        "max_speed": rng.uniform(2.0, 6.0, links).tolist(),
        "max_acceleration": rng.uniform(10.0, 40.0, links).tolist(),
    }


def _objective(rng: np.random.Generator) -> str:
    return str(rng.choice(SAMPLED_OBJECTIVES))


def _tip(lengths: list[float], theta: np.ndarray) -> np.ndarray:
    psi = np.cumsum(theta)
    return np.array([lengths @ np.cos(psi), lengths @ np.sin(psi)])


def _scenario(
    rng: np.random.Generator, arm: dict[str, Any], task: dict[str, Any], obstacles: list[dict[str, Any]]
) -> tuple[Scenario, Problem[Any]] | None:
    """The scenario in one of the formulations and its problem; None where no arm could do it."""
    model = {"formulation": str(rng.choice(SAMPLED_FORMULATIONS))}
    try:
        scenario = parse_scenario({"arm": arm, "task": task, "obstacles": obstacles, "model": model})
        return scenario, scenario.problem()
    except ScenarioError:
        return None


def _keeps_its_limits(problem: Problem[Any], trajectory: Trajectory) -> bool:
    """Whether a motion holds for all t once it is slow enough, and needs no more time than the search box has."""
    slowed = trajectory.time_scaled(max(0.2, exact_time_scale(problem.criteria.limits, trajectory)))
    return slowed.duration <= 8.0 and all(verdict.satisfied for verdict in problem.criteria.verify(slowed))

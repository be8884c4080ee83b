"""Built-in cases, and the best values known.

Point to point, the paper gives the start, the goal and the numbers of links. Link lengths, limits and the obstacle
are ours, the same for every case: a reach of 2 m in k equal links, 4 rad/s, 20 rad/s^2. The elbow is up at both
ends, which is what the arccos of (1) means; ``--elbow free`` lifts that.

For the paths it gives neither geometry nor limits. Ours are a calibration to its Table 1, see
``docs/explanation/reproduction.md``.
"""

from __future__ import annotations

from typing import Any

from problems.base import did_you_mean, shown_value
from tpbso_casadi.scenario.reading import parse_scenario
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.validation import ScenarioError

DEFAULT = "time-3"

PAPER = {"motion": "paper"}
REACH = 2.0
OBSTACLE = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}

THREE_METRES = {"link_lengths": [1.0, 1.0, 1.0], "max_speed": 100.0, "max_acceleration": 3000.0}
SHAPES: dict[str, dict[str, Any]] = {
    "pentagram": {"shape": "pentagram", "radius": 0.9},
    "closed-curve": {"shape": "closed-curve", "radius": 1.45, "waves": 6, "depth": -0.35},
}

TITLES = {
    **{f"time-{k}": f"Figs 2-5: least time, {k} links" for k in range(2, 6)},
    **{f"rotation-{k}": f"Figs 6-9: least joint rotation, {k} links" for k in range(2, 6)},
    **{f"obstacle-{k}": f"Figs 10-12: shortest way around an oval, {k} links" for k in range(3, 6)},
    "pentagram-time": "Fig. 13: along a pentagram in least time",
    "pentagram-rotation": "Fig. 14: along a pentagram with least joint rotation",
    "closed-curve-time": "Fig. 15: along a closed curve in least time",
    "closed-curve-rotation": "Fig. 16: along a closed curve with least joint rotation",
}


def builtin(name: str) -> Scenario:
    """The built-in scenario of a name.

    Raises:
        ScenarioError: no such name; ``TITLES`` has them all.
    """
    if not isinstance(name, str) or name not in TITLES:
        raise ScenarioError(f"no built-in scenario {shown_value(name)}{did_you_mean(name, TITLES)}")
    kind, detail = name.rsplit("-", 1)
    if kind in SHAPES:
        return _path(SHAPES[kind], objective=detail)
    if kind == "obstacle":
        return _point_to_point(int(detail), "length", [OBSTACLE])
    return _point_to_point(int(detail), kind, [])


def _point_to_point(links: int, objective: str, obstacles: list[dict[str, Any]]) -> Scenario:
    arm = {"link_lengths": [REACH / links] * links, "max_speed": 4.0, "max_acceleration": 20.0}
    task = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5], "objective": objective, "elbow": "up"}
    return parse_scenario({"arm": arm, "task": task, "obstacles": obstacles, "model": PAPER})


def _path(shape: dict[str, Any], objective: str) -> Scenario:
    task = {"kind": "path", "objective": objective, "elbow": "up", "accuracy": 0.1, **shape}
    return parse_scenario({"arm": THREE_METRES, "task": task, "model": PAPER})


BEST_KNOWN = {  # objectives of certified plans, s, rad or m, rounded up
    "time-2": 0.7017,
    "time-3": 0.4619,
    "time-4": 0.3738,
    "time-5": 0.3221,
    "rotation-2": 2.4136,
    "rotation-3": 2.0353,
    "rotation-4": 1.6285,
    "rotation-5": 1.4323,
    "obstacle-3": 1.5947,
    "obstacle-4": 1.5946,
    "obstacle-5": 1.5946,
    "pentagram-time": 0.5466,
    "pentagram-rotation": 12.142,
    "closed-curve-time": 0.7398,
    "closed-curve-rotation": 17.580,
}
STATEMENT = ("arm", "robot", "task", "obstacles")  # the tables of a scenario that say what is to be planned


def best_known(scenario: Scenario) -> float | None:
    """The objective of the best plan known, in its unit; None where the scenario states none of the built-in tasks."""
    statement = _statement(scenario)
    return next((best for name, best in BEST_KNOWN.items() if _statement(builtin(name)) == statement), None)


def _statement(scenario: Scenario) -> list[Any]:
    """The tables that say what is to be planned."""
    return [getattr(scenario, key) for key in STATEMENT]

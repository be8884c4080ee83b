"""The built-in scenarios: Sections IV-A and IV-B of the paper.

The paper gives the start, the goal and the numbers of links. Link lengths, limits and the obstacle are ours, the
same for every case: a reach of 2 m in k equal links, 4 rad/s, 20 rad/s^2. The elbow is up at both ends, which is
what the arccos of (1) means; ``--elbow free`` lifts that.
"""

from __future__ import annotations

from typing import Any

from tpbso_casadi.scenario import Scenario, parse_scenario

REACH = 2.0
DEFAULT = "time-3"


def _case(links: int, objective: str, obstacles: list[dict[str, Any]]) -> Scenario:
    return parse_scenario(
        {
            "arm": {"link_lengths": [REACH / links] * links, "max_speed": 4.0, "max_acceleration": 20.0},
            "task": {
                "kind": "point-to-point",
                "start": [1.0, 0.0],
                "goal": [0.5, 1.5],
                "objective": objective,
                "elbow": "up",
            },
            "obstacles": obstacles,
        }
    )


OVAL = {"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}

TITLES = {
    **{f"time-{k}": f"Figs 2-5: least time, {k} links" for k in range(2, 6)},
    **{f"rotation-{k}": f"Figs 6-9: least joint rotation, {k} links" for k in range(2, 6)},
    **{f"obstacle-{k}": f"Figs 10-12: shortest way around an oval, {k} links" for k in range(3, 6)},
}


def builtin(name: str) -> Scenario:
    """A built-in scenario.

    Raises:
        KeyError: no such name; ``TITLES`` has them all.
    """
    if name not in TITLES:
        raise KeyError(name)
    kind, links = name.rsplit("-", 1)
    if kind == "obstacle":
        return _case(int(links), "length", [OVAL])
    return _case(int(links), kind, [])

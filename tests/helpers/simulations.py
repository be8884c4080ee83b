"""Simulations of a small arm in the plane with a planner that sees no obstacles: what happens is known by hand."""

from __future__ import annotations

from typing import Any

from solvers.budget import Interruption
from tests.helpers.quintic_planner import QuinticPlanner
from tpbso_casadi.scenario import parse_scenario
from tpbso_casadi.simulation import Replan, Simulation, SimulationRecord, SimulationSetting

EVERY = 0.25  # exact in binary
MOVE = 0.5  # s, that the planner takes for a move


def content(**tables: Any) -> dict[str, Any]:
    """Two links of 1 m, from along x to along y and back; tables are added to, lists take the place of one."""
    stated: dict[str, Any] = {
        "arm": {"link_lengths": [1.0, 1.0], "max_speed": 20.0, "max_acceleration": 200.0},
        "task": {"kind": "point-to-point", "start": {"joints": [0.0, 0.0]}, "goal": {"joints": [1.5, 0.0]}},
        "obstacles": [],
        "simulation": {"seconds": 3.0, "every": EVERY},
    }
    for name, table in tables.items():
        stated[name] = table if isinstance(table, list) else stated.get(name, {}) | table
    return stated


def setting(**tables: Any) -> SimulationSetting:
    return SimulationSetting.of(parse_scenario(content(**tables)))


def simulated(interruption: Interruption | None = None, **tables: Any) -> SimulationRecord:
    made = setting(**tables)
    return Simulation(made, QuinticPlanner(made.scenario, MOVE)).run(interruption or Interruption())


def replan_at(tick: int, **changed: Any) -> Replan:
    """An answer of a planner that is as it should be, but for what is changed."""
    stated: dict[str, Any] = {
        "tick": tick,
        "time": tick * EVERY,
        "goal": 0,
        "kind": "new",
        "certified": True,
        "fail_safe": True,
        "seconds": 0.05,
        "predicted_distance": 0.2,
        "arrival": tick * EVERY + MOVE,
        "jumps": (0.0, 0.0, 0.0),
    }
    return Replan(**(stated | changed))

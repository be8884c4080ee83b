"""A thousand replans among obstacles that change course: how fast they come, and whether anything is touched.

Simulations of a scene in the plane and of one with a Panda, seed after seed, until there have been as many replans as
asked for, half of them in each scene. Obstacles are judged by their true motions, for all t. Simulated time waits for
the planner: an answer that takes longer than the period counts as a missed deadline, and is executed all the same.

    python -m benchmarks.replanning --replans 1000
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from solvers.budget import Interruption
from tpbso_casadi.replanning import Replanner
from tpbso_casadi.scenario import Scenario, parse_scenario, read_scenario
from tpbso_casadi.simulation import Simulation, SimulationRecord, SimulationResult, SimulationSetting

EXAMPLES = Path(__file__).parent.parent / "examples"
SCENES = {"plane, 3 links": "simulation-plane.toml", "Panda": "simulation-panda.toml"}
COUNTED = (
    "new",
    "old",
    "stop",
    "certified",
    "fail_safe",
    "goals_reached",
    "collisions",
    "unproven",
    "standing_contacts",
)
COLUMNS = (
    "scene", "seed", "replans", "median ms", "99 % ms", "largest ms", "in time", "new", "old", "stop", "certified",
    "stop proven", "goals", "collisions", "unproven", "contacts standing", "closest moving mm", "jump q", "jump dq",
    "jump ddq", "limits kept",
)  # fmt: skip


def simulated(scenario: Scenario, seed: int, every: float, within: float | None) -> SimulationRecord:
    """One simulation."""
    content: dict[str, Any] = scenario.table() | {"model": scenario.model.stated()}
    content["solver"]["seed"] = seed
    content["simulation"] |= {"every": every, "within": within}
    setting = SimulationSetting.of(parse_scenario(content))
    rate, evaluations = setting.settings.course_rate, setting.settings.evaluations
    planner = Replanner(setting.scenario, every, rate, evaluations, within, seed)
    return Simulation(setting, planner).run(Interruption())


def row(scene: str, seed: str, records: Sequence[SimulationRecord], results: Sequence[SimulationResult]) -> list[str]:
    """A row of the table, of one simulation or of several."""
    ms = 1000.0 * np.array([replan.seconds for record in records for replan in record.replans])
    every = 1000.0 * records[0].settings.every
    summaries = [result.summary for result in results]
    new, old, stop, certified, safe, goals, *touched = (
        sum(getattr(summary, name) for summary in summaries) for name in COUNTED
    )
    jumps = np.max([record.largest_jumps for record in records], axis=0)
    kept = all(limit.satisfied for result in results for limit in result.limits)
    nearest = min(_nearest_moving(result) for result in results)
    return [
        scene, seed, str(ms.size), f"{np.median(ms):.1f}", f"{np.percentile(ms, 99.0):.1f}", f"{ms.max():.1f}",
        f"{np.mean(ms <= every):.1%}", *(f"{count / ms.size:.1%}" for count in (new, old, stop, certified, safe)),
        str(goals), *map(str, touched), f"{1000.0 * nearest:.1f}", *(f"{jump:.1e}" for jump in jumps),
        "yes" if kept else "NO",
    ]  # fmt: skip


def _nearest_moving(result: SimulationResult) -> float:
    distance = result.summary.closest_moving
    return np.inf if distance is None else distance


def rows(options: argparse.Namespace) -> Iterator[list[str]]:
    """Of every simulation, then of all of a scene together."""
    for scene, file in SCENES.items():
        scenario, seed = read_scenario(EXAMPLES / file), options.seed
        records: list[SimulationRecord] = []
        results: list[SimulationResult] = []
        while sum(len(record.replans) for record in records) < options.replans / len(SCENES):
            records.append(simulated(scenario, seed, options.every, options.within))
            results.append(SimulationResult.of(records[-1]))
            yield row(scene, str(seed), records[-1:], results[-1:])
            seed += 1
        yield row(scene, "all", records, results)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--replans", type=int, default=1000, help="in all")
    parser.add_argument("--seed", type=int, default=1, help="the first")
    parser.add_argument("--every", type=float, default=0.1, help="time between two replans, s")
    parser.add_argument("--within", type=float, help="that each may take, s; as the scenes say if left out")
    options = parser.parse_args()
    began = time.perf_counter()
    print(f"| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    for cells in rows(options):
        print(f"| {' | '.join(cells)} |", flush=True)
    print(f"\n{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()

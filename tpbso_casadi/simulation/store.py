"""The folder of a simulation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite
from pathlib import Path

import numpy as np

from problems.base import FloatArray
from solvers import Interruption
from tpbso_casadi.planning import Motion
from tpbso_casadi.simulation.record import SimulationRecord
from tpbso_casadi.simulation.result import SimulationResult
from tpbso_casadi.storage import Writer, replace_folder, write_csv, write_motion

ROWS_PER_SECOND = 100
REPLANS = (
    "tick", "t", "goal", "kind", "certified", "fail_safe", "ms", "in_time", "predicted_distance", "arrival",
    "jump_q", "jump_qd", "jump_qdd",
)  # fmt: skip


def write_simulation(
    folder: Path,
    record: SimulationRecord,
    result: SimulationResult,
    further: Sequence[Writer] = (),
    interruption: Interruption | None = None,
) -> list[str]:
    """Write the files of a simulation in place of everything in the folder.

    Args:
        folder: of the run.
        record: of the simulation.
        result: of the same.
        further: each writes files into the folder that it is given: figures, a player.
        interruption: after its request, further files that are not complete yet are left out.

    Returns:
        The names of the files.

    Raises:
        OutputError: as :func:`tpbso_casadi.storage.run_folder.write_plan`.
    """

    def tables(staged: Path) -> None:
        times = row_times(record)
        motion = Motion(record.scenario.criteria(), record.executed, {})
        write_motion(staged / "trajectory.csv", motion, times)
        write_csv(staged / "replans.csv", REPLANS, replan_rows(record))
        write_csv(staged / "obstacles.csv", *obstacle_table(record, times))

    return replace_folder(
        folder,
        needed=[tables],
        further=further,
        result=lambda files: result.model_copy(update={"files": files}).to_json(),
        interruption=interruption,
    )


def row_times(record: SimulationRecord) -> FloatArray:
    """The times in s of the rows of ``trajectory.csv`` and ``obstacles.csv``, every join among them."""
    return record.executed.times(int(np.ceil(ROWS_PER_SECOND * record.duration)) + 1)


def replan_rows(record: SimulationRecord) -> Iterator[list[object]]:
    """The rows of ``replans.csv``; s, m, rad and their rates, a distance that is not known is empty."""
    for each in record.replans:
        yield [
            each.tick, each.time, each.goal, each.kind, _yes(each.certified), _yes(each.fail_safe),
            1000.0 * each.seconds, _yes(each.seconds <= record.settings.every),
            each.predicted_distance if isfinite(each.predicted_distance) else None, each.arrival, *each.jumps,
        ]  # fmt: skip


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def obstacle_table(record: SimulationRecord, times: FloatArray) -> tuple[list[str], list[list[float]]]:
    """``t`` and, of every obstacle that moves, where a point of it truly is: ``x1, y1[, z1]``; s and m.

    Obstacles have their numbers in the scenario, from 1.
    """
    header, columns = ["t"], [times]
    for number, obstacle in enumerate(record.obstacles, start=1):
        if obstacle.moves:
            header += [f"{axis}{number}" for axis in "xyz"[: obstacle.dim]]
            columns += list(np.array([obstacle.during(time, time).at(time).place for time in times.tolist()]).T)
    return header, np.column_stack(columns).tolist()

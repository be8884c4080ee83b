"""Plan a scene, and judge the plan without the code that made it."""

from __future__ import annotations

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.moving_scenes.coal_check import check_with_coal
from benchmarks.moving_scenes.scenes import MOST_WAIT, Scene, line_time
from problems import Trajectory
from tpbso_casadi import read_scenario
from tpbso_casadi.planning import PlannedMotion, plan

SAMPLES, CHUNK = 20_000, 1000  # times of a motion; of them computed at once
ROUNDING = 1e-7  # m: of two ways to compute a distance
COAL_CHECKS = 10  # of the closest samples, those that another library looks at


@dataclass(frozen=True)
class Outcome:
    """What came of a scene.

    Attributes:
        scene: its name.
        dim: 2 or 3.
        moving: obstacles that move.
        feasible: whether the plan keeps all limits, proven for all t.
        clear: whether its clearance is certified; other limits may be broken.
        seconds: of CPU that planning took.
        duration: of the motion, s; None where there is none.
        bound: no motion without obstacles is faster, s.
        known: how long the known solution takes at most, s.
        room: the least distance at the samples of one whose clearance is certified, m; negative where it is false.
        still_feasible: whether the scene could be planned with all obstacles where they are at t = 0.
        still_hit: whether that plan meets the obstacles as they move.
        error: why nothing was planned.
    """

    scene: str
    dim: int
    moving: int
    feasible: bool = False
    clear: bool = False
    seconds: float = 0.0
    duration: float | None = None
    bound: float | None = None
    known: float | None = None
    room: float | None = None
    still_feasible: bool = False
    still_hit: bool | None = None
    error: str = ""

    @property
    def is_false(self) -> bool:
        """Whether the clearance is certified, and samples meet an obstacle."""
        return self.room is not None and self.room < -ROUNDING


def judged(scene: Scene, evaluations: int, seed: int, compared: bool, solver: str | None = None) -> Outcome:
    """Plan a scene and check the plan; and, to compare, that for obstacles that stand still."""
    moving = sum(thing.moves for thing in scene.things)
    try:
        planned, seconds = _planned(scene, evaluations, seed, solver)
    except Exception as error:  # a scene that cannot be planned at all is an outcome too
        return Outcome(scene.name, scene.dim, moving, error=f"{type(error).__name__}: {error}")
    clear = all(v.satisfied for v in planned.verdicts if v.name == "clearance")
    still_feasible, still_hit = _compared(scene, evaluations, seed) if compared else (False, None)
    return Outcome(
        scene=scene.name,
        dim=scene.dim,
        moving=moving,
        feasible=planned.feasible,
        clear=clear,
        seconds=seconds,
        duration=planned.trajectory.duration,
        bound=planned.problem.direct.free_space_time,
        known=MOST_WAIT + line_time(scene.arm, scene.start, scene.goal),
        room=least_room(scene, planned.trajectory) if clear else None,
        still_feasible=still_feasible,
        still_hit=still_hit,
    )


def _planned(scene: Scene, evaluations: int, seed: int, solver: str | None = None) -> tuple[PlannedMotion, float]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(scene.scenario(evaluations, seed, solver))
        scenario = read_scenario(path)
    began = time.process_time()
    planned = plan(scenario)
    return planned, time.process_time() - began


def _compared(scene: Scene, evaluations: int, seed: int) -> tuple[bool, bool | None]:
    """Whether the standing scene is solved, and whether its plan meets the obstacles as they move."""
    try:
        planned, _ = _planned(scene.stopped(), evaluations, seed)
    except Exception:  # as where an obstacle stands on the goal
        return False, None
    return planned.feasible, least_room(scene, planned.trajectory) < 0.0 if planned.feasible else None


def least_room(scene: Scene, trajectory: Trajectory) -> float:
    """The least room at very many times, m; with coal too, in space, where that is installed.

    Raises:
        AssertionError: coal and NumPy do not agree.
    """
    times = np.linspace(0.0, trajectory.duration, SAMPLES)
    arm, parts = scene.arm, np.array_split(times, SAMPLES // CHUNK)
    rooms = np.concatenate([arm.room(trajectory.at(part), part, scene.things) for part in parts])
    if scene.dim == 3:
        closest = times[np.argsort(rooms)[:COAL_CHECKS]]
        check_with_coal(scene.things, trajectory.at(closest), closest)
    return float(rooms.min())

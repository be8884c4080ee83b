"""Motions of planners as files: made once, and judged as often as wanted."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.foreign_motions.planners import FOREIGN, Made, Rows, problems_for
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from problems import Trajectory

ROWS = ("times", "angles", "speeds", "accelerations")


@dataclass(frozen=True)
class Shelf:
    """A folder of motions, one file for each planner and problem.

    Attributes:
        folder: where they are.
    """

    folder: Path

    def path(self, planner: str, problem: str) -> Path:
        """Of a motion, or of the word that there is none."""
        return self.folder / planner / f"{problem}.npz"

    def put(self, planner: str, problem: str, made: Made | None, seconds: float, reason: str) -> None:
        """Keep a motion, or why there is none."""
        arrays = {} if made is None else {name: getattr(made.rows, name) for name in ROWS}
        if made is not None and made.motion is not None:
            arrays |= {"breakpoints": made.motion.breakpoints, "coefficients": made.motion.coefficients}
        place = self.path(planner, problem)
        place.parent.mkdir(parents=True, exist_ok=True)
        unfinished = place.with_suffix(".part.npz")
        np.savez_compressed(unfinished, about=json.dumps({"seconds": seconds, "reason": reason}), **arrays)
        unfinished.replace(place)

    def get(self, planner: str, problem: str) -> Made | None:
        """A motion that was kept; None where its planner found none."""
        with np.load(self.path(planner, problem)) as file:
            if "times" not in file:
                return None
            pieces = "breakpoints" in file
            motion = Trajectory(file["breakpoints"], file["coefficients"]) if pieces else None
            return Made(motion, Rows(*(file[name] for name in ROWS)))


def make_all(
    shelf: Shelf, setting: Setting, scenes: list[MotionProblem], planners: list[str], count: int, seconds: float
) -> Iterator[str]:
    """Make what is missing; says what becomes of each.

    A planner that fails by an exception has made no motion of that problem; OMPL takes one seed a process.
    """
    from ompl import util  # noqa: PLC0415 (an extra)

    util.RNG.setSeed(1)
    for name in planners:
        for problem in problems_for(FOREIGN[name], setting, scenes, count):
            if shelf.path(name, problem.name).exists():
                continue
            began, reason = time.process_time(), "found none"
            try:
                made = FOREIGN[name].make(setting, problem, seconds)
            except (RuntimeError, ValueError, AssertionError) as error:
                made, reason = None, f"{type(error).__name__}: {error}"
            spent = time.process_time() - began
            shelf.put(name, problem.name, made, spent, "" if made else reason)
            yield f"{name} {problem.name}: {reason if made is None else f'{made.rows.times[-1]:.3f} s'} ({spent:.2f} s)"

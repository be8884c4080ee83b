"""Motions judged by ``tp.certify``, and looked at by code of its own at their own rows."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

import tpbso_casadi as tp
from benchmarks.foreign_motions.files import Shelf
from benchmarks.foreign_motions.planners import FOREIGN, Made, Rows, problems_for
from benchmarks.motion_bench_maker.ours import Question
from benchmarks.motion_bench_maker.problem_file import MotionProblem
from benchmarks.motion_bench_maker.setting import Setting
from problems import CertificateStatus, Verdict
from problems.limits import LIMITS
from tpbso_casadi.facade.robots import StatedRobot

FORMS = {
    "itself": "as the library evaluates it",
    "cubic": "rows each 10 ms with speeds, joined by cubics",
    "quintic": "rows each 10 ms with speeds and accelerations, joined by quintics",
    "knots": "rows where its pieces meet with speeds and accelerations, joined by quintics",
}
SHARES = ("speed", "acceleration", "jerk")  # whose excess is told as a share of the limit
ROUNDING = 1e-9  # as of certificates: relative of speeds and accelerations, m, rad


@dataclass(frozen=True)
class Outcome:
    """What is said of a motion.

    Attributes:
        planner: that made it.
        problem: of what.
        form: how it was given, one of ``FORMS``.
        status: certified, violated or undecided, by what its planner was told.
        over: by how much what is violated is, by its name: shares of speeds, accelerations and jerks, infinite where
            what is below them jumps; rad and m of the others.
        undecided: names of what is.
        at_rows: names of what is broken at its own rows.
        pieces: of the motion.
        milliseconds: of the processor, of the whole call.
    """

    planner: str
    problem: str
    form: str
    status: str
    over: dict[str, float]
    undecided: list[str]
    at_rows: list[str]
    pieces: int
    milliseconds: float


def stored_outcomes(file: Path) -> list[Outcome]:
    """Those of a file; none where it is not there."""
    return [Outcome(**json.loads(line)) for line in file.read_text().splitlines()] if file.exists() else []


def outcomes_of(
    shelf: Shelf, known: Path, setting: Setting, scenes: list[MotionProblem], planners: list[str], count: int
) -> Iterator[Outcome]:
    """The outcomes of all motions that were made, those that a file knows first; new ones are added to it."""
    stored = stored_outcomes(known)
    done = {(each.planner, each.problem, each.form) for each in stored}
    yield from (each for each in stored if each.planner in planners)
    with known.open("a") as file:
        for name in planners:
            for problem in problems_for(FOREIGN[name], setting, scenes, count):
                if not shelf.path(name, problem.name).exists():
                    continue
                left = [form for form in FORMS if (name, problem.name, form) not in done]
                for outcome in _judged(shelf, setting, name, problem, left):
                    file.write(json.dumps(asdict(outcome)) + "\n")
                    file.flush()
                    yield outcome


def _judged(
    shelf: Shelf, setting: Setting, name: str, problem: MotionProblem, forms: Sequence[str]
) -> Iterator[Outcome]:
    made, planner = shelf.get(name, problem.name) if forms else None, FOREIGN[name]
    if made is None:
        return
    scenario = Question(setting, to_pose=False).scenario(problem)
    robot = StatedRobot(scenario.robot_table)
    obstacles = scenario.table()["obstacles"]
    untold = LIMITS.keys() - planner.told
    for form, motion, rows in _forms(made, forms):
        seen = sorted(at_rows(setting, problem, rows) & planner.told)
        began = time.process_time()
        plan = tp.certify(motion, robot, obstacles=obstacles, without=untold | ({"jerk"} if form == "cubic" else set()))
        status = plan.status
        spent = 1e3 * (time.process_time() - began)
        broken = [each for each in plan.verdicts if each.status is CertificateStatus.VIOLATED]
        undecided = [each.name for each in plan.verdicts if each.status is CertificateStatus.UNDECIDED]
        yield Outcome(
            name,
            problem.name,
            form,
            str(status),
            {each.name: _excess(each) for each in broken},
            undecided,
            seen,
            plan.trajectory.breakpoints.size - 1,
            spent,
        )


def _forms(made: Made, forms: Sequence[str]) -> Iterator[tuple[str, Any, Rows]]:
    """In which a motion is given, and the rows that would be looked at."""
    rows, motion = made.rows, made.motion
    given: dict[str, tuple[Any, Rows]] = {
        "cubic": ((rows.times, rows.angles, rows.speeds), rows),
        "quintic": (rows.states, rows),
    }
    if motion is not None:
        knots = Rows(motion.breakpoints, *(motion.at(motion.breakpoints, order) for order in range(3)))
        given |= {"itself": (motion, rows), "knots": (knots.states, knots)}
    yield from ((form, *given[form]) for form in forms if form in given)


def _excess(verdict: Verdict) -> float:
    return abs(verdict.worst / verdict.bound) - 1.0 if verdict.name in SHARES else verdict.excess


def at_rows(setting: Setting, problem: MotionProblem, rows: Rows) -> set[str]:
    """What the rows of a motion break, by code of its own."""
    limits, broken = setting.limits, set()
    stated = ("speed", rows.speeds, limits.speed), ("acceleration", rows.accelerations, limits.acceleration)
    for name, values, most in stated:
        if (np.abs(values) > np.array(most) * (1.0 + ROUNDING)).any():
            broken.add(name)
    low, high = np.array(limits.position).T
    if ((rows.angles < low - ROUNDING) | (rows.angles > high + ROUNDING)).any():
        broken.add("joint range")
    if problem.obstacles and setting.checker(problem).clearance(rows.angles).min() < -ROUNDING:
        broken.add("clearance")
    return broken

"""Problems of MotionBenchMaker as scenarios and runs of a campaign, and what comes out of it as records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from benchmarks.motion_bench_maker.collision import APART, Checker
from benchmarks.motion_bench_maker.problem_file import MotionProblem, Obstacle
from benchmarks.motion_bench_maker.records import Record, Records
from benchmarks.motion_bench_maker.setting import Setting
from tpbso_casadi.judging.grid import SolverSpec
from tpbso_casadi.judging.run import Run
from tpbso_casadi.judging.store import RunStore
from tpbso_casadi.scenario import Scenario, parse_scenario


@dataclass(frozen=True)
class Question:
    """How problems are put to our planner.

    Attributes:
        setting: robot and limits.
        to_pose: whether the goal is the pose of the tool at the goal joints instead of the joints.
    """

    setting: Setting
    to_pose: bool

    def scenario(self, problem: MotionProblem) -> Scenario:
        """A problem as a scenario.

        Raises:
            ScenarioError: it cannot be planned.
        """
        goal: dict[str, Any] = {"joints": list(problem.goal)}
        if self.to_pose and self.setting.tool is not None:
            pose = self.setting.kinematics.pose(np.array(problem.goal), self.setting.tool)
            quaternion = Rotation.from_matrix(pose[:3, :3]).as_quat()
            goal = {"position": pose[:3, 3].tolist(), "quaternion": quaternion.tolist()}
        return parse_scenario(
            {
                "robot": self._robot(problem),
                "task": {"kind": "point-to-point", "start": {"joints": list(problem.start)}, "goal": goal},
                "obstacles": [_table(obstacle) for obstacle in problem.obstacles],
            }
        )

    def _robot(self, problem: MotionProblem) -> dict[str, Any]:
        setting, limits = self.setting, self.setting.limits
        return {
            "urdf": setting.urdf.name,
            "urdf_text": setting.urdf_text,
            "spheres": setting.spheres_file.name,
            "spheres_text": setting.spheres_file.read_text(),
            "max_acceleration": list(limits.acceleration),
            "max_jerk": None if limits.jerk is None else list(limits.jerk),
            "disabled_pairs": may_touch(setting.checker(problem)),
            **({} if setting.tool is None else {"tip_link": setting.tool}),
            **({} if setting.payload is None else {"payload": setting.payload.stated()}),
        }


def may_touch(checker: Checker) -> list[tuple[str, str]]:
    """Pairs of links that are fewer than three joints apart, or of which spheres meet at start or goal."""
    spheres = checker.spheres
    pairs = np.array(np.triu_indices(len(spheres.links), 1)).T
    kept = {tuple(pair) for pair in checker.own.tolist()}
    near = np.abs(np.diff(spheres.bodies[pairs], axis=1)[:, 0]) < APART
    left_out = [pair for pair, close in zip(pairs.tolist(), near, strict=True) if close or tuple(pair) not in kept]
    names = {tuple(sorted((spheres.links[one], spheres.links[two]))) for one, two in left_out}
    return sorted((one, two) for one, two in names if one != two)


def _table(obstacle: Obstacle) -> dict[str, Any]:
    table: dict[str, Any] = {"shape": obstacle.shape, "center": obstacle.position, "quaternion": obstacle.quaternion}
    if obstacle.shape == "cylinder":
        return table | {"radius": obstacle.size[0] / 2.0, "length": obstacle.size[2]}
    return table | {"size": obstacle.size}


def runs_of(
    question: Question, problems: Sequence[MotionProblem], specs: Sequence[SolverSpec], seeds: Sequence[int]
) -> list[tuple[MotionProblem, Run]]:
    """All problems with all solvers and seeds; all of one seed before the next.

    Raises:
        ScenarioError: a problem or a solver that cannot be.
    """
    scenarios = [(problem, question.scenario(problem)) for problem in problems]
    return [
        (problem, Run(problem.name, spec.label, spec.applied(scenario, seed)))
        for seed in seeds
        for spec in specs
        for problem, scenario in scenarios
    ]


def judge_all(
    setting: Setting, runs: Sequence[tuple[MotionProblem, Run]], store: RunStore, records: Records
) -> Iterator[Record]:
    """The records of the runs that are stored; those that there are not yet are made and kept."""
    known = {record.key: record for record in records.every}
    stored = store.done()
    for problem, run in runs:
        key = problem.name, run.solver, run.seed, run.key
        if key not in known and run.key in stored:
            known[key] = _judged(setting, problem, run, store)
            records.add(known[key])
        if key in known:
            yield known[key]


def _judged(setting: Setting, problem: MotionProblem, run: Run, store: RunStore) -> Record:
    """What became of a run, with its motion checked at samples."""
    given = problem.name, run.solver, run.seed, run.key, setting.bound(problem)
    (outcome,) = store.records([run])
    if outcome.error:
        return Record(*given, seconds=outcome.seconds, error=outcome.error)
    result = store.result(run)
    motion = result.solution.trajectory
    further = 0.0 if result.retiming is None else result.retiming.seconds
    return Record(
        *given,
        duration=motion.duration,
        seconds=result.seconds + further,
        clearance=setting.clearance(problem, motion.at, motion.duration),
        excess=setting.excess(motion.at, motion.duration),
        certified=result.feasible,
        details={
            "whole run, s": outcome.seconds,
            "search, s": result.seconds,
            "finish, s": further,
            "goal error": float(np.abs(motion.at(np.array([motion.duration]))[0] - problem.goal).max()),
            **({} if setting.payload is None else {"payload": setting.payload.stated()}),
            "failed": [constraint.name for constraint in result.constraints if not constraint.satisfied],
        },
    )

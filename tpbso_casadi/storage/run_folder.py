"""The files of a run: result.json, trajectory.csv and the figures."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from platform import python_version
from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray, as_array
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.storage.files import write_csv, write_text, writing
from tpbso_casadi.storage.plain import settings_of
from tpbso_casadi.storage.result import (
    CertificateResult,
    ConstraintResult,
    HistoryResult,
    ObjectiveResult,
    PolishedMotion,
    PolishResult,
    RunResult,
    SolutionResult,
    SolverResult,
    VariableResult,
)
from tpbso_casadi.storage.versions import versions


def write_run(folder: Path, plan: Plan, plots: bool) -> list[Path]:
    """Write a plan's files; other files in an existing folder are kept.

    Each file is written completely or not at all; ``result.json`` comes last.

    Raises:
        OutputError: the folder cannot be written.
    """
    result = result_of(plan)
    with writing(folder):
        written = [write_motion(folder / "trajectory.csv", plan.motion, plan.times)]
        if plots:
            from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

            written += draw_figures(folder, plan)
        written.append(write_text(folder / "result.json", lambda file: file.write(result.to_json())))
    return written


def result_of(plan: Plan) -> RunResult:
    """The content of ``result.json``: everything to rerun and judge the plan."""
    search, solver = plan.search, plan.scenario.solver
    objective = plan.problem.objective
    return RunResult(
        scenario=plan.scenario,
        solver=SolverResult(name=solver.name, settings=settings_of(solver.build())),
        seed=solver.seed,
        objective=ObjectiveResult(name=objective.name, value=plan.objective, unit=objective.unit),
        cost=search.cost,
        feasible=plan.feasible,
        constraints=[ConstraintResult(**asdict(verdict), satisfied=verdict.satisfied) for verdict in plan.verdicts],
        certificate=CertificateResult(verdict=plan.motion.status),
        solution=_solution(plan),
        polish=None if plan.polish is None else _polish(plan.polish),
        rounds=plan.rounds,
        evaluations=search.evaluations,
        iterations=search.iterations,
        seconds=search.seconds,
        stop_reason=search.stop_reason,
        history=HistoryResult(evaluations=search.history.evaluations.tolist(), cost=search.history.cost.tolist()),
        versions={"python": python_version(), **versions()},
    )


def _solution(plan: Plan) -> SolutionResult:
    motion, search = plan.motion, plan.search
    return SolutionResult(
        variables=None if search.in_program_variables else _variables(plan.problem, search.x),
        quantities={name: values.tolist() for name, values in motion.quantities.items()},
        time_scale=motion.time_scale,
        breakpoints=motion.trajectory.breakpoints.tolist(),
        coefficients=motion.trajectory.coefficients.tolist(),
    )


def _variables(problem: Problem[Any], x: FloatArray) -> list[VariableResult]:
    """The best search vector (d,), by name; before any polish."""
    return [
        VariableResult(name=variable.name, value=float(value), unit=variable.unit)
        for variable, value in zip(problem.variables, x, strict=True)
    ]


def _polish(polish: Polish) -> PolishResult:
    solution = polish.search.solution
    return PolishResult(
        before=_polished(polish.before),
        after=_polished(polish.after),
        accepted=polish.accepted,
        starts=polish.search.iterations,
        iterations=solution.iterations,
        evaluations=polish.search.evaluations,
        seconds=polish.seconds,
        status=solution.status,
        stop_reason=solution.stop_reason,
        residuals=dict(solution.residuals),
        multipliers=dict(polish.multipliers),
    )


def _polished(motion: Motion) -> PolishedMotion:
    return PolishedMotion(objective=motion.objective, worst_violation=motion.worst_violation, feasible=motion.feasible)


def write_motion(path: Path, motion: Motion, times: FloatArray) -> Path:
    """Write the table of a motion at times (n,) in s.

    Raises:
        OSError: it cannot be written.
    """
    header, table = table_of(motion, times)
    return write_csv(path, header, table.tolist())


def table_of(motion: Motion, times: FloatArray) -> tuple[list[str], FloatArray]:
    """``t, q1..qk, qd1..qdk, qdd1..qddk, x, y`` in s, rad and m: the header and a row for each of the times (n,)."""
    samples = motion.trajectory.samples(times, motion.problem.robot)
    joints, axes = range(1, motion.problem.robot.dof + 1), "xyz"[: motion.problem.robot.dim]
    header = ["t", *(f"{symbol}{joint}" for symbol in ("q", "qd", "qdd") for joint in joints), *axes]
    parts = (samples.theta, samples.speed, samples.acceleration, samples.tool)
    return header, np.column_stack([times, *(as_array(matrix) for matrix in parts)])

"""The files that a run leaves: result.json, trajectory.csv and the figures."""

from __future__ import annotations

import json
import math
from dataclasses import asdict
from pathlib import Path
from platform import python_version
from typing import Any

import numpy as np

from problems import Problem
from problems.base.matrix import FloatArray, as_array
from solvers import DescentResult
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.planning.plan import Plan
from tpbso_casadi.planning.refinement import Polish
from tpbso_casadi.storage.files import write_csv, write_text, writing
from tpbso_casadi.storage.versions import versions


def write_run(folder: Path, plan: Plan, plots: bool) -> list[Path]:
    """Write a plan's files; an existing folder keeps whatever else it holds.

    Each file appears whole or not at all; ``result.json`` comes last.

    Raises:
        OutputError: the folder cannot be written.
    """
    result = result_of(plan)
    with writing(folder):
        written = [write_motion(folder / "trajectory.csv", plan.motion, plan.times)]
        if plots:
            from tpbso_casadi.figures.run import draw_figures  # noqa: PLC0415 (matplotlib is slow to load)

            written += draw_figures(folder, plan)
        written.append(write_text(folder / "result.json", lambda file: file.write(as_json(result))))
    return written


def result_of(plan: Plan) -> dict[str, Any]:
    """The content of ``result.json``: everything to rerun and judge the plan."""
    search, problem = plan.search, plan.problem
    objective = problem.measured_by
    return {
        "scenario": plan.scenario.model_dump(mode="json"),
        "solver": {"name": plan.scenario.solver.name, "settings": asdict(plan.scenario.solver.build())},  # type: ignore[arg-type]
        "seed": plan.scenario.solver.seed,
        "objective": {"name": objective.name, "value": plan.objective, "unit": objective.unit},
        "cost": search.cost,
        "feasible": plan.feasible,
        "constraints": [
            {**asdict(verdict), "status": str(verdict.status), "satisfied": verdict.satisfied}
            for verdict in plan.verdicts
        ],
        "certificate": {"verdict": str(plan.motion.status)},
        "solution": {
            "variables": None if isinstance(search, DescentResult) else _variables(problem, search.x),
            "quantities": {name: values.tolist() for name, values in plan.motion.quantities.items()},
            "time_scale": plan.motion.time_scale,
            "breakpoints": plan.trajectory.breakpoints.tolist(),
            "coefficients": plan.trajectory.coefficients.tolist(),
        },
        **({} if plan.polish is None else {"polish": _polish(plan.polish)}),
        "rounds": plan.rounds,
        "evaluations": search.evaluations,
        "iterations": search.iterations,
        "seconds": search.seconds,
        "stop_reason": str(search.stop_reason),
        "history": {
            "evaluations": search.history.evaluations.tolist(),
            "cost": search.history.cost.tolist(),
        },
        "versions": {"python": python_version(), **versions()},
    }


def _variables(problem: Problem, x: FloatArray) -> list[dict[str, Any]]:
    """The best search vector (d,), by name; before any polish."""
    return [
        {"name": variable.name, "value": float(value), "unit": variable.unit}
        for variable, value in zip(problem.variables, x, strict=True)
    ]


def _polish(polish: Polish) -> dict[str, Any]:
    """Before and after; ``iterations`` and ``status`` are those of the descent that led to the best."""
    solution = polish.search.solution
    both = {"before": polish.before, "after": polish.after}
    return {
        **{
            name: {"objective": it.objective, "worst_violation": it.worst_violation, "feasible": it.feasible}
            for name, it in both.items()
        },
        "accepted": polish.accepted,
        "starts": polish.search.iterations,
        "iterations": solution.iterations,
        "evaluations": polish.search.evaluations,
        "seconds": polish.seconds,
        "status": solution.status,
        "stop_reason": str(solution.stop_reason),
        "residuals": solution.residuals,
        "multipliers": polish.multipliers,
    }


def as_json(result: dict[str, Any], indent: int | None = 2) -> str:
    """Strict JSON: a number that is not finite becomes null."""
    return json.dumps(_finite(result), indent=indent, allow_nan=False) + "\n"


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_motion(path: Path, motion: Motion, times: FloatArray) -> Path:
    """Write the table of a motion at times (n,) in s.

    Raises:
        OSError: it cannot be written.
    """
    header, table = table_of(motion, times)
    return write_csv(path, header, table.tolist())


def table_of(motion: Motion, times: FloatArray) -> tuple[list[str], FloatArray]:
    """``t, q1..qk, qd1..qdk, qdd1..qddk, x, y`` in s, rad and m: the header and a row for each of the times (n,)."""
    samples = motion.trajectory.samples(times)
    arm = motion.problem.arm
    joints = range(1, arm.links + 1)
    header = ["t", *(f"{symbol}{joint}" for symbol in ("q", "qd", "qdd") for joint in joints), "x", "y"]
    parts = (samples.theta, samples.speed, samples.acceleration, arm.tip(samples.theta))
    return header, np.column_stack([times, *(as_array(matrix) for matrix in parts)])

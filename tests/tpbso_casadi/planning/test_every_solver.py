"""Every built-in case by every solver that finds a plan, as run folders checked with NumPy alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from helpers.scenes import SWING, TWO_LINKS
from helpers.slow import slow_except
from oracles.csv_checker import check_run

import tpbso_casadi as tp
from solvers import SOLVERS
from tpbso_casadi.scenario.cases import TITLES

CAPABLE = [solver for solver in SOLVERS if solver not in {"bas", "random"}]  # others need not find a feasible plan
ALL = [(case, solver) for case in TITLES for solver in CAPABLE]
IN_BRIEF = list(zip(("time-2", "rotation-4", "obstacle-3", "closed-curve-time", "time-5"), CAPABLE, strict=True))


def checked(folder: Path, scenario: tp.Scenario | str, **keys: Any) -> dict[str, Any]:
    """The result of a plan without a polish, after its folder was checked."""
    return check_run(tp.plan(scenario, polish=False, **keys).save(folder / "run", figures=()))


@pytest.mark.parametrize(("case", "solver"), slow_except(ALL, IN_BRIEF))
def test_every_case_with_every_capable_solver_in_the_reduced_form(case: str, solver: str, tmp_path: Path) -> None:
    result = checked(tmp_path, case, solver=solver, evaluations=2000, formulation="reduced")
    assert result["feasible"]
    assert result["evaluations"] == 2000
    assert all(constraint["satisfied"] for constraint in result["constraints"])


LINKS = [(f"{name}-3", k) for k in (2, 3, 4, 5, 7) for name in ("time", "rotation")]
OTHERS = [(case, None) for case in TITLES if not case.startswith(("time", "rotation"))]


@pytest.mark.slow
@pytest.mark.parametrize(("case", "links"), [*LINKS, *OTHERS])
@pytest.mark.parametrize("solver", CAPABLE)
def test_any_number_of_links_obstacles_and_paths_in_the_paper_form(
    solver: str, case: str, links: int | None, tmp_path: Path
) -> None:
    scenario = tp.builtin(case)
    if links is not None and scenario.arm is not None:
        scenario = scenario.replaced(arm=scenario.arm.with_links(links))
    checked(tmp_path, scenario, solver=solver)


def test_a_scenario_with_everything(tmp_path: Path) -> None:
    arm = TWO_LINKS | {"link_lengths": [1.0, 0.8, 0.7], "joint_limits": [[-3.0, 3.0], [-2.5, 2.5], [-2.6, 2.6]]}
    tables: dict[str, Any] = {
        "arm": arm,
        "task": SWING | {"objective": "length", "elbow": "free"},
        "obstacles": [{"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}],
        "model": {"formulation": "reduced"},
        "solver": {"name": "pso", "seed": 2, "evaluations": 600},
    }
    result = checked(tmp_path, tp.parse_scenario(tables))
    assert [c["name"] for c in result["constraints"]][:4] == ["speed", "acceleration", "joint range", "clearance"]

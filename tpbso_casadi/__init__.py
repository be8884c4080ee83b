"""Plan robot-arm motions with metaheuristics on one symbolic CasADi model. A user needs this import alone."""

from problems import (
    OBJECTIVES,
    Ellipse,
    InvalidProblem,
    Path,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    Trajectory,
    Verdict,
    closed_curve,
    pentagram,
)
from problems.pricing import PopulationFunction, Pricing
from solvers import BSO, GA, PSO, SOLVERS, Box, Budget, Result, Solver, StopReason, find_solver, minimize
from tpbso_casadi.builtin import builtin
from tpbso_casadi.planning import Plan, plan
from tpbso_casadi.run_folder import result_of, write_run
from tpbso_casadi.scenario import Scenario, parse_scenario, read_scenario
from tpbso_casadi.section import ScenarioError

__all__ = [
    "BSO",
    "GA",
    "OBJECTIVES",
    "PSO",
    "SOLVERS",
    "Box",
    "Budget",
    "Ellipse",
    "InvalidProblem",
    "Path",
    "PathFollowing",
    "Plan",
    "PlanarArm",
    "PointToPoint",
    "PopulationFunction",
    "Pricing",
    "Problem",
    "Result",
    "Scenario",
    "ScenarioError",
    "Solver",
    "StopReason",
    "Trajectory",
    "Verdict",
    "builtin",
    "closed_curve",
    "find_solver",
    "minimize",
    "parse_scenario",
    "pentagram",
    "plan",
    "read_scenario",
    "result_of",
    "write_run",
]

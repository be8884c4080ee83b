"""Plan robot-arm motions with metaheuristics on one symbolic CasADi model. A user needs this import alone."""

from problems import OBJECTIVES, Ellipse, InvalidProblem, PlanarArm, PointToPoint, Problem, Trajectory, Verdict
from solvers import BSO, GA, PSO, SOLVERS, Box, Budget, Result, Solver, StopReason, find_solver, minimize
from tpbso_casadi.builtin import builtin
from tpbso_casadi.planning import Plan, plan
from tpbso_casadi.run_folder import result_of, write_run
from tpbso_casadi.scenario import Scenario, ScenarioError, parse_scenario, read_scenario

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
    "Plan",
    "PlanarArm",
    "PointToPoint",
    "Problem",
    "Result",
    "Scenario",
    "ScenarioError",
    "Solver",
    "StopReason",
    "Trajectory",
    "Verdict",
    "builtin",
    "find_solver",
    "minimize",
    "parse_scenario",
    "plan",
    "read_scenario",
    "result_of",
    "write_run",
]

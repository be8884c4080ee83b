"""What a user of the package imports, from ``tpbso_casadi`` itself."""

from problems import (
    OBJECTIVES,
    ConstantVelocity,
    Ellipse,
    InvalidProblem,
    Joints,
    MovingObstacle,
    Obstacle,
    Path,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Problem,
    Tabulated,
    Trajectory,
    Verdict,
    closed_curve,
    pentagram,
)
from problems.evaluation import EvaluationOptions, PopulationFunction
from solvers import (
    BSO,
    EXTERNAL,
    GA,
    IPOPT,
    LSHADE,
    PSO,
    SOLVERS,
    AdaptiveBeetleSwarm,
    AskTell,
    Budget,
    Iterations,
    Result,
    Search,
    Solver,
    StopReason,
)
from solvers import Box as SearchBox
from solvers.functions.catalogue import BENCHMARK_FUNCTIONS, BenchmarkFunction, benchmark_function
from solvers.standalone.minimize import minimize
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.planning import plan
from tpbso_casadi.facade.robots import robot
from tpbso_casadi.planning.replanning.replan import replan
from tpbso_casadi.planning.replanning.replanner import Replanner
from tpbso_casadi.planning.replanning.step import Step
from tpbso_casadi.planning.retime import retime
from tpbso_casadi.scenario.cases.builtin import builtin
from tpbso_casadi.scenario.catalogues import find_solver
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario, read_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.content import result_of
from tpbso_casadi.storage.result import RunResult
from tpbso_casadi.storage.run_folder import write_run

__all__ = [
    "BENCHMARK_FUNCTIONS",
    "BSO",
    "EXTERNAL",
    "GA",
    "IPOPT",
    "LSHADE",
    "OBJECTIVES",
    "PSO",
    "SOLVERS",
    "AdaptiveBeetleSwarm",
    "AskTell",
    "BenchmarkFunction",
    "Budget",
    "ConstantVelocity",
    "Ellipse",
    "EvaluationOptions",
    "InvalidProblem",
    "Iterations",
    "Joints",
    "MovingObstacle",
    "Obstacle",
    "Path",
    "PathFollowing",
    "Plan",
    "PlanarArm",
    "PointToPoint",
    "PopulationFunction",
    "Problem",
    "Replanner",
    "Result",
    "RunResult",
    "Scenario",
    "ScenarioError",
    "Search",
    "SearchBox",
    "Solver",
    "Step",
    "StopReason",
    "Tabulated",
    "Trajectory",
    "Verdict",
    "benchmark_function",
    "builtin",
    "closed_curve",
    "find_solver",
    "minimize",
    "parse_scenario",
    "pentagram",
    "plan",
    "read_scenario",
    "replan",
    "result_of",
    "retime",
    "robot",
    "write_run",
]

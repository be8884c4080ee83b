"""What a user of the package imports, from ``tpbso_casadi`` itself."""

from __future__ import annotations

from problems import (
    OBJECTIVES,
    Ball,
    Box,
    Capsule,
    CertificateStatus,
    ConstantVelocity,
    Cylinder,
    Ellipse,
    Ellipsoid,
    HalfSpace,
    InvalidProblem,
    Joints,
    Limit,
    Move,
    MovingObstacle,
    Objective,
    Obstacle,
    Path,
    PathFollowing,
    PlanarArm,
    PointToPoint,
    Polygon,
    Position,
    Problem,
    Rectangle,
    Robot,
    Tabulated,
    Trajectory,
    Verdict,
    closed_curve,
    pentagram,
)
from problems.evaluation import EvaluationOptions, PopulationFunction
from problems.motions import JointPath, MotionView
from problems.tasks import PathTracing, Pose, SpaceTracing
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
from solvers.functions import BENCHMARK_FUNCTIONS, BenchmarkFunction, benchmark_function
from solvers.standalone import minimize
from tpbso_casadi.facade.audit import Audit, RunAudit, ScenarioAudit
from tpbso_casadi.facade.comparing import Comparison, compare
from tpbso_casadi.facade.own import StatedConstraint as Constraint
from tpbso_casadi.facade.own import StatedCost as Cost
from tpbso_casadi.facade.plan import Plan, StoredPlan
from tpbso_casadi.facade.planning import audit, plan, read_run, replan
from tpbso_casadi.facade.retiming import retime
from tpbso_casadi.facade.robots import StatedRobot, robot
from tpbso_casadi.facade.simulating import SimulationRun, simulate
from tpbso_casadi.facade.statement import scenario_of
from tpbso_casadi.facade.trading_off import Front, pareto
from tpbso_casadi.replanning import Replanner, Step
from tpbso_casadi.scenario import Scenario, ScenarioError, find_solver, parse_scenario, read_scenario
from tpbso_casadi.scenario.cases import builtin
from tpbso_casadi.storage import InvalidRun, OutputError, RunResult, result_of, write_run

Sphere = Ball

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
    "Audit",
    "BenchmarkFunction",
    "Box",
    "Budget",
    "Capsule",
    "CertificateStatus",
    "Comparison",
    "ConstantVelocity",
    "Constraint",
    "Cost",
    "Cylinder",
    "Ellipse",
    "Ellipsoid",
    "EvaluationOptions",
    "Front",
    "HalfSpace",
    "InvalidProblem",
    "InvalidRun",
    "Iterations",
    "JointPath",
    "Joints",
    "Limit",
    "MotionView",
    "Move",
    "MovingObstacle",
    "Objective",
    "Obstacle",
    "OutputError",
    "Path",
    "PathFollowing",
    "PathTracing",
    "Plan",
    "PlanarArm",
    "PointToPoint",
    "Polygon",
    "PopulationFunction",
    "Pose",
    "Position",
    "Problem",
    "Rectangle",
    "Replanner",
    "Result",
    "Robot",
    "RunAudit",
    "RunResult",
    "Scenario",
    "ScenarioAudit",
    "ScenarioError",
    "Search",
    "SearchBox",
    "SimulationRun",
    "Solver",
    "SpaceTracing",
    "Sphere",
    "StatedRobot",
    "Step",
    "StopReason",
    "StoredPlan",
    "Tabulated",
    "Trajectory",
    "Verdict",
    "audit",
    "benchmark_function",
    "builtin",
    "closed_curve",
    "compare",
    "find_solver",
    "minimize",
    "pareto",
    "parse_scenario",
    "pentagram",
    "plan",
    "read_run",
    "read_scenario",
    "replan",
    "result_of",
    "retime",
    "robot",
    "scenario_of",
    "simulate",
    "write_run",
]

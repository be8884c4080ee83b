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
    Polytope,
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
from problems.limits import ToolOrientation, ToolRegion, ToolSpeed, Upright
from problems.motions import JointPath, MotionView
from problems.tasks import PathTracing, Pose, SpaceTracing
from solvers import (
    BENCHMARK_FUNCTIONS,
    BSO,
    EXTERNAL,
    GA,
    IPOPT,
    LSHADE,
    PSO,
    SOLVERS,
    AdaptiveBeetleSwarm,
    AskTell,
    BenchmarkFunction,
    Budget,
    Iterations,
    Result,
    Search,
    Solver,
    StopReason,
    benchmark_function,
)
from solvers import Box as SearchBox
from solvers import (
    minimize_function as minimize,
)
from tpbso_casadi.facade.audit import Audit, RunAudit, ScenarioAudit
from tpbso_casadi.facade.certifying import certify
from tpbso_casadi.facade.comparing import Comparison, compare
from tpbso_casadi.facade.own import StatedConstraint as Constraint
from tpbso_casadi.facade.own import StatedCost as Cost
from tpbso_casadi.facade.plan import Plan, StoredPlan
from tpbso_casadi.facade.planner import Planner
from tpbso_casadi.facade.planning import audit, plan, read_run, replan
from tpbso_casadi.facade.repairing import Repair, repair
from tpbso_casadi.facade.retiming import retime
from tpbso_casadi.facade.robots import StatedRobot, robot
from tpbso_casadi.facade.sequences import Along, Attach, Detach, Line, MoveTo, Output, Wait, sequence
from tpbso_casadi.facade.simulating import SimulationRun, simulate
from tpbso_casadi.facade.statement import scenario_of
from tpbso_casadi.facade.trading_off import Front, pareto
from tpbso_casadi.figures import write_run
from tpbso_casadi.replanning import Replanner, Step
from tpbso_casadi.scenario import Scenario, ScenarioError, builtin, find_solver, parse_scenario, read_scenario
from tpbso_casadi.storage import InvalidRun, OutputError, RunResult, result_of

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
    "Along",
    "AskTell",
    "Attach",
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
    "Detach",
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
    "Line",
    "MotionView",
    "Move",
    "MoveTo",
    "MovingObstacle",
    "Objective",
    "Obstacle",
    "Output",
    "OutputError",
    "Path",
    "PathFollowing",
    "PathTracing",
    "Plan",
    "PlanarArm",
    "Planner",
    "PointToPoint",
    "Polygon",
    "Polytope",
    "PopulationFunction",
    "Pose",
    "Position",
    "Problem",
    "Rectangle",
    "Repair",
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
    "ToolOrientation",
    "ToolRegion",
    "ToolSpeed",
    "Trajectory",
    "Upright",
    "Verdict",
    "Wait",
    "audit",
    "benchmark_function",
    "builtin",
    "certify",
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
    "repair",
    "replan",
    "result_of",
    "retime",
    "robot",
    "scenario_of",
    "sequence",
    "simulate",
    "write_run",
]

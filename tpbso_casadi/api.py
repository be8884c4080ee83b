"""What a user of the package imports, from ``tpbso_casadi`` itself."""

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
from problems.motions.expressions.view import MotionView
from problems.motions.joint_path import JointPath
from problems.tasks.paths.path_tracing import PathTracing
from problems.tasks.paths.space_tracing import SpaceTracing
from problems.tasks.pose import Pose
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
from tpbso_casadi.facade.auditing import audit, read_run
from tpbso_casadi.facade.comparing import compare
from tpbso_casadi.facade.own import StatedConstraint as Constraint
from tpbso_casadi.facade.own import StatedCost as Cost
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.planning import plan
from tpbso_casadi.facade.replanning import replan
from tpbso_casadi.facade.results.audit import Audit, RunAudit, ScenarioAudit
from tpbso_casadi.facade.results.comparison import Comparison
from tpbso_casadi.facade.results.front import Front
from tpbso_casadi.facade.results.stored_plan import StoredPlan
from tpbso_casadi.facade.retiming import retime
from tpbso_casadi.facade.robots import StatedRobot, robot
from tpbso_casadi.facade.statement import scenario_of
from tpbso_casadi.facade.trading_off import pareto
from tpbso_casadi.planning.replanning.replanner import Replanner
from tpbso_casadi.planning.replanning.step import Step
from tpbso_casadi.scenario.cases.builtin import builtin
from tpbso_casadi.scenario.catalogues import find_solver
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario, read_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.storage.content import result_of
from tpbso_casadi.storage.files import OutputError
from tpbso_casadi.storage.result import RunResult
from tpbso_casadi.storage.run_folder import write_run
from tpbso_casadi.storage.stored_run import InvalidRun

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
    "write_run",
]

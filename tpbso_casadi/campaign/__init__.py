"""Many runs: a grid of scenarios, solvers and seeds, on any executor, each run stored the moment it ends."""

from tpbso_casadi.campaign.executors import ExecutorError, ExecutorFactory, cluster, processes
from tpbso_casadi.campaign.grid import SolverSpec, grid, parse_solvers
from tpbso_casadi.campaign.run import Outcome, Run, run_one
from tpbso_casadi.campaign.runner import LostExecutor, run_campaign
from tpbso_casadi.campaign.store import Record, Store, StoreError

__all__ = [
    "ExecutorError",
    "ExecutorFactory",
    "LostExecutor",
    "Outcome",
    "Record",
    "Run",
    "SolverSpec",
    "Store",
    "StoreError",
    "cluster",
    "grid",
    "parse_solvers",
    "processes",
    "run_campaign",
    "run_one",
]

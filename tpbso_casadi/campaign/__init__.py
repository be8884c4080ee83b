"""Many runs: a grid of scenarios, solvers and seeds, on any executor, each run stored the moment it ends."""

from tpbso_casadi.campaign.dask_cluster import cluster
from tpbso_casadi.campaign.executors import ExecutorError, ExecutorFactory, LostExecutor, processes
from tpbso_casadi.campaign.grid import SolverSpec, grid, parse_solvers
from tpbso_casadi.campaign.record import Record
from tpbso_casadi.campaign.run import Outcome, Run, run_one
from tpbso_casadi.campaign.runner import run_campaign
from tpbso_casadi.campaign.store import Store, StoreError

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

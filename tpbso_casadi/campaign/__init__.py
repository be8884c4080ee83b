"""Many runs: a grid of scenarios, solvers and seeds, done by any executor, each run kept the moment it ends."""

from tpbso_casadi.campaign.conduct import LostExecutor, conduct
from tpbso_casadi.campaign.crew import Crew, CrewError, cluster, processes
from tpbso_casadi.campaign.grid import SolverSpec, grid, parse_solvers
from tpbso_casadi.campaign.run import Outcome, Run, perform
from tpbso_casadi.campaign.store import Record, Store, StoreError

__all__ = [
    "Crew",
    "CrewError",
    "LostExecutor",
    "Outcome",
    "Record",
    "Run",
    "SolverSpec",
    "Store",
    "StoreError",
    "cluster",
    "conduct",
    "grid",
    "parse_solvers",
    "perform",
    "processes",
]

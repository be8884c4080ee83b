"""From a scenario to a verified plan: search, refine, verify."""

from tpbso_casadi.planning.controller_rows import ACCURACY, ControllerRows
from tpbso_casadi.planning.finishing import (
    AS_FAST,
    CANDIDATES,
    POLISHED,
    SAME_PATH,
    PlannedMotion,
    Polish,
    Retiming,
    has_descents,
)
from tpbso_casadi.planning.known_motions import EarlierMotion
from tpbso_casadi.planning.motion import (
    INFEASIBLE_MERIT,
    JudgedMotion,
    alternatives,
    motion_of,
    shares_of_limits,
    torques_of,
)
from tpbso_casadi.planning.optimum import Optimum, Price, nearest_optimum
from tpbso_casadi.planning.plan import (
    RESTARTS,
    SILENT,
    bound,
    convergence,
    first_feasible,
    may_start_again,
    plan,
    step_name,
)
from tpbso_casadi.planning.planning import SharedSearches
from tpbso_casadi.planning.progress import Progress
from tpbso_casadi.planning.sequence import BOUND
from tpbso_casadi.planning.sequence_bound import SequenceBound
from tpbso_casadi.planning.sequence_graph import NoMotion, SequenceGraph, StageFailure

__all__ = [
    "ACCURACY",
    "AS_FAST",
    "BOUND",
    "CANDIDATES",
    "INFEASIBLE_MERIT",
    "POLISHED",
    "RESTARTS",
    "SAME_PATH",
    "SILENT",
    "ControllerRows",
    "EarlierMotion",
    "JudgedMotion",
    "NoMotion",
    "Optimum",
    "PlannedMotion",
    "Polish",
    "Price",
    "Progress",
    "Retiming",
    "SequenceBound",
    "SequenceGraph",
    "SharedSearches",
    "StageFailure",
    "alternatives",
    "bound",
    "convergence",
    "first_feasible",
    "has_descents",
    "may_start_again",
    "motion_of",
    "nearest_optimum",
    "plan",
    "shares_of_limits",
    "step_name",
    "torques_of",
]

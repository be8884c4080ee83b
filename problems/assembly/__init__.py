"""Everything put together: a statement, a motion, an encoding, limits and an objective make a problem."""

from problems.assembly.criteria import Criteria, joint_following
from problems.assembly.encoding import (
    CostWeights,
    Decoded,
    Encoding,
    FeasibilityFirst,
    Variable,
    limit_weight,
    paper_cost,
    paper_weights,
)
from problems.assembly.path_timing import (
    GRID_ALLOWANCE,
    Pace,
    PathTiming,
    Slowness,
    pace_of,
    slowness_of,
    step_limits,
    variables_of,
)
from problems.assembly.problem import Model, Problem, objective_named
from problems.assembly.sample_loop import PLACES, CostSteps, peak_loop, statements_of

__all__ = [
    "GRID_ALLOWANCE",
    "PLACES",
    "CostSteps",
    "CostWeights",
    "Criteria",
    "Decoded",
    "Encoding",
    "FeasibilityFirst",
    "Model",
    "Pace",
    "PathTiming",
    "Problem",
    "Slowness",
    "Variable",
    "joint_following",
    "limit_weight",
    "objective_named",
    "pace_of",
    "paper_cost",
    "paper_weights",
    "peak_loop",
    "slowness_of",
    "statements_of",
    "step_limits",
    "variables_of",
]

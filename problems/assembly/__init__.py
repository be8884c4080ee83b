"""Everything put together: a statement, a motion, an encoding, limits and an objective make a problem."""

from problems.assembly.certificate import certificate_of, check_certifiable
from problems.assembly.criteria import Criteria, MotionStage, joint_following, recorded_motion
from problems.assembly.decoded_steps import DecodedSteps
from problems.assembly.direct import Approach, DirectPlanner
from problems.assembly.encoding import (
    LARGEST_TIME_SCALE,
    Decoded,
    Encoding,
    FeasibilityFirst,
    PaperCost,
    SearchedTimeScale,
    Variable,
)
from problems.assembly.path_timing import GRID_ALLOWANCE, LocalTimeScale, PathTiming, step_limits
from problems.assembly.problem import Model, Problem, objective_named
from problems.assembly.sample_loop import PLACES, CostSteps, peak_loop, statements_of
from problems.assembly.sequence import SequenceCriteria

__all__ = [
    "GRID_ALLOWANCE",
    "LARGEST_TIME_SCALE",
    "PLACES",
    "Approach",
    "CostSteps",
    "Criteria",
    "Decoded",
    "DecodedSteps",
    "DirectPlanner",
    "Encoding",
    "FeasibilityFirst",
    "LocalTimeScale",
    "Model",
    "MotionStage",
    "PaperCost",
    "PathTiming",
    "Problem",
    "SearchedTimeScale",
    "SequenceCriteria",
    "Variable",
    "certificate_of",
    "check_certifiable",
    "joint_following",
    "objective_named",
    "peak_loop",
    "recorded_motion",
    "statements_of",
    "step_limits",
]

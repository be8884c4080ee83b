"""The paper's second motion: a path of the tool passed at equal times, by splines through knots of joint angles."""

from problems.families.knots.encoding import KnotPostures, PathEncoding, largest_values
from problems.families.knots.problem import PathFollowingProblem, path_following, posture_steps

__all__ = ["KnotPostures", "PathEncoding", "PathFollowingProblem", "largest_values", "path_following", "posture_steps"]

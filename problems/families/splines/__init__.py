"""Moves by splines of degree 5: the shape is searched, the timing follows from the limits."""

from problems.families.splines.direct import MovePlanner, move_planner
from problems.families.splines.encoding import selected
from problems.families.splines.path_problem import MoveSteps, SplineProblem
from problems.families.splines.pieces import node_times
from problems.families.splines.problem import MoveProblem, move
from problems.families.splines.program import MoveNlp
from problems.families.splines.starts import PassedMotion

__all__ = [
    "MoveNlp",
    "MovePlanner",
    "MoveProblem",
    "MoveSteps",
    "PassedMotion",
    "SplineProblem",
    "move",
    "move_planner",
    "node_times",
    "selected",
]

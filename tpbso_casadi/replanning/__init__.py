"""Planning again and again while the arm is moving."""

from tpbso_casadi.replanning.candidates import Step
from tpbso_casadi.replanning.replanner import EVALUATION_RATE, FEWEST_EVALUATIONS, MOST_EVALUATIONS, Replanner, replan

__all__ = ["EVALUATION_RATE", "FEWEST_EVALUATIONS", "MOST_EVALUATIONS", "Replanner", "Step", "replan"]

"""Planning again and again while the arm is moving."""

from tpbso_casadi.replanning.candidates import Step
from tpbso_casadi.replanning.replanner import Replanner, replan

__all__ = ["Replanner", "Step", "replan"]

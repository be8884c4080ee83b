"""Objectives: execution time (8), joint rotation (9), travel length of the tip (10); ours: energy and work."""

from problems.objectives.catalogue import Energy, ExecutionTime, JointRotation, TipTravel, Work
from problems.objectives.expression import ExpressionObjective
from problems.objectives.integrals import Integrand
from problems.objectives.objective import DirectMoves, MotionBounds, Objective, WeightedSum

OBJECTIVES: dict[str, Objective] = {
    objective.name: objective for objective in (ExecutionTime(), JointRotation(), TipTravel(), Energy(), Work())
}

__all__ = [
    "OBJECTIVES",
    "DirectMoves",
    "ExpressionObjective",
    "Integrand",
    "MotionBounds",
    "Objective",
    "WeightedSum",
]

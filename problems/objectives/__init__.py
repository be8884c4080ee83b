"""Objectives: execution time (8), joint rotation (9), travel length of the tip (10); ours: energy and work."""

from problems.objectives.energy import Energy
from problems.objectives.length import TipTravel
from problems.objectives.objective import MotionBounds, Objective
from problems.objectives.rotation import JointRotation
from problems.objectives.time import ExecutionTime
from problems.objectives.weighted_sum import WeightedSum
from problems.objectives.work import Work

OBJECTIVES: dict[str, Objective] = {
    objective.name: objective for objective in (ExecutionTime(), JointRotation(), TipTravel(), Energy(), Work())
}

__all__ = [
    "OBJECTIVES",
    "Energy",
    "ExecutionTime",
    "JointRotation",
    "MotionBounds",
    "Objective",
    "TipTravel",
    "WeightedSum",
    "Work",
]

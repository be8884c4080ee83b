"""Objectives: execution time (8), joint rotation (9), travel length of the tip (10)."""

from problems.objectives.length import TipTravel
from problems.objectives.objective import MotionBounds, Objective
from problems.objectives.rotation import JointRotation
from problems.objectives.time import ExecutionTime

OBJECTIVES: dict[str, Objective] = {
    objective.name: objective for objective in (ExecutionTime(), JointRotation(), TipTravel())
}

__all__ = ["OBJECTIVES", "ExecutionTime", "JointRotation", "MotionBounds", "Objective", "TipTravel"]

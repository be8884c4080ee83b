"""Motions among obstacles: paths are found, polished by sequential programs and proven; lower bounds."""

from problems.polish.descent import DeviationPolish
from problems.polish.deviation import Deviations
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.free_ends import FreeEnd, with_better_ends
from problems.polish.goals import in_nearest_turns, postures_around
from problems.polish.guarded import Draft, fastest_guarded
from problems.polish.nearby import faster_nearby
from problems.polish.objective import IntegrandFunctions, PolishObjective
from problems.polish.passages import Passages, postures_on_the_way
from problems.polish.refinement import PathRefinement, deviations_from_rest, joint_box, never, programs_know
from problems.polish.rephasing import at_the_bound, everywhere
from problems.polish.samples import PolishSamples
from problems.polish.settings import (
    DEFAULT_GUARDED,
    DeviationSettings,
    ExpressionSettings,
    FreeEndsSettings,
    NearbySettings,
    ObjectiveSettings,
    PassageSettings,
    PolishSettings,
    RefinementSettings,
    RephasingSettings,
)
from problems.polish.spline import PIECES
from problems.polish.torques import JointTorques

__all__ = [
    "DEFAULT_GUARDED",
    "PIECES",
    "DeviationPolish",
    "DeviationSettings",
    "Deviations",
    "Draft",
    "ExpressionLimits",
    "ExpressionSettings",
    "FreeEnd",
    "FreeEndsSettings",
    "IntegrandFunctions",
    "JointTorques",
    "NearbySettings",
    "ObjectiveSettings",
    "PassageSettings",
    "Passages",
    "PathRefinement",
    "PolishObjective",
    "PolishSamples",
    "PolishSettings",
    "RefinementSettings",
    "RephasingSettings",
    "at_the_bound",
    "deviations_from_rest",
    "everywhere",
    "faster_nearby",
    "fastest_guarded",
    "in_nearest_turns",
    "joint_box",
    "never",
    "postures_around",
    "postures_on_the_way",
    "programs_know",
    "with_better_ends",
]

"""Motions among obstacles: paths are found, polished by sequential programs and proven; lower bounds."""

from problems.polish.descent import DeviationPolish
from problems.polish.deviation import Deviations, Rates
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.goals import postures_around
from problems.polish.nearby import faster_nearby
from problems.polish.objective import IntegrandFunctions, PolishObjective
from problems.polish.passages import Passages, postures_on_the_way
from problems.polish.pinned import fastest_pinned
from problems.polish.refinement import PathRefinement, gentler_limits, joint_box
from problems.polish.rephasing import at_the_bound, everywhere
from problems.polish.samples import PolishSamples
from problems.polish.settings import (
    DeviationSettings,
    ExpressionSettings,
    NearbySettings,
    ObjectiveSettings,
    PassageSettings,
    PolishSettings,
    RefinementSettings,
    RephasingSettings,
)
from problems.polish.spline import PIECES

__all__ = [
    "PIECES",
    "DeviationPolish",
    "DeviationSettings",
    "Deviations",
    "ExpressionLimits",
    "ExpressionSettings",
    "IntegrandFunctions",
    "NearbySettings",
    "ObjectiveSettings",
    "PassageSettings",
    "Passages",
    "PathRefinement",
    "PolishObjective",
    "PolishSamples",
    "PolishSettings",
    "Rates",
    "RefinementSettings",
    "RephasingSettings",
    "at_the_bound",
    "everywhere",
    "faster_nearby",
    "fastest_pinned",
    "gentler_limits",
    "joint_box",
    "postures_around",
    "postures_on_the_way",
]

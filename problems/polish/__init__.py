"""Motions among obstacles, what costs least first: direct, at a bound, polished from ways that were found."""

from problems.polish.climb import GOOD_ENOUGH, Climb, gentler, joint_box
from problems.polish.descent import DeviationPolish
from problems.polish.deviation import Deviations, Rates
from problems.polish.goals import postures_around
from problems.polish.minimised import Integrals, Minimised
from problems.polish.nearby import faster_nearby
from problems.polish.own_limits import OwnLimits
from problems.polish.passages import Passages, postures_on_the_way
from problems.polish.rephasing import at_the_bound, everywhere
from problems.polish.spline import PIECES

__all__ = [
    "GOOD_ENOUGH",
    "PIECES",
    "Climb",
    "DeviationPolish",
    "Deviations",
    "Integrals",
    "Minimised",
    "OwnLimits",
    "Passages",
    "Rates",
    "at_the_bound",
    "everywhere",
    "faster_nearby",
    "gentler",
    "joint_box",
    "postures_around",
    "postures_on_the_way",
]

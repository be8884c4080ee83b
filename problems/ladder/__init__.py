"""Motions among obstacles, what costs least first: direct, at a bound, polished from ways that were found."""

from problems.ladder.climb import GOOD_ENOUGH, Climb, gentler, joint_box
from problems.ladder.descent import DeviationPolish
from problems.ladder.deviation import Deviations, Rates
from problems.ladder.goals import postures_around
from problems.ladder.minimised import Integrals, Minimised
from problems.ladder.nearby import faster_nearby
from problems.ladder.own_limits import OwnLimits
from problems.ladder.passages import Passages, postures_on_the_way
from problems.ladder.rephasing import at_the_bound, everywhere
from problems.ladder.spline import PIECES

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

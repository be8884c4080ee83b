"""The settings of retiming: one frozen dataclass for each algorithm, with the values that are used by default.

A default is chosen unless its field names where it was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from problems.core import TrustRegion

LAW_REGION = TrustRegion(
    first=0.3, least=2.5e-4, largest=2.0, growth=2.0, shrinkage=1.0, rejection=0.25, good=0.0, poor=0.0,
    patience=1, least_gain=3e-4, least_promise=-np.inf,
)  # shares of the distance of a control point to its neighbours; a program may promise a slower law  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TorqueCurveSettings:
    """Settings of the dynamics along a path as polynomials.

    Args:
        nodes: values through which one polynomial is drawn.
        travel: rad or m that a joint turns, at most, while one polynomial holds.
        fewest_polynomials: for each piece of the path.
        travel_samples: of a piece, to measure how far its joints turn.
        margin: share of every torque limit that is kept for the proof and for what lies between samples.
        least_left: share of a limit that counts as left, at least, where friction takes all of it.
    """

    nodes: int = 7
    travel: float = 0.15
    fewest_polynomials: int = 2
    travel_samples: int = 9
    margin: float = 1e-4
    least_left: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class ProfileSettings:
    """Settings of the fastest profile of the path's speed on a grid.

    Args:
        intervals_per_piece: of the grid, for each piece of the path.
        fewest_intervals: of a grid.
        enough_intervals: of a grid in which joints could hardly come to full speed; with more of them lines of the tool
            become 0.03 % faster, and with 400 of them 0.04 % slower.
        intervals_per_rise: for each time that a joint could come to its full speed, where that asks for more.
        most_intervals: of a grid, unless it has so many pieces that ``least_in_piece`` asks for more.
        least_in_piece: intervals in each piece.
        rough_share: share of the intervals for a profile from which a search begins.
        first_share: share of the intervals in the first grid, which is even in the parameter.
        graded_intervals: intervals at an end where q' is zero that are replaced by shorter ones.
        grading: shorter intervals for each of them.
        steady_jerk: share of a jerk limit that a path may need where its speed is steady.
        most_viscous: share of the rest of a torque limit that viscous friction takes, at most, where b is zero.
        viscous_rounds: programs on the last grid where viscous friction makes torques curved in the squares.
        margin: share of every limit, where nothing can be slowed afterwards: more than the program's own tolerance.
        unbounded: times the largest bound of nearby squares, for a square that its own rows do not bound.
        neighbours: nodes on either side that count as nearby; a path may be a million times slower there.
    """

    intervals_per_piece: int = 40
    fewest_intervals: int = 400
    enough_intervals: int = 800
    intervals_per_rise: float = 20.0
    most_intervals: int = 4000
    least_in_piece: int = 4
    rough_share: float = 0.4
    first_share: float = 0.25
    graded_intervals: int = 16
    grading: int = 4
    steady_jerk: float = 0.5
    most_viscous: float = 0.5
    viscous_rounds: int = 3
    margin: float = 1e-9
    unbounded: float = 1e4
    neighbours: int = 20


@dataclass(frozen=True, kw_only=True)
class LawSettings:
    """Settings of the search for a smooth time law by sequential linear programs.

    Args:
        region: of the control points, shares of the distance to their neighbours; any gain lets it grow.
        programs: of one search, at most.
        samples: of each interval between knots, in a program.
        judging_samples: of each interval, by which a law is judged.
        even_share: share of an even law in every law, so that none stands still.
        excess_price: per cent of the duration that one per cent of excess of a limit counts.
        margin_growth: share of the duration over which margins grow from nothing next to a given velocity.
        intervals_per_rise: between knots, for each time that a joint could come to its full speed. With three times as
            many, lines of the tool take as long, within 0.1 %; paths through many waypoints need no more.
        intervals_per_piece: between knots, for each piece of the path, at most.
        fewest_intervals: of a law; with 100 of them lines of the tool take 0.1 % longer, one 1 %, with 200 no less.
        most_intervals: of a law; with half of them a path through 300 waypoints takes 3 % longer.
        intervals_in_piece: in one piece of the path, about, unless there are too many; 8 make no motion faster.
        knot_grid: points at which lengths of intervals are computed.
        knot_grading: how much intervals grow with the distance from a short piece.
        shortest_interval: share of the duration.
        far: times the profile's duration; a law that takes longer is improved with fewer intervals first.
        coarser: times fewer intervals of such a law.
        swings: widths of moving averages of a profile, in times that accelerations need.
        following_swings: widths of those that follow a given profile with little slowing.
        margins: shares of limits at samples that are tried in turn, where nothing can be slowed.
        most_closing: share of their distance by which control points may approach in one step.
        largest_change: share of the duration, in one step.
        considered: share of a limit from which on a row is in a program from the start.
        newly_active: share of a limit, below it, from which on a row joins a program that broke another; where ends
            move, fewer rows at once (-0.02, then all) found no motion along 11 of 24 random paths.
        broken: share of a limit by which a row counts as broken.
        row_price: merit of an excess, in shares of the duration and of the limit.
        row_rounds: programs of one step, at most.
    """

    region: TrustRegion = LAW_REGION
    programs: int = 25
    samples: int = 4
    judging_samples: int = 8
    even_share: float = 1e-7
    excess_price: float = 20.0
    margin_growth: float = 0.1
    intervals_per_rise: float = 20.0
    intervals_per_piece: int = 24
    fewest_intervals: int = 160
    most_intervals: int = 3000
    intervals_in_piece: int = 2
    knot_grid: int = 4000
    knot_grading: float = 0.4
    shortest_interval: float = 1e-5
    far: float = 1.1
    coarser: int = 4
    swings: tuple[float, ...] = (1.0, 2.0, 4.0)
    following_swings: tuple[float, ...] = (1.0, 2.0, 3.0, 5.0)
    margins: tuple[float, ...] = (1e-3, 4e-3, 1.6e-2, 6.4e-2)
    most_closing: float = 0.9
    largest_change: float = 0.2
    considered: float = 0.6
    newly_active: float = -0.3
    broken: float = 1e-6
    row_price: float = 20.0
    row_rounds: int = 6


@dataclass(frozen=True, kw_only=True)
class RetimingSettings:
    """Settings of the least time along a path.

    Args:
        torques: of the dynamics along the path.
        profile: of the speed without jerk limits.
        law: of the time law with jerk limits.
        line_samples: of a move along a line, by which its torques are judged.
    """

    torques: TorqueCurveSettings = TorqueCurveSettings()
    profile: ProfileSettings = ProfileSettings()
    law: LawSettings = LawSettings()
    line_samples: int = 2_000


DEFAULT_TORQUE_CURVE = TorqueCurveSettings()
DEFAULT_RETIMING = RetimingSettings()
STEADY_RETIMING = RetimingSettings(law=LawSettings(fewest_intervals=320, intervals_per_piece=48))
# of a steady speed of the tool: along 24 lines of a Panda it is reached after 0.84 of the time that half as many
# intervals need, and left by 2 % nowhere in between (by 2.6 % at worst)


@dataclass(frozen=True, kw_only=True)
class ThroughSettings:
    """Settings of the search for the fastest motion through postures.

    Args:
        first_cells: of each segment, equal ones.
        halved_cells: of each segment, in a level.
        levels: at most; where accelerations change in 2 ms, as a Panda's may, eight come within 0.1 % of no jerk limit.
        worthwhile: share of the duration that a level has to gain so that another one follows.
        most_postures: for which a motion is searched; its time grows with their cube, 6 s for 300 of a Panda.
        most_cells: of all segments, unless the first level has more.
        slower: factor of the least durations of motions that stop everywhere, from which the first level begins.
        slower_again: factor of the durations from which the next level begins.
        price: shares of the duration for an excess over all limits, of motions from rest to rest.
        moving_price: the same where an end moves, and no longer duration mends an excess.
        speed_shares: shares of a cell where speeds are limited.
        corrections: motions that are tried until one keeps its limits, where no longer duration mends an excess.
        reserve: times an excess by which the next of them keeps more of a limit.
        least_reserve: share of a limit that the next of them keeps more, at least.
        reserve_rises: share of a segment, next to a place at the end of a range, in which the reserve rises.
    """

    first_cells: int = 8
    halved_cells: int = 8
    levels: int = 8
    worthwhile: float = 3e-4
    most_postures: int = 300
    most_cells: int = 800
    slower: float = 1.2
    slower_again: float = 1.02
    price: float = 5.0
    moving_price: float = 50.0
    speed_shares: tuple[float, ...] = (0.0, 0.25, 0.5, 0.75)
    corrections: int = 5
    reserve: float = 1.5
    least_reserve: float = 2e-4
    reserve_rises: float = 0.25


DEFAULT_THROUGH = ThroughSettings()


@dataclass(frozen=True, kw_only=True)
class ThroughBoundSettings:
    """Settings of the lower bound of motions through postures.

    Args:
        intervals: numbers of intervals of velocity from one limit to the other: with the first one weights are
            searched, and then improved with the largest whose graph is small enough.
        most_edges: of the second graph, of all joints and segments.
        steps: of the weights with the first number of intervals, and with the second.
        first_step: of the logarithm of a weight, for a segment's excess in shares of the mean segment.
        settling: steps after which one is half as long.
    """

    intervals: tuple[int, ...] = (16, 24, 32, 48, 64, 96)
    most_edges: int = 150_000
    steps: tuple[int, int] = (120, 15)
    first_step: float = 1.0
    settling: float = 20.0

    def levels(self, parts: int) -> tuple[tuple[int, int], ...]:
        """The numbers of intervals, and of steps, for so many segments times joints."""
        finer = [count for count in self.intervals[1:] if parts * count**2 <= self.most_edges]
        return tuple(zip((self.intervals[0], *finer[-1:]), self.steps, strict=False))


DEFAULT_THROUGH_BOUND = ThroughBoundSettings()

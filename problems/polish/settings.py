"""The settings of the polish: one frozen dataclass for each algorithm, with the values that are used by default.

A default is chosen unless its field names where it was measured; ``benchmarks/motion_bench_maker`` shows what another
one changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from problems.core import TrustRegion
from problems.timing import ThroughSettings

AMONG_OBSTACLES = ThroughSettings(first_cells=16, levels=8, most_cells=240)
CONTROL_POINT_REGION = TrustRegion(
    first=0.25, least=2e-3, largest=0.4, growth=2.0, shrinkage=0.35, rejection=0.35, good=0.6, poor=0.15,
    patience=2, least_gain=3e-4, least_promise=3e-5,
)  # rad  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class DeviationSettings:
    """Settings of the motions that deviate from a direct one.

    Args:
        speed_rows: speeds that are bounded in each part of one cubic, at its end and between.
        moving_speed_rows: speeds that are bounded there where an end moves, and no longer duration mends an excess.
        allowance: share of the direct duration by which a motion between moving ends may be faster.
        known_speed_rows: speeds that are bounded there where a known motion is deviated from, whose parts are short.
        duration_steps: longer durations of a motion between moving ends that are tried until it keeps its limits.
        least_step: share of the duration by which the first of them is longer.
        largest_step: share of the duration by which the last of them is longer.
        largest_correction: share of the duration by which a finished motion may be longer than its program said.
        smoothing: pieces of the smoothed known motion for each piece of the deviation.
    """

    speed_rows: int = 4
    moving_speed_rows: int = 12
    known_speed_rows: int = 1
    allowance: float = 1e-5
    duration_steps: int = 25
    least_step: float = 1e-6
    largest_step: float = 10.0
    largest_correction: float = 1e-3
    smoothing: int = 10


@dataclass(frozen=True, kw_only=True)
class ObjectiveSettings:
    """Settings of the quadratic model of an objective.

    Args:
        convexity: share of the largest second derivative below which another counts as zero.
        weight_of_time: s of the merit for each s of the duration, where the objective does not depend on it.
        corner: share of the mean length of a vector; shorter vectors count as that long, so that weights stay finite.
        lateness_price: s of the merit for each s beyond the longest duration.
        most_saved: share of the duration that one program may save.
        most_added: share of the duration that one program may add.
        duration_trust: 1/rad, share of a chosen duration that may change for each rad that control points may move.
        compared_durations: durations that are compared in one pass of the search for the best.
        duration_passes: passes of that search, each between the neighbours of the best.
    """

    convexity: float = 1e-9
    weight_of_time: float = 1e-3
    corner: float = 1e-2
    lateness_price: float = 3.0
    most_saved: float = 0.4
    most_added: float = 1.0
    duration_trust: float = 2.0
    compared_durations: int = 16
    duration_passes: int = 2


@dataclass(frozen=True, kw_only=True)
class ExpressionSettings:
    """Settings of bounds on expressions as rows of programs.

    Args:
        margin: share of a limit's scale that is kept at samples.
        small_length: m or rad; a length with a smaller bound also has planes that touch its ball.
        plane_margin: share of the length that is kept of these planes, so that what they leave lies in the ball.
        most_components: components of a length, at most, that has planes.
        share_at_ends: share of the distance of the ends from a limit that may be kept as a margin.
        projection_steps: steps of a projection of postures, at most.
        projection_tolerance: share of the scale; a posture that misses less is projected.
        longest_step: rad or m; no joint goes farther in a step of a projection.
        damping: share of the trace; it keeps a step finite where joints do not matter.
    """

    margin: float = 0.01
    small_length: float = 0.05
    plane_margin: float = 0.2
    most_components: int = 3
    share_at_ends: float = 0.8
    projection_steps: int = 30
    projection_tolerance: float = 1e-3
    longest_step: float = 0.2
    damping: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class PassageSettings:
    """Settings of places that are passed on the way.

    Args:
        price: s/m or s/rad, what a program pays for missing a place.
        most_later: share of the duration by which one step may change when a place is passed.
        least_sideways: share of the accuracy that is left, at least, to sides to which a place is not missed.
        nearest_steps: Newton steps to the parameter where a motion is nearest to a place.
        inner_share: share of the accuracy within which the exact motion passes.
        exact_steps: Newton steps of the exact motion, at most.
        line_postures: postures of the straight line of the joints that are compared with places.
    """

    price: float = 30.0
    most_later: float = 0.02
    least_sideways: float = 0.3
    nearest_steps: int = 8
    inner_share: float = 1.0 - 1e-6
    exact_steps: int = 30
    line_postures: int = 101


@dataclass(frozen=True, kw_only=True)
class PolishSettings:
    """Settings of the descent by sequential programs.

    Args:
        region: of the control points, rad.
        programs: programs of one descent, at most.
        at_bound: times the lower bound; a clear motion that is as good ends the descent.
        hopeless: times the merit to beat; a descent that is still worse after ``hopeless_after`` programs ends.
        hopeless_after: programs.
        clearance_price: s/m, what a program pays for clearance that is missing.
        torque_price: s for each multiple of a torque's limit by which it exceeds that.
        range_price: s/rad, what a motion pays for angles outside the range.
        expression_price: s for each multiple of a limit's scale by which an expression exceeds that.
        approach: m/rad, how much nearer bodies come at most for each rad that control points move.
        enough_margin: share of the margin; a motion that keeps as much at all samples is clear.
        torque_samples: in each piece, besides the parameters where accelerations may be extreme.
        torque_tolerance: share of the limit by which torques between samples may exceed it without a repair.
        torque_threshold: share of the limit; torques are in programs if one somewhere is larger.
        proof_samples: postures in each piece that are examined between the samples of programs.
        proof_share: share of the margin; a motion that keeps less between samples is repaired there.
        expression_proof_share: share of the margin of expressions that a motion has to keep between samples.
        most_repairs: parameters, at most, that one repair adds for each kind of limit.
        inner_range: share of the ends' distance from a joint's range by which the range is made smaller.
        most_inner_range: rad, the most by which it is made smaller.
        repaired_range: rad, by which ranges are smaller at parameters that a repair added.
        range_tolerance: rad, by which an angle may leave the smaller range without counting.
        range_recovery: share of what a step can reach that it has to bring an angle back into the range.
        expression_threshold: share of the scale; expressions that depend on velocity count from there on.
    """

    region: TrustRegion = CONTROL_POINT_REGION
    programs: int = 25
    at_bound: float = 1.0005
    hopeless: float = 1.3
    hopeless_after: int = 5
    clearance_price: float = 30.0
    torque_price: float = 3.0
    range_price: float = 3.0
    expression_price: float = 3.0
    approach: float = 0.35
    enough_margin: float = 0.5
    torque_samples: int = 2
    torque_tolerance: float = 3e-4
    torque_threshold: float = 0.9
    proof_samples: int = 48
    proof_share: float = 0.25
    expression_proof_share: float = 0.25
    most_repairs: int = 24
    inner_range: float = 0.5
    most_inner_range: float = 0.01
    repaired_range: float = 3e-5
    range_tolerance: float = 1e-5
    range_recovery: float = 0.5
    expression_threshold: float = 0.5


@dataclass(frozen=True, kw_only=True)
class RefinementSettings:
    """Settings of the search for the best motion among paths that are found, polished and proven.

    Args:
        polish: of each descent.
        proof_margin: m, kept of obstacles at samples, so that the motion is clear between them.
        own_proof_margin: m, kept of the robot's own links.
        share_at_ends: share of the clearance at the ends that may be kept as a margin.
        margin_growth: factor of the margins where a proof fails and no sample shows why.
        repairs: repairs of one motion, at most.
        first_programs: programs of the first descent from a path.
        more_programs: programs of a descent after a repair.
        limit_reserve: share of the limits of joints and motors that is kept for the last correction.
        limit_reserve_growth: factor of that reserve where it was too small.
        largest_limit_reserve: share above which the reserve grows no more.
        longest_correction: times the duration; a correction that makes a motion longer had too little reserve.
        torque_tolerance: share of the time scale kept for torques between samples.
        exact_passage_price: s/m or s/rad, price of missed places before they are passed exactly.
        duration_steps: corrections of a motion between moving ends, at most, until its duration no longer changes.
        paths: tried besides the straight one, where one has led to a motion.
        rounds: of all times of arrival that paths are tried for, at least, where a searched motion is polished.
        most_paths: tried where none has.
        other_goal_paths: tried where only a motion to another goal is known.
        most_failures: searches for a path that may fail before there is probably none.
        agreeing_paths: paths of about the same merit after which no other is tried.
        near_optimal: ratio of merits that are about the same.
        near_bound: ratio to the lower bound of a merit that needs no other path.
        path_digits: decimal digits of control points in rad that equal paths have in common.
        bend: rad, the standard deviation of how far a path is bent sideways.
        examined_times: of a motion whose torques are examined.
        end_share: share of the duration at either end in which torques decide on gentler limits.
        gentlest_scale: largest time scale of gentler limits.
        arrival_growth: factor from one time of arrival that is tried to the next, among moving obstacles.
        latest_arrival: times the lower bound of the duration; the last arrival that is tried.
        latest_first_arrival: s, the last arrival that is tried where the goal was never clear before.
    """

    polish: PolishSettings = PolishSettings()
    proof_margin: float = 3e-3
    own_proof_margin: float = 1e-3
    share_at_ends: float = 0.8
    margin_growth: float = 1.5
    repairs: int = 6
    first_programs: int = 25
    more_programs: int = 6
    limit_reserve: float = 1e-3
    limit_reserve_growth: float = 4.0
    largest_limit_reserve: float = 0.05
    longest_correction: float = 1.2
    torque_tolerance: float = 1e-4
    exact_passage_price: float = 1000.0
    duration_steps: int = 10
    paths: int = 10
    rounds: int = 3
    most_paths: int = 40
    other_goal_paths: int = 3
    most_failures: int = 4
    agreeing_paths: int = 2
    near_optimal: float = 1.002
    near_bound: float = 1.002
    path_digits: int = 6
    bend: float = 0.7
    examined_times: int = 200
    end_share: float = 0.1
    gentlest_scale: float = 2.0
    arrival_growth: float = 1.25
    latest_arrival: float = 5.0
    latest_first_arrival: float = 60.0

    def beginning_with(self, step: float) -> RefinementSettings:
        """The settings whose descents begin with a trust region of so many rad at most."""
        region = replace(self.polish.region, first=min(step, self.polish.region.first))
        return replace(self, polish=replace(self.polish, region=region))


@dataclass(frozen=True, kw_only=True)
class NearbySettings:
    """Settings of faster motions near a known one.

    Args:
        refinement: of the deviation.
        path_points: points of the path that is timed anew, the next number where a limit is broken.
        times_per_point: times of the motion for each of them, by which arc length is measured.
        worth_timing: share of the known duration; a motion that takes longer is not timed anew.
    """

    refinement: RefinementSettings = RefinementSettings()
    path_points: tuple[int, ...] = (65, 257)
    times_per_point: int = 50
    worth_timing: float = 0.99


@dataclass(frozen=True, kw_only=True)
class RephasingSettings:
    """Settings of motions that are as fast as the direct one.

    Args:
        draws: motions that are drawn at random, for all ends together.
        pairs: postures at both ends that are tried, at most.
        fastest_share: share of the draws in which a joint runs as fast as it can, or waits only before or after.
    """

    draws: int = 500
    pairs: int = 5
    fastest_share: float = 0.5


@dataclass(frozen=True, kw_only=True)
class GuardedSettings:
    """Settings of the fastest motions past obstacles near a known one.

    Args:
        through: settings of motions through postures; cells are as many as distances need.
        margin: clearance on top of the margins, m.
        share_at_places: of what places have, where that is less.
        margin_growth: of that clearance, where a motion is not proven.
        attempts: with more clearance each.
        programs: in a row on one grid.
        radius: by which angles may change in the first of them, rad.
        later_radius: the same on a finer grid, and where more samples have joined, rad.
        shrinking: of that radius, after a program that made things worse.
        least_radius: below which the search ends, rad.
        most_asked: share of what angles can change in an excess, by which a program is asked to make it smaller.
        torque_share: of their limits that torques keep at samples.
        near: share of a limit below it from which programs know torques and expressions.
        samples_per_cell: in which distances, torques and expressions are kept.
        proof_samples_per_cell: in which they are examined at last; where they are broken, samples join the others.
        allowed_share: of a margin that may be lacking there.
        least_range: of an angle, rad.
        reach: clearance of the pairs that programs know, and that which counts as much as all of a limit, m.
        most_guards: rows of distances, the nearest of all.
        price: shares of the duration that so much too little clearance costs.
        most_lacking: share of the reach that is lacking on the first grid, above which a draft is given up.
        worthwhile: share of the duration that a program has to gain so that another one follows.
        draft_samples: postures of each segment of a draft.
        ways: paths past obstacles that are tried, besides the fastest motion without obstacles.
        near_bound: times the duration of that, below which neither another path is tried nor the polish as well.
    """

    through: ThroughSettings = AMONG_OBSTACLES
    margin: float = 2e-3
    share_at_places: float = 0.5
    margin_growth: float = 2.0
    attempts: int = 2
    programs: int = 16
    radius: float = 0.2
    later_radius: float = 0.05
    shrinking: float = 0.35
    least_radius: float = 1e-3
    most_asked: float = 0.5
    torque_share: float = 0.998
    near: float = 0.25
    samples_per_cell: int = 2
    proof_samples_per_cell: int = 8
    allowed_share: float = 0.5
    least_range: float = 1e-6
    reach: float = 0.05
    most_guards: int = 150
    price: float = 0.5
    most_lacking: float = 0.1
    worthwhile: float = 3e-4
    draft_samples: int = 100
    ways: int = 2
    near_bound: float = 1.02


@dataclass(frozen=True, kw_only=True)
class FreeEndsSettings:
    """Settings of the search for better postures at the ends.

    Args:
        first_step: rad, of the first change of a posture.
        least_step: rad, below which the search ends.
        shrinkage: of the step, where no change is better.
        rank_tolerance: share of the largest singular value of a place's Jacobian; smaller ones count as zero.
    """

    first_step: float = 0.3
    least_step: float = 0.02
    shrinkage: float = 0.4
    rank_tolerance: float = 1e-7


DEFAULT_DEVIATION = DeviationSettings()
DEFAULT_OBJECTIVE = ObjectiveSettings()
DEFAULT_EXPRESSIONS = ExpressionSettings()
DEFAULT_PASSAGES = PassageSettings()
DEFAULT_POLISH = PolishSettings()
DEFAULT_REFINEMENT = RefinementSettings()
DEFAULT_NEARBY = NearbySettings()
DEFAULT_REPHASING = RephasingSettings()
DEFAULT_FREE_ENDS = FreeEndsSettings()
DEFAULT_GUARDED = GuardedSettings()

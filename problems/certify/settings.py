"""The settings of proofs: one frozen dataclass for each algorithm, with the values that are used by default.

No setting makes a proof false: they decide how long one is tried, and how sharp its bounds are. A default is chosen
unless its field names where it was measured.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class ApproachSettings:
    """Settings of the closest approach.

    Args:
        times: at least, at which all pairs are evaluated.
        candidates: minima that are followed to the bottom, the deepest ones.
        minima_per_pair: of these, at most.
        zooms: passes around the time of a minimum, each sixteen times finer.
        zoom_points: times in each pass.
    """

    times: int = 400
    candidates: int = 6
    minima_per_pair: int = 2
    zooms: int = 4
    zoom_points: int = 33


@dataclass(frozen=True, kw_only=True)
class IntervalSettings:
    """Settings of the proof of any limit by interval arithmetic.

    Args:
        first_times: at which limits are evaluated before the proof.
        initial_cells: of time, at least.
        most_intervals: that are computed, operations times cells.
        fewest_cells: that are bounded, however long an expression is.
        most_cells: that are bounded, however short it is.
        cells_at_once: that are bounded together.
    """

    first_times: int = 401
    initial_cells: int = 64
    most_intervals: int = 60_000_000
    fewest_cells: int = 4_000
    most_cells: int = 60_000
    cells_at_once: int = 4_096


@dataclass(frozen=True, kw_only=True)
class TorqueProofSettings:
    """Settings of the proof of torques, and of the time scale at which it succeeds.

    Args:
        initial_cells: of time, at least.
        most_cells: beyond those that the pieces need.
        proof_gap: share of the largest torque seen by which the proven one may be larger.
        least_share: share of a limit; smaller torques need not be bounded any closer.
        first_times: of the motion whose time scale is sought.
        rounds: proofs of slower motions, at most.
        first_step: relative; added to the time scale where no time is seen to be broken and nothing is proven.
        least_left: share of a limit that gravity and friction have to leave.
    """

    initial_cells: int = 24
    most_cells: int = 5_000
    proof_gap: float = 1e-3
    least_share: float = 1e-3
    first_times: int = 201
    rounds: int = 12
    first_step: float = 1e-7
    least_left: float = 1e-6


@dataclass(frozen=True, kw_only=True)
class StaySettings:
    """Settings of the proof that a robot at its goal stays clear of what moves.

    Args:
        longest: s after the arrival that are examined, at most.
        initial_cells: of time.
        resolution: s, of the time when something comes near.
        most_cells: at a time.
    """

    longest: float = 60.0
    initial_cells: int = 200
    resolution: float = 1e-3
    most_cells: int = 20_000


@dataclass(frozen=True, kw_only=True)
class BreachSettings:
    """Settings of the search for times at which a limit is broken.

    Args:
        times: at least, at which a limit is evaluated.
        times_around: more of them around the worst time.
        around: share of the duration on both sides of the worst time.
        rounds: in which the change from kept to broken is narrowed down.
        parts: of each round.
        same_span: share of the duration; spans no farther apart are one.
    """

    times: int = 2001
    times_around: int = 65
    around: float = 1e-3
    rounds: int = 4
    parts: int = 64
    same_span: float = 2e-3


@dataclass(frozen=True, kw_only=True)
class DivisionSettings:
    """Settings of the division of a certificate's claims.

    Args:
        most_items: bounds that are computed for a claim.
        most_levels: of halvings.
        coarse_normal: length of a plane's normal, whose entries are whole numbers, that is tried first.
        fine_normal: length that is tried next.
        bisections: of the point of a segment that is nearest to an obstacle.
    """

    most_items: int = 5_000_000
    most_levels: int = 38
    coarse_normal: float = 1e2
    fine_normal: float = 1e4
    bisections: int = 45


DEFAULT_APPROACH = ApproachSettings()
DEFAULT_INTERVALS = IntervalSettings()
DEFAULT_TORQUE_PROOF = TorqueProofSettings()
DEFAULT_STAY = StaySettings()
DEFAULT_BREACHES = BreachSettings()
DEFAULT_DIVISION = DivisionSettings()

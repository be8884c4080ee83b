"""Encodings: decision variables, the motion of a search vector, and its cost with penalties.

A formulation is a name for an encoding and its cost: ``paper``, the cost exactly as (15) and (25) have it, or
``reduced``, feasible by construction.
"""

from problems.encodings.encoding import Encoding, Variable
from problems.encodings.knots import KnotsEncoding, PaperKnots, ReducedKnots
from problems.encodings.segments import PaperSegments, ReducedSegments, SegmentsEncoding

SEGMENT_ENCODINGS: dict[str, type[SegmentsEncoding]] = {kind.name: kind for kind in (PaperSegments, ReducedSegments)}
KNOT_ENCODINGS: dict[str, type[KnotsEncoding]] = {kind.name: kind for kind in (PaperKnots, ReducedKnots)}
FORMULATIONS: tuple[str, ...] = tuple(SEGMENT_ENCODINGS)

__all__ = [
    "FORMULATIONS",
    "KNOT_ENCODINGS",
    "SEGMENT_ENCODINGS",
    "Encoding",
    "KnotsEncoding",
    "SegmentsEncoding",
    "Variable",
]

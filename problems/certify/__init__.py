"""Proofs about finished motions for all t, and the verdicts that follow."""

from problems.certify.breaches import broken_spans, first_broken, verdicts_with_first_times
from problems.certify.check_certificate import FORMAT, VERSION, RefusedError, check
from problems.certify.clearance import (
    ClearanceProof,
    ClosestApproach,
    Travel,
    closest_approach,
    halves,
    prove_clearance,
)
from problems.certify.core_clearance import closest_cover, prove_among, prove_clearance_in_core
from problems.certify.division import divided
from problems.certify.fixed_links import FixedContact, fixed_contacts
from problems.certify.settings import (
    ApproachSettings,
    BreachSettings,
    DivisionSettings,
    IntervalSettings,
    StaySettings,
    TorqueProofSettings,
)
from problems.certify.structure import freedom, jacobian_pattern, structure_of
from problems.certify.verdict import TOLERANCE, CertificateStatus, Verdict, WorstIs, peak_near, verdict
from problems.certify.verification import (
    ROUNDING_ALLOWANCE,
    AtGoal,
    at_goal,
    exact_time_scale,
    limit_verdicts,
    prove,
    safe_time_scale,
    stay_verdicts,
)

__all__ = [
    "FORMAT",
    "ROUNDING_ALLOWANCE",
    "TOLERANCE",
    "VERSION",
    "ApproachSettings",
    "AtGoal",
    "BreachSettings",
    "CertificateStatus",
    "ClearanceProof",
    "ClosestApproach",
    "DivisionSettings",
    "FixedContact",
    "IntervalSettings",
    "RefusedError",
    "StaySettings",
    "TorqueProofSettings",
    "Travel",
    "Verdict",
    "WorstIs",
    "at_goal",
    "broken_spans",
    "check",
    "closest_approach",
    "closest_cover",
    "divided",
    "exact_time_scale",
    "first_broken",
    "fixed_contacts",
    "freedom",
    "halves",
    "jacobian_pattern",
    "limit_verdicts",
    "peak_near",
    "prove",
    "prove_among",
    "prove_clearance",
    "prove_clearance_in_core",
    "safe_time_scale",
    "stay_verdicts",
    "structure_of",
    "verdict",
    "verdicts_with_first_times",
]

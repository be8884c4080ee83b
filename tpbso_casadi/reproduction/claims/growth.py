"""Rules on computing time and memory."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.stats import quantile_test

from tpbso_casadi.reproduction.claims.finding import ClaimOutcome, Finding, Rule, finding
from tpbso_casadi.reproduction.evidence import Evidence
from tpbso_casadi.reproduction.paper import NAMES, RIVALS, Order

EXPONENT_TOLERANCE = 0.2  # by which a measured exponent may exceed the printed one
PACE_MARGIN = 0.1  # of a solver's time: a smaller difference is no difference
CONFIDENCE = 0.95


def grows_as(kind: str, orders: dict[str, Order]) -> Rule:
    """No measured exponent of growth exceeds the printed one.

    Args:
        kind: "time" or "space".
        orders: as printed, by experiment.
    """

    def decide(evidence: Evidence, basis: str) -> Finding:
        if not evidence.scaling[kind]:
            return Finding(ClaimOutcome.NOT_JUDGED, "not measured in a quick run, or on this system")
        exponents = [
            (order.exponents[symbol], row["exponent"])
            for experiment, order in orders.items()
            for symbol, by_solver in evidence.scaling[kind][experiment].items()
            for row in by_solver.values()
        ]
        above = sum(measured > printed + EXPONENT_TOLERANCE for printed, measured in exponents)
        largest = max(measured - printed for printed, measured in exponents)
        words = (
            f"{len(exponents) - above} of {len(exponents)} measured exponents are at most {EXPONENT_TOLERANCE} above "
            f"the printed ones (largest excess {largest:+.2f})"
        )
        if any(set(row) < set(NAMES) for symbols in evidence.scaling[kind].values() for row in symbols.values()):
            return Finding(ClaimOutcome.NOT_JUDGED, f"one solver measured, once; {words}")
        return finding(above == 0, words)

    return decide


def fast(evidence: Evidence, basis: str) -> Finding:
    """TPBSO takes no longer than its rivals, but for a margin."""
    intervals = {rival: interval(evidence.pace_ratios(rival, basis)) for rival in RIVALS}
    middles = ", ".join(
        f"{NAMES[rival]} {middle:.2f} ({low:.2f} to {high:.2f})" for rival, (low, middle, high) in intervals.items()
    )
    words = f"time of the others over that of TPBSO: {middles}; medians and their 95 % intervals"
    least = 1.0 - PACE_MARGIN
    if any(high < least for _, _, high in intervals.values()):
        return finding(False, words)
    if all(low >= least for low, _, _ in intervals.values()):
        return finding(True, words)
    return Finding(ClaimOutcome.NOT_JUDGED, f"too few or too noisy measurements; {words}")


def interval(values: Sequence[float]) -> tuple[float, float, float]:
    """The median between the limits of its 95 % confidence interval; from 0 to inf for too few values."""
    test: Any = quantile_test(values, p=0.5)
    low, high = test.confidence_interval(CONFIDENCE)
    return float(np.nan_to_num(low, nan=0.0)), float(np.median(values)), float(np.nan_to_num(high, nan=np.inf))

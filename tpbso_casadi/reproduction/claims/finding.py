"""What a rule says of a claim of the paper: its outcome, and the evidence in words."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

import numpy as np

from tpbso_casadi.reproduction.evidence import Evidence


class ClaimOutcome(StrEnum):
    """Whether a claim could be reproduced."""

    REPRODUCED = "reproduced"
    NOT_REPRODUCED = "not reproduced"
    NOT_TESTABLE = "not testable"  # by anyone: the paper does not print what it would take
    NOT_JUDGED = "not judged"  # by these runs or measurements: too few, or too close to tell


@dataclass(frozen=True)
class Finding:
    """The outcome of a claim on one basis, and the evidence in words."""

    outcome: ClaimOutcome
    evidence: str


Rule: TypeAlias = Callable[[Evidence, str], Finding]  # of the evidence and a basis of comparison


def finding(holds: bool, evidence: str) -> Finding:
    """Reproduced or not."""
    return Finding(ClaimOutcome.REPRODUCED if holds else ClaimOutcome.NOT_REPRODUCED, evidence)


def percent(share: float, sign: str = "") -> str:
    """A share as a percentage; "(no plan)" where it is not finite."""
    return f"{round(100.0 * share):{sign}d} %" if np.isfinite(share) else "(no plan)"

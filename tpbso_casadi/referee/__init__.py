"""Runs of solvers on a benchmark suite, judged, and the page of it."""

from tpbso_casadi.referee.judging import BEATEN, Referee, evaluations_needed, on_common_problems

__all__ = ["BEATEN", "Referee", "evaluations_needed", "on_common_problems"]

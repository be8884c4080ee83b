"""Moves: a placeholder until their search is there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from problems.assembly.problem import Problem
from problems.base.errors import InvalidProblem
from problems.limits.limit import Limit
from problems.objectives import Objective
from problems.tasks.move import Move


def move(
    task: Move, objective: Objective | str, samples: int, pieces: int | None, limits: Sequence[type[Limit]] = ()
) -> Problem[Any]:
    """The problem that a move states.

    Raises:
        InvalidProblem: always, so far.
    """
    raise InvalidProblem("motion", "'spline' is not there yet")

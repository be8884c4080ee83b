"""A problem's cost in steps: decode a candidate, loop over samples, finish with one number.

Every number of the statement is a symbol here, so that the compiled steps serve every problem of the same structure.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from typing import Any, Generic, TypeVar

import casadi as ca
import numpy as np

from problems.assembly.problem import Problem
from problems.assembly.repeated_loop import REPEATED
from problems.assembly.sample_loop import Instant, SampleLoop, cost_loop
from problems.base.arguments import Arguments
from problems.base.matrix import Matrix
from problems.encodings.encoding import CostWeights, Encoding
from problems.encodings.timing.slowness import Slowness
from problems.evaluation import Program, Step
from problems.limits.duration import DurationBounds
from problems.limits.limit import SAMPLING_MARGIN, Limit
from problems.motions.motion import Motion
from problems.objectives import Objective

P = TypeVar("P")


def statements_of(problem: Problem[Any]) -> tuple[Any, ...]:
    """All that a cost depends on, in the order of its numbers."""
    bounds = problem.task.duration_bounds
    return problem.encoding, problem.motion, problem.searched_limits, problem.weights, bounds, problem.objective


class CostSteps(ABC, Generic[P]):
    """The steps of one problem.

    Args:
        problem: whose cost.
    """

    def __init__(self, problem: Problem[P]) -> None:
        self.arguments = Arguments()
        twins = self.arguments.twin(statements_of(problem))
        self.encoding: Encoding[P] = twins[0]
        self.motion: Motion[P] = twins[1]
        self.limits: tuple[Limit, ...] = twins[2]
        self.weights: CostWeights = twins[3]
        self.duration_bounds: DurationBounds | None = twins[4]
        self.objective: Objective = twins[5]
        each = zip(problem.searched_limits, self.limits, strict=True)
        self._repetitions = {id(twin): limit.repetitions(twin) for limit, twin in each}
        self.seconds_stayed = problem.task.stay
        self.x = ca.SX.sym("x", len(problem.variables))

    @cached_property
    def p(self) -> ca.SX:
        """All numbers of the statement, (q, 1)."""
        return self.arguments.symbols

    def choice_of_duration(self, slowness: Slowness | None) -> dict[str, ca.SX]:
        """The search vector, for the step that times a motion, where the duration is a variable."""
        return {} if slowness is None else {"x": self.x}

    @property
    def restored(self) -> list[Limit]:
        """The limits that scaling time restores."""
        return self.encoding.restored(self.limits)

    def program(self) -> Program:
        """The program of all steps."""
        penalised, penalty = self.encoding.penalised(self.limits), self.encoding.penalty
        written_out = [limit for limit in penalised if not self._repetitions.get(id(limit))]
        repeated = [each for limit in penalised for each in self._repetitions.get(id(limit), ())]
        loop = cost_loop(self.motion, written_out, self.objective, penalty, self.least_orders, self.p, repeated)
        orders = tuple(sorted({*(loop.orders if loop else ()), *self.least_orders}))
        front = self.front(orders, loop.starting_values if loop else {})
        steps = [*front, *([loop.step, *loop.further] if loop else []), *self.further_steps(orders), self._finish(loop)]
        return Program(steps=tuple(steps), parameters=self.arguments.values)

    @abstractmethod
    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        """The steps that decode a candidate: from the search vector to the vectors of :meth:`motion_vectors`.

        Args:
            orders: of the derivatives that the blocks hold.
            starting_values: vectors to set to zero, with their sizes.
        """

    @property
    def least_orders(self) -> tuple[int, ...]:
        """Orders of the derivatives that are needed even where the loop over samples has nothing to do."""
        return ()

    def further_steps(self, orders: tuple[int, ...]) -> list[Step]:
        """Steps after the loop over samples; each writes one more penalty, named in :attr:`further_penalties`.

        Args:
            orders: of the derivatives that the blocks hold.
        """
        return []

    @property
    def further_penalties(self) -> tuple[str, ...]:
        """Names of the scalars that further steps write."""
        return ()

    @property
    def reach_size(self) -> int:
        """Entries of ``reach``, the condition of inverse kinematics; none by default."""
        return 0

    def motion_vectors(
        self, parameters: P, orders: tuple[int, ...], starting_values: dict[str, int]
    ) -> dict[str, Matrix]:
        """The vectors that the loop over samples reads: durations, blocks, accumulators set to zero."""
        blocks = {"blocks": self.motion.blocks(parameters, orders)} if orders else {}
        zeros = {name: ca.SX.zeros(size) for name, size in starting_values.items()}
        return {"durations": self.motion.durations(parameters), **blocks, **zeros}

    def peaks_of_each(self, peaks: ca.SX) -> list[Matrix]:
        """The peaks of all limits that time scaling restores, as a row for each."""
        sizes = Instant(self.motion).widths(self.restored)
        return [part.T for part in ca.vertsplit(peaks, np.cumsum([0, *sizes]).tolist())]

    def _finish(self, loop: SampleLoop | None) -> Step:
        """The last step: the cost from the accumulated sums."""
        inputs: dict[str, ca.SX] = {"p": self.p, "durations": ca.SX.sym("durations", self.motion.duration_count)}
        if loop is not None:
            inputs |= {n: ca.SX.sym(n, size) for n, size in loop.starting_values.items() if n in {"sums", REPEATED}}
        if self.reach_size:
            inputs["reach"] = ca.SX.sym("reach", self.reach_size)
        for name in self.further_penalties:
            inputs[name] = ca.SX.sym(name)
        sums: Sequence[Matrix] = ca.vertsplit(inputs["sums"]) if loop is not None else []
        count = loop.penalties if loop is not None else 0
        objective = self.objective.terminal(self.motion.duration(inputs["durations"]))
        for accumulated in sums[count:]:
            objective = objective + accumulated
        repeated = ca.vertsplit(inputs[REPEATED]) if REPEATED in inputs else []
        penalties = [*sums[:count], *repeated, *(inputs[name] for name in self.further_penalties)]
        if self.duration_bounds is not None and self.encoding.scales_time:  # else the search box keeps them
            durations = self.duration_bounds.at(inputs["durations"].T, SAMPLING_MARGIN)
            penalties.append(self.encoding.penalty(durations))
        reach = inputs["reach"].T if self.reach_size else None
        return Step.of("finish", inputs, {"cost": self.encoding.cost(objective, penalties, reach, self.weights)})

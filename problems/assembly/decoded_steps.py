"""The steps of a cost whose candidates are decoded at once."""

from __future__ import annotations

from functools import cached_property
from typing import TypeVar

import casadi as ca
import numpy as np

from problems.assembly.encoding import Decoded
from problems.assembly.sample_loop import CostSteps, peak_loop
from problems.base import Matrix
from problems.evaluation import Step

P = TypeVar("P")


class DecodedSteps(CostSteps[P]):
    """Decode a candidate; where time is scaled, find the peaks of the shape and scale it."""

    @cached_property
    def decoded(self) -> Decoded[P]:
        """The candidate's motion, or its shape."""
        return self.encoding.decode(self.x)

    def front(self, orders: tuple[int, ...], starting_values: dict[str, int]) -> list[Step]:
        shape, reach = self.decoded.parameters, self.decoded.reach
        reached = {} if reach is None else {"reach": reach.expression.T}
        if not self.encoding.scales_time:
            outputs = self.motion_vectors(shape, orders, starting_values)
            return [Step.of("decode", {"x": self.x, "p": self.p}, {**reached, **outputs})]
        loop = peak_loop(self.motion, self.slowing, self.p)
        matrices = self.motion.as_matrices(shape)
        outputs = {
            "shape": ca.vertcat(*map(ca.vec, matrices)),
            "shape_durations": self.motion.durations(shape),
            "shape_blocks": self.motion.blocks(shape, loop.orders),
            "peaks": ca.SX.zeros(loop.starting_values["peaks"]),
        }
        decode = Step.of("decode", {"x": self.x, "p": self.p}, {**reached, **outputs})
        vector, peaks = ca.SX.sym("shape", outputs["shape"].shape[0]), ca.SX.sym("peaks", outputs["peaks"].shape[0])
        parts = ca.vertsplit(vector, np.cumsum([0, *(matrix.numel() for matrix in matrices)]).tolist())
        read: list[Matrix] = [ca.reshape(part, *m.shape) for part, m in zip(parts, matrices, strict=True)]
        timed = self.encoding.timed(self.motion.from_matrices(read), self.slowing, self.peaks_of_each(peaks), self.x)
        inputs = {**self.time_scale_inputs, "shape": vector, "peaks": peaks}
        return [decode, loop.step, Step.of("scale", inputs, self.motion_vectors(timed, orders, starting_values))]

    @property
    def reach_size(self) -> int:
        reach = self.decoded.reach
        return 0 if reach is None else int(reach.expression.numel())

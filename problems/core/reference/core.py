"""The answers of the core, in NumPy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.interface import (
    Core,
    CoreWorld,
    MovingSolids,
    Nearby,
    PathSearch,
    ProofRequest,
    ProofResult,
    Separation,
)
from problems.core.reference.clearance import lower_to_clearance_margins, nearest_two
from problems.core.reference.connect import Connect
from problems.core.reference.interior_point import solve_program
from problems.core.reference.model import Model
from problems.core.reference.postures import FromEachOther, FromSolids, Postures, Side
from problems.core.reference.proof import Motion, Prover
from problems.core.rows import ProgramData
from problems.robots import NewtonSteps, SpatialArm, Steps

POSTURES_AT_ONCE = 512  # postures


class ReferenceCore(Core):
    """The core in NumPy."""

    name = "NumPy"

    def world(self, counts: NDArray[np.int64], numbers: FloatArray) -> CoreWorld:
        return ReferenceWorld(Model.read(counts, numbers))

    def steps(self, geometry: SpatialArm) -> Steps:
        return NewtonSteps(geometry)

    def solve_program(self, program: ProgramData) -> tuple[FloatArray, float] | None:
        return solve_program(program)


class ReferenceWorld(CoreWorld):
    """A robot among solids in NumPy.

    Args:
        model: of both.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._sides: dict[Separation, Side] = {
            Separation.FROM_OBSTACLES: FromSolids(model),
            Separation.FROM_EACH_OTHER: FromEachOther(model),
        }

    def _asked(self, which: Separation) -> list[Side]:
        return [side for kept, side in self._sides.items() if kept & which]

    def _parts(
        self, theta: FloatArray, moving: MovingSolids | None, errors: FloatArray | None
    ) -> Iterator[tuple[slice, Postures]]:
        """Postures in chunks that are not too large."""
        for begin in range(0, max(len(theta), 1), POSTURES_AT_ONCE):
            part = slice(begin, begin + POSTURES_AT_ONCE)
            seen, off = None if moving is None else moving.part(part), None if errors is None else errors[part]
            yield part, Postures(self._model, theta[part], seen, off)

    def lower_to_clearance_margins(
        self,
        theta: FloatArray,
        found: FloatArray,
        which: Separation,
        first_hit: bool,
        moving: MovingSolids | None = None,
        errors: FloatArray | None = None,
    ) -> None:
        for part, postures in self._parts(theta, moving, errors):
            for side in self._asked(which):
                lower_to_clearance_margins(side, postures, found[part], first_hit)

    def nearest(
        self,
        theta: FloatArray,
        below: float,
        which: Separation,
        moving: MovingSolids | None = None,
        errors: FloatArray | None = None,
    ) -> Nearby:
        sides, parts = self._asked(which), []
        for part, postures in self._parts(theta, moving, errors):
            found = nearest_two(sides, postures, below)
            parts.append(replace(found, samples=found.samples + np.int32(part.start)))
        names = [field.name for field in fields(Nearby)]
        return Nearby(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def prove(self, asked: ProofRequest) -> ProofResult:
        motion = Motion(asked.breaks, asked.coefficients, asked.tracking)
        prover = Prover(self._model, motion, self._asked(asked.which), asked.drifts, asked.rounding)
        return prover(asked.gap, asked.cells, asked.most_items)

    def connect(self, start: FloatArray, goal: FloatArray, search: PathSearch) -> FloatArray:
        path = Connect(self._model, self._asked(Separation.ALL), search)(start, goal)
        return np.array(path).reshape(-1, self._model.dof)

"""All that the core answers, in NumPy."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray
from problems.core.interface import Core, CoreWorld, Kept, Moving, Nearby, ProofAsked, ProofFound, Search
from problems.core.reference.interior_point import minimised
from problems.core.reference.model import Model
from problems.core.reference.postures import FromEachOther, FromSolids, Postures, Side
from problems.core.reference.proof import Motion, Prover
from problems.core.reference.rooms import lower_to_rooms, nearest_two
from problems.core.reference.ways import Connect
from problems.core.rows import ProgramData
from problems.robots import NewtonSteps, SpatialArm, Steps

AT_ONCE = 512  # postures


class ReferenceCore(Core):
    """All of it."""

    name = "NumPy"

    def world(self, counts: NDArray[np.int64], numbers: FloatArray) -> CoreWorld:
        return ReferenceWorld(Model.read(counts, numbers))

    def steps(self, geometry: SpatialArm) -> Steps:
        return NewtonSteps(geometry)

    def minimised(self, program: ProgramData) -> tuple[FloatArray, float] | None:
        return minimised(program)


class ReferenceWorld(CoreWorld):
    """A robot among solids.

    Args:
        model: of both.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._sides: dict[Kept, Side] = {
            Kept.FROM_OBSTACLES: FromSolids(model),
            Kept.FROM_EACH_OTHER: FromEachOther(model),
        }

    def _asked(self, which: Kept) -> list[Side]:
        return [side for kept, side in self._sides.items() if kept & which]

    def _parts(
        self, theta: FloatArray, moving: Moving | None, errors: FloatArray | None
    ) -> Iterator[tuple[slice, Postures]]:
        """Not too many postures at once."""
        for begin in range(0, max(len(theta), 1), AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            seen, off = None if moving is None else moving.part(part), None if errors is None else errors[part]
            yield part, Postures(self._model, theta[part], seen, off)

    def lower_to_rooms(
        self,
        theta: FloatArray,
        found: FloatArray,
        which: Kept,
        first_hit: bool,
        moving: Moving | None = None,
        errors: FloatArray | None = None,
    ) -> None:
        for part, postures in self._parts(theta, moving, errors):
            for side in self._asked(which):
                lower_to_rooms(side, postures, found[part], first_hit)

    def nearest(
        self,
        theta: FloatArray,
        below: float,
        which: Kept,
        moving: Moving | None = None,
        errors: FloatArray | None = None,
    ) -> Nearby:
        sides, parts = self._asked(which), []
        for part, postures in self._parts(theta, moving, errors):
            found = nearest_two(sides, postures, below)
            parts.append(replace(found, samples=found.samples + np.int32(part.start)))
        names = [field.name for field in fields(Nearby)]
        return Nearby(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))

    def prove(self, asked: ProofAsked) -> ProofFound:
        motion = Motion(asked.breaks, asked.coefficients, asked.tracking)
        prover = Prover(self._model, motion, self._asked(asked.which), asked.drifts, asked.rounding)
        return prover(asked.gap, asked.cells, asked.most_items)

    def connect(self, start: FloatArray, goal: FloatArray, search: Search) -> FloatArray:
        path = Connect(self._model, self._asked(Kept.ALL), search)(start, goal)
        return np.array(path).reshape(-1, self._model.dof)

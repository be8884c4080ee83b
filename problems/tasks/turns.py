"""Postures that are stated as joint values, in the turns that are nearest to the posture before.

A joint that turns without end is at one place at values a whole turn apart: by default a move takes the nearest of
them. Where it has a range the stated value counts, as cables are wound by it; a place may say otherwise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import pi
from typing import TypeGuard

import numpy as np

from problems.base import FloatArray
from problems.robots import Robot
from problems.tasks.place import Joints, Place

MOST_NAMED = 4  # joints in a line


class ShortTurns:
    """Places of a move of a robot in the nearest turns, one after the other.

    Args:
        robot: that moves.
        start: where it begins; where that is no stated posture, the turns of the next one are as stated.

    Attributes:
        notes: on what was changed, or could be, a line for each place.
    """

    def __init__(self, robot: Robot, start: Place) -> None:
        self._robot = robot
        self._before = np.array(start.values) if self._is_posture(start) else None
        self.notes: list[str] = []

    def passed(self, vias: Sequence[Place]) -> tuple[Place, ...]:
        """The vias, each in the turns nearest to the posture before."""
        found: list[Place] = []
        for number, via in enumerate(vias):
            found.append(self._turned(via, f"via[{number}]"))
            if self._is_posture(found[-1]):
                self._before = np.array(found[-1].values)
        return tuple(found)

    def reached(self, goals: Sequence[Place]) -> tuple[Place, ...]:
        """The goals, each in the turns nearest to the last posture before."""
        return tuple(
            self._turned(goal, f"goal[{number}]" if len(goals) > 1 else "goal") for number, goal in enumerate(goals)
        )

    def _is_posture(self, place: Place) -> TypeGuard[Joints]:
        """Whether a place states as many joints as there are; others are refused by the move."""
        return isinstance(place, Joints) and len(place.values) == self._robot.dof

    def _turned(self, place: Place, name: str) -> Place:
        if self._before is None or not self._is_posture(place):
            return place
        stated, nearest = np.array(place.values), self._nearest(np.array(place.values))
        endless = np.array(self._robot.endless)
        taken = {None: endless, "nearest": np.ones_like(endless), "exact": np.zeros_like(endless)}[place.turns]
        values = np.where(taken, nearest, stated)
        if (values != stated).any():
            how = f"{self._listed(values, values != stated)}, the short way"
            self.notes.append(f"{name}: {how}; turns = 'exact' keeps the stated values")
        elif (nearest != stated).any() and place.turns is None:
            other = self._listed(nearest, nearest != stated)
            self.notes.append(f"{name}: the same posture is nearer with {other}; turns = 'nearest' takes it")
        return replace(place, values=tuple(values.tolist()))

    def _nearest(self, stated: FloatArray) -> FloatArray:
        """Values a whole number of turns from stated ones (dof,), within the ranges, nearest to the posture before."""
        assert self._before is not None
        turns = np.array([unit == "rad" for unit in self._robot.joints.units])
        low, high = (
            np.array(self._robot.limits.position).T
            if self._robot.limits.position is not None
            else np.full((2, len(stated)), [[-np.inf], [np.inf]])
        )
        whole = np.rint((self._before - stated) / (2.0 * pi))
        least, most = np.ceil((low - stated) / (2.0 * pi)), np.floor((high - stated) / (2.0 * pi))
        whole = np.where(turns & (least <= most), np.clip(whole, least, most), 0.0)
        return np.asarray(stated + 2.0 * pi * whole)

    def _listed(self, values: FloatArray, chosen: FloatArray) -> str:
        """The joints that are chosen, (dof,), with their values."""
        names = [f"{self._robot.joints.names[joint]} at {values[joint]:.4g} rad" for joint in np.flatnonzero(chosen)]
        return ", ".join(names[:MOST_NAMED]) + (f" and {len(names) - MOST_NAMED} more" if names[MOST_NAMED:] else "")

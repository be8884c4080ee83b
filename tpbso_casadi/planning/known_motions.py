"""Certified motions of stages by what they were planned for: those of the plan itself, and those of an earlier one.

A motion that was planned before between the same postures, with the same robot, load and way, serves again where the
certificate of the whole proves it again. In another scene nothing says that it is still the best, except that no motion
between its ends is much faster.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from problems import Trajectory
from problems.base import FloatArray, plain_value
from tpbso_casadi.planning.finishing import PlannedMotion
from tpbso_casadi.planning.motion import JudgedMotion
from tpbso_casadi.scenario import (
    Cell,
    LedStage,
    MovingStage,
    Scenario,
    ScenarioError,
    SequenceTask,
    stage_times,
    walked,
)

DIGITS = 9  # of m and rad: what lies nearer is one, as places and postures are computed again
SAME_POSTURE = 1e-10  # rad, likewise
BESIDES_STAGES = ("arm", "robot", "robots", "model", "solver")  # tables on which all motions of a sequence depend


@dataclass(frozen=True, eq=False)
class EarlierMotion:
    """A motion that was planned before, and its scenario.

    Attributes:
        scenario: that states it.
        trajectory: of the joints.
        quantities: that are stored with it: of a sequence, when its stages end.
    """

    scenario: Scenario
    trajectory: Trajectory
    quantities: Mapping[str, FloatArray]

    @classmethod
    def of(cls, plan: PlannedMotion) -> Self:
        """The motion of a plan."""
        return cls(plan.scenario, plan.trajectory, plan.motion.quantities)


@dataclass(frozen=True, eq=False)
class KnownMotion:
    """A certified motion of a stage.

    Attributes:
        start: posture in which it begins, (dof,), rad.
        goal: in which it ends, likewise.
        trajectory: of the joints, from t = 0.
        scene: text of the obstacles around it.
        is_earlier: whether it is of an earlier plan.
    """

    start: FloatArray
    goal: FloatArray
    trajectory: Trajectory
    scene: str
    is_earlier: bool

    def serving(self, cell: Cell, stage: MovingStage, longest: float) -> MovingStage | None:
        """The stage, with where the motion keeps a speed of the tool; None where a new motion is to be planned.

        Args:
            cell: in which the stage begins.
            stage: that is planned.
            longest: that a free motion may take to be kept in another scene, s.
        """
        is_same = self.scene == scene_of(cell)
        if not (is_same or self.is_earlier):
            return None
        if not (is_same or isinstance(stage, LedStage) or self.trajectory.duration <= longest):
            return None
        if isinstance(stage, LedStage) and stage.tool_speed is not None:
            stage, broken = stage.with_speed_of(self.trajectory, cell.robot, self.start)
            if broken is not None:
                return None
        if is_same:
            return stage
        motion = JudgedMotion(cell.statement(stage, self.start).judged(), self.trajectory, {})
        return stage if motion.feasible else None


class KnownMotions:
    """Motions of stages, found by the stage and the posture in which it begins.

    Attributes:
        postures: at the stops of the earlier plan, (n, dof), rad; none where there is no such plan.
    """

    def __init__(self) -> None:
        self.postures: FloatArray = np.empty((0, 0))
        self._motions: dict[str, list[KnownMotion]] = {}

    @classmethod
    def of(cls, scenario: Scenario, earlier: EarlierMotion) -> Self:
        """The motions of an earlier plan; none where robot, model or solver of a scenario are others.

        Raises:
            ScenarioError: it is no plan of a sequence.
        """
        known, task = cls(), earlier.scenario.task
        if not isinstance(task, SequenceTask):
            raise ScenarioError(f"warm_start: a plan of a sequence is needed, not of {task.kind!r}")
        if _text(scenario.part(BESIDES_STAGES)) != _text(earlier.scenario.part(BESIDES_STAGES)):
            return known
        whole, times = earlier.trajectory, stage_times(task, earlier.trajectory, earlier.quantities)
        moves = np.array([stage.moves for _, stage in task.legs])
        stops = whole.at(np.append(0.0, times[1:][moves]))
        after = stops[np.cumsum(moves)]
        before = np.concatenate([stops[:1], after[:-1]])
        known.postures = stops[[not any(_same(stop, other) for other in stops[:n]) for n, stop in enumerate(stops)]]
        for number, (stage, cell) in enumerate(walked(earlier.scenario, before)):
            if isinstance(stage, MovingStage):
                motion = whole.part(times[number], min(times[number + 1], whole.duration))
                known.keep(cell, stage, (before[number], after[number]), motion, is_earlier=True)
        return known

    def keep(
        self,
        cell: Cell,
        stage: MovingStage,
        ends: tuple[FloatArray, FloatArray],
        motion: Trajectory,
        is_earlier: bool = False,
    ) -> None:
        """Keep a certified motion of a stage between two postures (dof,)."""
        found = self._motions.setdefault(_key(cell, stage), [])
        found.append(KnownMotion(*ends, motion, scene_of(cell), is_earlier))

    def after(self, cell: Cell, stage: MovingStage, start: FloatArray) -> KnownMotion | None:
        """The earlier plan's motion of a stage from a posture (dof,) on; None where it has none."""
        if not self.postures.size:
            return None
        known = self._motions.get(_key(cell, stage), ())
        return next((one for one in known if one.is_earlier and _same(one.start, start)), None)

    def between(self, cell: Cell, stage: MovingStage, start: FloatArray, goal: FloatArray) -> KnownMotion | None:
        """The motion of a stage between two postures (dof,), in the same scene if there is one; None for none."""
        known = [
            one for one in self._motions.get(_key(cell, stage), ()) if _same(one.start, start) and _same(one.goal, goal)
        ]
        return min(known, key=lambda one: one.scene != scene_of(cell), default=None)

    def earlier_posture(self, theta: FloatArray) -> FloatArray | None:
        """The posture of an earlier stop that a posture (dof,) is to rounding; None where there is none."""
        return next((known for known in self.postures if _same(known, theta)), None)


def scene_of(cell: Cell) -> str:
    """The obstacles of a cell, as text."""
    return _text(list(cell.obstacles))


def _key(cell: Cell, stage: MovingStage) -> str:
    """Everything but obstacles and ends on which a motion of a stage depends, as text."""
    return _text([stage.manner, list(cell.carried), cell.scenario.may_touch, cell.contacts])


def _same(one: FloatArray, other: FloatArray) -> bool:
    return bool(np.abs(one - other).max() <= SAME_POSTURE)


def _text(content: Any) -> str:
    return json.dumps(_rounded(plain_value(content)), sort_keys=True)


def _rounded(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, DIGITS) + 0.0  # without the sign of zero
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    return [_rounded(entry) for entry in value] if isinstance(value, list) else value

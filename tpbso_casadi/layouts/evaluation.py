"""The least cycle of a layout: from posture to posture, with ways of the tool timed, without planning its motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from problems.base import FloatArray
from problems.core import fixed_clearance
from problems.robots import SpatialArm
from tpbso_casadi.layouts.apart import distance_between, outline_of_base, outlines_named
from tpbso_casadi.layouts.template import ROBOT, LayoutTemplate
from tpbso_casadi.planning import SequenceGraph, StageFailure
from tpbso_casadi.scenario import (
    ApartSection,
    MovingStage,
    Scenario,
    ScenarioError,
    SequenceTask,
    SpatialRobotSection,
    as_scenario_errors,
)

INFEASIBLE = 1e6  # cost of a layout that cannot be, to which its lack is added
BASE_DEPTH = 0.01  # m, by which the cover of a base may be in what it stands on
DIGITS = 9  # of where bodies are taken up, m: what differs less is rounding


@dataclass(frozen=True)
class Evaluation:
    """The least cycle of a layout, or the reason for which there is none.

    Attributes:
        seconds: of the least cycle; infinite where there is none.
        lack: 0 where there is one; else more the less of the sequence can be done, or the nearer things are.
        why: there is none; else empty.
    """

    seconds: float
    lack: float = 0.0
    why: str = ""

    @property
    def cost(self) -> float:
        """The seconds, or more than any cycle takes."""
        return self.seconds if np.isfinite(self.seconds) else INFEASIBLE * (1.0 + self.lack)


@dataclass(frozen=True, eq=False)
class LayoutEvaluator:
    """Evaluates layouts of a cell.

    Args:
        template: of the cell.
    """

    template: LayoutTemplate

    @cached_property
    def _spared(self) -> LayoutTemplate:
        """The template in which more is kept from everything than certificates need."""
        stated, spare = self.template.stated, self.template.section.spare
        task = stated.task
        assert isinstance(task, SequenceTask)
        stages = [_with_margin(stage, spare) for stage in task.stages]
        model = stated.model.replaced(margin=stated.model.margin + spare)
        return LayoutTemplate(stated.replaced(model=model, task=task.replaced(stages=stages)))

    def __call__(self, x: FloatArray, mounting: int = 0) -> Evaluation:
        """The evaluation of a layout.

        Args:
            x: a searched point, (d,).
            mounting: its number among the template's.
        """
        try:
            placed = self._spared.placed(x, mounting)
            with as_scenario_errors():
                world = placed.with_postures()
            seen = self._spared.seen_from_base(placed, world)
            lack, why = self._too_near(world, seen)
            if why:
                return Evaluation(np.inf, 1.0 + lack, why)
            graph = SequenceGraph(seen, digits=DIGITS)
        except StageFailure as failure:
            return Evaluation(np.inf, 1.0 - failure.share, str(failure))
        except ScenarioError as error:
            return Evaluation(np.inf, 1.0, str(error))
        chain = graph.known_chain(1.0)
        if chain is None:
            return Evaluation(np.inf, 0.0, "no way leads from stop to stop")
        times = [edges.durations[pair] for edges, pair in zip(graph.edges, pairwise(chain), strict=True)]
        return Evaluation(float(sum(times)) + graph.waits)

    def _too_near(self, world: Scenario, seen: Scenario) -> tuple[float, str]:
        """How much things are nearer to each other than they may be, m, and which; an empty text where none are.

        Args:
            world: the scenario of a layout in the world.
            seen: the same as the base sees it.
        """
        scene, stated = seen.built(), self.template.stated
        arm, table = scene.robot, world.robot
        assert isinstance(arm, SpatialArm) and isinstance(table, SpatialRobotSection)
        depth = -fixed_clearance(arm, scene.obstacles) - BASE_DEPTH
        if depth > 0.0:
            return depth, f"the robot's base is {depth + BASE_DEPTH:.3g} m in what is around it"
        frames = [obstacle.frame or "" for obstacle in stated.obstacles]
        named = [
            (frame, part) for frame, section in zip(frames, world.obstacles, strict=True) for part in section.built(1)
        ]
        lack, why = 0.0, ""
        for apart in self.template.section.apart:
            first, second = (
                [outline_of_base(arm, table.base.build())] if name == ROBOT else outlines_named(name, named)
                for name in apart.between
            )
            missing = apart.distance - distance_between(first, second)
            if missing > 0.0:
                lack, why = lack + missing, why or _nearness(apart, missing)
        return lack, why


def _nearness(apart: ApartSection, missing: float) -> str:
    one, other = apart.between
    return f"{one} and {other} are {apart.distance - missing:.4g} m from each other, not {apart.distance:g} m"


def _with_margin(stage: Any, spare: float) -> Any:
    """A stage whose own margin, if it has one, is larger."""
    if not isinstance(stage, MovingStage) or stage.margin is None:
        return stage
    return stage.replaced(margin=stage.margin + spare)

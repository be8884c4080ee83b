"""Planning again and again while an arm moves, with a motion at any time that ends at rest before anything is touched.

A motion is executed only if two things are proven. It keeps all limits and stays clear of all obstacles as they are
predicted, for all t. And its beginning, until a decision made in the next step can take effect, followed by the fastest
stop, stays clear until the arm stands even if obstacles leave their prediction at a given rate. So there is a stop that
is known to be safe whenever no better motion is found: passive safety [1].

[1] K. Macek, D. A. Vasquez Govea, T. Fraichard, R. Siegwart, "Towards Safe Vehicle Navigation in Dynamic Urban
    Scenarios", Automatika 50 (3-4), 2009
"""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from problems import InvalidProblem, Place, Trajectory
from problems.base.matrix import FloatArray
from problems.scene.obstacle import Obstacle, standing
from problems.tasks.checks import check_obstacles
from tpbso_casadi.planning.replanning.candidates import is_rest_of
from tpbso_casadi.planning.replanning.decision import Decision
from tpbso_casadi.planning.replanning.proofs import RobotLimits, Scene
from tpbso_casadi.planning.replanning.step import Approach, Step
from tpbso_casadi.scenario.scenario import Scenario
from tpbso_casadi.scenario.section import ScenarioError


class Replanner:
    """Decides, step after step, what an arm does next; what has been prepared or proven is kept.

    Args:
        scenario: the robot, its limits, its goal; the obstacles where none are given.
        every: how long a decision may take, s: what is executed goes on for as long.
        fail_safe_rate: how fast obstacles that move may leave their prediction, m/s, in any direction.

    Raises:
        ScenarioError: the scenario is no move to a goal at rest.
        InvalidProblem: a number is out of range.
    """

    def __init__(self, scenario: Scenario, every: float = 0.1, fail_safe_rate: float = 0.0) -> None:
        for name, value, least in (("every", every, 1e-3), ("fail_safe_rate", fail_safe_rate, 0.0)):
            if not least <= value < np.inf:
                raise InvalidProblem(name, f"{value:g} is not a number of at least {least:g}")
        self.scenario, self.every, self.fail_safe_rate = scenario, every, fail_safe_rate
        criteria = scenario.criteria()
        self.task, self.robot, self._goals = criteria.task, criteria.robot, criteria.task.last_places
        if not self._goals:
            raise ScenarioError("task: only a move to a goal at rest, without places on the way, is planned again")
        self._limits = RobotLimits(self.robot, scenario.model.further_limits)
        self._known: tuple[Trajectory, Scene] | None = None  # the last motion, if it keeps what does not change

    def first(self, executed: Trajectory | None = None, obstacles: Sequence[Obstacle] | None = None) -> Step:
        """The first step: the arm stands at the start, or a motion has been planned for it that begins now.

        Args:
            executed: that motion.
            obstacles: as observed now; those of the scenario where None.

        Raises:
            InvalidProblem: as :meth:`replan`.
            ScenarioError: the start is no posture, so that the motion has to be given.
        """
        if executed is None:
            start = self.task.given_postures
            if not len(start):
                raise ScenarioError("task.start: joints are needed, or a motion that is planned already")
            executed = Trajectory.standing(start[0], self.every)
        return self.replan(executed, self.task.obstacles if obstacles is None else obstacles)

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        """Decide.

        Args:
            executed: what the arm does from now on; after its end it stands.
            obstacles: as observed now, on clocks that start now.
            goal: where to go instead of the scenario's goal.

        Raises:
            InvalidProblem: the motion is of another robot or no motion at all, obstacles have another dimension, or the
                goal cannot be reached.
        """
        began = time.perf_counter()
        self._check(executed, obstacles, goal)
        scene = Scene(self.robot, tuple(obstacles))
        decision = Decision(
            limits=self._limits,
            scene=scene,
            executed=executed,
            is_proven=self._is_known(executed, scene),
            goals=self._postures(executed, goal),
            every=self.every,
            rate=self.fail_safe_rate,
        )
        chosen = decision.chosen()
        self._known = (chosen.candidate.trajectory, scene) if chosen.fixed else None
        return Step(
            kind=chosen.candidate.kind,
            trajectory=chosen.candidate.trajectory,
            certified=chosen.certified,
            fail_safe=chosen.fail_safe,
            seconds=time.perf_counter() - began,
            closest=Approach.of(chosen.proof),
            x=chosen.candidate.x,
        )

    def _is_known(self, executed: Trajectory, scene: Scene) -> bool:
        """Whether the last step has proven what does not depend on what moves."""
        if self._known is None:
            return False
        trajectory, before = self._known
        return standing(before.obstacles) == standing(scene.obstacles) and is_rest_of(executed, trajectory)

    def _check(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None) -> None:
        joints = executed.coefficients.shape[2]
        if joints != self.robot.dof:
            raise InvalidProblem("executed", f"a motion of {joints} joints for a robot of {self.robot.dof}")
        if not executed.is_finite or not executed.duration > 0.0:
            raise InvalidProblem("executed", "it is no motion: its numbers are not finite, or it takes no time")
        check_obstacles(self.robot, standing(obstacles))
        if any(obstacle.dim != self.robot.dim for obstacle in obstacles):
            raise InvalidProblem("obstacles", f"the robot is in {self.robot.dim} dimensions, an obstacle is not")
        if goal is not None:
            goal.check(self.robot, standing(obstacles), "goal")

    def _postures(self, executed: Trajectory, goal: Place | None) -> list[FloatArray]:
        """Where to go, (k,) each, rad: of a place that leaves a choice, what is nearest to where the motion ends."""
        end = executed.value_at_end()
        return [place.projected(self.robot, end) for place in (self._goals if goal is None else (goal,))]

"""Planning again and again while the arm moves.

A motion is executed only if two things are proven. It keeps all limits and stays clear of all obstacles as they are
predicted, for all t. And its beginning, until a decision made in the next step can take effect, followed by the fastest
stop, stays clear until the arm stands even if obstacles leave their prediction at a given rate. So there is a stop that
is known to be safe whenever no better motion is found: passive safety [1].

[1] K. Macek, D. A. Vasquez Govea, T. Fraichard, R. Siegwart, "Towards Safe Vehicle Navigation in Dynamic Urban
    Scenarios", Automatika 50 (3-4), 2009
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

from problems import InvalidProblem, Obstacle, Place, Trajectory
from problems.base import COORDINATES, FloatArray, check_within, conformed, shown
from problems.certify import ClearanceProof
from problems.scene import standing
from problems.tasks import Joints, ShortTurns, check_at_least, check_obstacles
from problems.timing import MotionState
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.replanning.candidates import (
    SAME,
    NearestApproach,
    Step,
    direct_moves,
    passed,
    remaining,
    stands_at_end_of,
)
from tpbso_casadi.replanning.decision import KEPT_FOR_STOPS, Decision, Judged
from tpbso_casadi.replanning.proofs import ObservedScene, RobotLimits, is_clear
from tpbso_casadi.replanning.search import SuccessiveSearches
from tpbso_casadi.scenario import Scenario, ScenarioError

SHORTEST, LONGEST = 1e-3, 1e4  # s: between two steps
EVALUATION_RATE = 5_000  # 1/s: of a search by default, for each second that a decision may take
FEWEST_EVALUATIONS, MOST_EVALUATIONS = 80, 1_500  # of these


@dataclass(frozen=True)
class LastStep:
    """The proofs of the last step.

    Attributes:
        judged: its motion, which keeps the robot's limits and clear of what stands still.
        scene: in which; as it had been predicted where a proof of an earlier one was taken over.
        stop_scene: in which it was proven that it can be stopped; as it was seen ``judged.proof_age`` s before.
    """

    judged: Judged
    scene: ObservedScene
    stop_scene: ObservedScene

    def holds(self, executed: Trajectory, scene: ObservedScene) -> bool:
        """Whether that is still so of what is executed now: the rest of that motion, among the same that stands."""
        whole = self.judged.candidate.trajectory
        if standing(self.scene.obstacles) != standing(scene.obstacles):
            return False
        return stands_at_end_of(executed, whole) or passed(executed, whole) is not None

    def stop_age(self, executed: Trajectory, scene: ObservedScene, every: float, rate: float) -> float | None:
        """The age of the proof of the stop that begins when the decision takes effect, every so many s, or goes on.

        None where there is none, where the step comes too soon or too late for that, and where obstacles have left
        what was predicted when it was proven, faster than at the rate, in m/s, for which it was.
        """
        if self.judged.proof_age is None or not self.holds(executed, scene):
            return None
        seconds = passed(executed, self.judged.candidate.trajectory)
        if seconds is None or not (self.judged.candidate.kind == "stop" or abs(seconds - every) < SAME):
            return None
        age = self.judged.proof_age + seconds
        return age if scene.is_within(self.stop_scene, age, rate) else None

    def foreseen(self, executed: Trajectory, scene: ObservedScene) -> ClearanceProof | None:
        """The proof of its clearance from what moves, on the clock of now; None where it has to be made again.

        That is so where anything moves otherwise than predicted, where the closest approach is over, and where the
        arm now stands at the end for longer than has been proven.
        """
        whole, proof = self.judged.candidate.trajectory, self.judged.proof
        seconds = passed(executed, whole)
        if proof is None or not is_clear(proof) or seconds is None or proof.time < seconds:
            return None
        if seconds + executed.duration > whole.duration + SAME:
            return None
        return replace(proof, time=proof.time - seconds) if scene.is_as_predicted(self.scene, seconds) else None


class Replanner:
    """Decides, step after step, what an arm does next; what has been prepared or proven is kept.

    Args:
        scenario: the robot, its limits, its goal; the obstacles where none are given.
        every: how long a decision may take, s: what is executed goes on for as long.
        fail_safe_rate: how fast obstacles that move may leave their prediction, m/s, in any direction.
        evaluations: of a search; where None, 5000 for each second of ``every``, 80 at least and 1500 at most.
        within: how long a decision may take, s, of which 30 % are kept for the proof of a stop; searches and other
            proofs end before. What is found then depends on the machine. None for no such time.
        seed: of the first search; the next ones count on from it.

    Raises:
        ScenarioError: the scenario is no move to a goal at rest.
        InvalidProblem: a number is out of range.
    """

    def __init__(
        self,
        scenario: Scenario,
        every: float = 0.1,
        fail_safe_rate: float = 0.0,
        evaluations: int | None = None,
        within: float | None = None,
        seed: int = 1,
    ) -> None:
        check_within("every", (every,), (SHORTEST, LONGEST), "s")
        check_within("fail_safe_rate", (fail_safe_rate,), (0.0, COORDINATES[1]), "m/s")
        check_at_least("evaluations", evaluations, 1)
        check_at_least("seed", seed, 0)
        if within is not None:
            check_within("within", (within,), (0.0, LONGEST), "s")
        self.scenario, self.every, self.fail_safe_rate = scenario, every, fail_safe_rate
        self.within = within
        criteria = conformed("scenario", scenario, Scenario).criteria()
        self.task, self.robot, self._goals = criteria.task, criteria.robot, criteria.task.last_places
        if not self._goals:
            raise ScenarioError("task: only a move to a goal at rest, without places on the way, is planned again")
        count = (
            min(max(round(EVALUATION_RATE * every), FEWEST_EVALUATIONS), MOST_EVALUATIONS)
            if evaluations is None
            else evaluations
        )
        self.search = SuccessiveSearches(self.robot, scenario.model.further_limits, count, seed)
        self._limits = RobotLimits(self.robot, scenario.model.further_limits)
        if self.task.start_posture is not None:
            standing_there = MotionState.at_rest(self.task.start_posture)
            goals = self._postures(self.task.start_posture, None)
            self.search.prepare(standing_there, goals, self.task.obstacles)
            self._prove_once(standing_there, goals)
        self._known: LastStep | None = None  # the last motion, if it keeps what does not change
        self._checked: tuple[Place, tuple[Obstacle, ...]] | None = None  # a goal that can be reached among them

    def _prove_once(self, state: MotionState, goals: Sequence[FloatArray]) -> None:
        """Prove a motion, so that what proofs derive and compile is there when it matters."""
        scene = ObservedScene(self.robot, self.task.obstacles)
        for move in direct_moves(state, goals, self.robot.limits)[:1]:
            self._limits.hold(move.trajectory)
            scene.fixed.are_clear_of(move.trajectory)
            scene.less_certain(self.fail_safe_rate).moving.proof(move.trajectory)

    def first(self, executed: Trajectory | None = None, obstacles: Sequence[Obstacle] | None = None) -> Step:
        """The first step: the arm stands at the start, or a motion has been planned for it that begins now.

        Args:
            executed: that motion.
            obstacles: as observed now; those of the scenario where None.

        Raises:
            InvalidProblem: as :meth:`replan`.
            ScenarioError: the start is no posture at rest, so that the motion has to be given.
        """
        if executed is None:
            if self.task.start_posture is None or self.task.end_rates[0].any():
                raise ScenarioError("task.start: joints at rest are needed, or a motion that is planned already")
            executed = Trajectory.standing(self.task.start_posture, self.every)
        return self.replan(executed, self.task.obstacles if obstacles is None else obstacles)

    def replan(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None = None) -> Step:
        """Decide what to execute from now on.

        Args:
            executed: what the arm does from now on; after its end it stands.
            obstacles: as observed now, on clocks that start now.
            goal: where to go instead of the scenario's goal.

        Raises:
            InvalidProblem: the motion is of another robot or no motion at all, obstacles have another dimension, or the
                goal cannot be reached.
        """
        began, obstacles = time.perf_counter(), tuple(obstacles)
        self._check(executed, obstacles, goal)
        scene, last = ObservedScene(self.robot, obstacles), self._known
        known = last is not None and last.holds(executed, scene)
        foreseen = None if last is None else last.foreseen(executed, scene)
        decision = Decision(
            limits=self._limits,
            scene=scene,
            executed=executed,
            is_proven=known,
            stop_age=None if last is None else last.stop_age(executed, scene, self.every, self.fail_safe_rate),
            stopping=known and last is not None and last.judged.candidate.kind == "stop",
            foreseen=foreseen,
            goals=self._postures(executed.value_at_end(), goal),
            search=self.search,
            seconds=partial(self._left_since, began),
            every=self.every,
            rate=self.fail_safe_rate,
        )
        chosen = decision.chosen()
        self._known = self._proven(chosen, scene, executed, foreseen) if chosen.fixed else None
        return Step(
            kind=chosen.candidate.kind,
            trajectory=chosen.candidate.trajectory,
            certified=chosen.certified,
            fail_safe=chosen.fail_safe,
            seconds=time.perf_counter() - began,
            proof_age=chosen.proof_age,
            scenario=self.scenario,
            closest=NearestApproach.of(chosen.proof),
            x=chosen.candidate.x,
        )

    def _left_since(self, began: float) -> float | None:
        """The time of a decision that began then, s, but for what is kept for a stop; None where there is no limit."""
        return None if self.within is None else (1.0 - KEPT_FOR_STOPS) * self.within - (time.perf_counter() - began)

    def _proven(
        self, chosen: Judged, scene: ObservedScene, executed: Trajectory, foreseen: ClearanceProof | None
    ) -> LastStep:
        """Proofs of the chosen motion, each with its scene."""
        last, proven_in = self._known, scene
        if last is not None and chosen.proof is not None and chosen.proof is foreseen:
            seconds = passed(executed, last.judged.candidate.trajectory)
            proven_in = last.scene.later(seconds or 0.0)
        return LastStep(chosen, proven_in, last.stop_scene if last is not None and chosen.proof_age else scene)

    def _check(self, executed: Trajectory, obstacles: Sequence[Obstacle], goal: Place | None) -> None:
        joints = executed.coefficients.shape[2]
        if joints != self.robot.dof:
            raise InvalidProblem("executed", f"a motion of {joints} joints for a robot of {self.robot.dof}")
        if not executed.is_finite or not executed.duration > 0.0:
            raise InvalidProblem("executed", "it is no motion: its numbers are not finite, or it takes no time")
        for number, obstacle in enumerate(obstacles, start=1):
            if not isinstance(obstacle, Obstacle):  # a scenario's own are sections of a file
                reason = "not an Obstacle; those of a scenario are in the task of its replanner"
                raise InvalidProblem("obstacles", f"obstacle {number}: {type(obstacle).__name__} is {reason}")
        check_obstacles(self.robot, standing(obstacles))
        if any(obstacle.dim != self.robot.dim for obstacle in obstacles):
            raise InvalidProblem("obstacles", f"the robot is in {self.robot.dim} dimensions, an obstacle is not")
        still = standing(obstacles)
        if goal is not None and (goal, still) != self._checked:
            goal.check(self.robot, still, "goal")
            self._checked = goal, still

    def _postures(self, end: FloatArray, goal: Place | None) -> list[FloatArray]:
        """Postures to go to, (k,) each, rad: of a place that leaves a choice, and of turns, the nearest to the end."""
        turns = ShortTurns(self.robot, Joints(tuple(end.tolist())))
        return [place.projected(self.robot, end) for place in turns.reached(self._goals if goal is None else (goal,))]


def replan(
    previous: PlannedMotion | Step | Trajectory,
    at_time: float,
    scene: Scenario | Sequence[Obstacle],
    within: float | None = None,
    *,
    every: float = 0.1,
    fail_safe_rate: float = 0.0,
) -> Step:
    """The motion of an arm that has executed a plan up to some time and then sees another scene.

    Args:
        previous: a plan, a step, or a motion alone.
        at_time: up to which it has been executed, s on its own clock; the new clock starts then.
        scene: the obstacles as seen then, on clocks that start then, or a whole scenario that states them so, and maybe
            another goal. For a motion alone a scenario is needed.
        within: s that the search may take; as many evaluations as usual where None.
        every: how long the decision may take, s: the motion goes on for as long.
        fail_safe_rate: as in :class:`Replanner`, m/s.

    Raises:
        InvalidProblem: the time is not within the motion, or motion, robot and obstacles do not fit together.
        ScenarioError: the scenario is of another robot, or no move to a goal at rest.
    """
    if not isinstance(previous, Trajectory | PlannedMotion | Step):
        raise InvalidProblem("previous", f"a plan, a step or a Trajectory is needed, not {shown(previous)}")
    if not isinstance(scene, Scenario | Iterable):
        raise InvalidProblem("scene", f"obstacles or a scenario are needed, not {shown(scene)}")
    conformed("at_time", at_time, float)
    trajectory = previous if isinstance(previous, Trajectory) else previous.trajectory
    own = None if isinstance(previous, Trajectory) else previous.scenario
    stated = scene if isinstance(scene, Scenario) else None
    scenario = stated or own
    if scenario is None:
        raise ScenarioError("scene: for a motion alone a scenario is needed, which states robot and goal")
    if own is not None and own.robot_table != scenario.robot_table:
        raise ScenarioError(f"{scenario.robot_table.prefix.split('.')[0]}: not the one of the motion that is executed")
    if not 0.0 <= at_time <= trajectory.duration:
        raise InvalidProblem("at_time", f"{at_time:g} s is not within the motion, 0 to {trajectory.duration:g} s")
    replanner = Replanner(scenario, every, fail_safe_rate, within=within)
    obstacles = replanner.task.obstacles if isinstance(scene, Scenario) else tuple(scene)
    return replanner.replan(remaining(trajectory, at_time, every), obstacles)

"""Moves planned without a search: at a lower bound of what is minimised, else polished from paths that are found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from problems.assembly import LARGEST_TIME_SCALE, Approach, DirectPlanner
from problems.base import FloatArray, InvalidProblem
from problems.core import found_core
from problems.families.splines.branches import branch_posture, least_time, least_times
from problems.limits import Limit
from problems.motions import JointPath, Trajectory
from problems.objectives import DirectMoves, Objective
from problems.polish import (
    DEFAULT_GUARDED,
    PIECES,
    Deviations,
    Draft,
    ExpressionLimits,
    FreeEnd,
    IntegrandFunctions,
    JointTorques,
    Passages,
    PathRefinement,
    PolishObjective,
    RefinementSettings,
    at_the_bound,
    deviations_from_rest,
    everywhere,
    faster_nearby,
    fastest_guarded,
    in_nearest_turns,
    joint_box,
    postures_around,
    postures_on_the_way,
    programs_know,
    with_better_ends,
)
from problems.robots import Robot
from problems.tasks import Joints, Move, Surroundings
from problems.timing import MotionState, fastest_move, fastest_through, retime
from problems.worlds import World, world_of

SEGMENT_PIECES = 7  # of a deviation past vias, for each of its segments: durations within 3 % of 192 pieces
SAMPLE_TIMES = 100  # of a motion, at least, at which motors and own limits are checked before a proof
MOST_TOO_FAST = 20  # motions at the bound that are tried where own limits may ask for more time
LATER = 1e-9  # of the least total time: rounding


def move_planner(task: Move, objective: Objective, limits: tuple[Limit, ...], keeps_branch: bool) -> MovePlanner:
    """The planner of a move without a search: with programs and paths, where programs know all that is asked for.

    Args:
        task: the statement.
        objective: what is minimised.
        limits: that are kept.
        keeps_branch: whether no stop leaves several postures to inverse kinematics.
    """
    known = [limit for limit in limits if not ExpressionLimits.supports(limit)]
    free = len(known) == len(limits) and task.total_time is None
    between_states = free and task.robot.limits.jerk is not None
    solvable = found_core() is not None or (task.robot.dim == 2 and objective.asks_for_least_time)  # by HiGHS as well
    fits = (task.at_rest or between_states) and solvable
    integrals = IntegrandFunctions.of(objective, task.robot) if fits and objective.polish_suffices else None
    if integrals is None or not programs_know(known):
        return MovePlanner(task, objective, limits)
    return PathPlanner(task, objective, limits, integrals, keeps_branch)


@dataclass(frozen=True, eq=False)
class MovePlanner(DirectPlanner):
    """The fastest motions in free space; no programs.

    Args:
        task: the statement.
        objective: what is minimised.
        limits: that are kept.
    """

    task: Move
    objective: Objective
    limits: tuple[Limit, ...]

    @property
    def robot(self) -> Robot:
        """The robot that moves."""
        return self.task.robot

    @property
    def free_space_time(self) -> float:
        return least_time(self.task)

    @property
    def lacks_core(self) -> bool:
        return found_core() is None

    def at_the_bound(self, rng: np.random.Generator) -> Iterator[Trajectory]:
        """The fastest motion past given postures, or between states that move, to each goal, the soonest first."""
        if not self.objective.asks_for_least_time or self.task.total_time is not None:
            return
        if self.task.passes_nothing and (self.task.at_rest or self.robot.limits.jerk is None):
            return
        if all(isinstance(place, Joints) and not place.within for place in (self.task.start, *self.task.vias)):
            goals = [branch_posture(self.robot, goal) for goal in self.task.goals if isinstance(goal, Joints)]
            before = [branch_posture(self.robot, place) for place in (self.task.start, *self.task.vias)]
            found = [self._fastest_through(np.stack([*before, goal])) for goal in goals]
            yield from sorted((one for one in found if one is not None), key=lambda motion: motion.duration)

    def _fastest_through(self, postures: FloatArray) -> Trajectory | None:
        """The fastest motion through postures (n, dof), rad, in free space; None where none is found."""
        key = postures.tobytes()
        if key not in self._found_through:
            self._found_through[key] = self._in_free_space(postures)
        return self._found_through[key]

    def _in_free_space(self, postures: FloatArray) -> Trajectory | None:
        """The fastest motion through postures (n, dof), rad, between two by Ruckig; None where none is found."""
        limits, rates = self.robot.limits, self.task.end_rates
        if len(postures) > 2:
            return fastest_through(postures, limits, rates)
        start, goal = (MotionState(*state) for state in np.concatenate([postures[:, None], rates], axis=1))
        with suppress(InvalidProblem):  # there is none within the limits
            return fastest_move(start, goal, limits)
        return None

    @cached_property
    def _found_through(self) -> dict[bytes, Trajectory | None]:
        """Motions through postures that were found already: those at the bound are where paths begin."""
        return {}


@dataclass(frozen=True, eq=False)
class PathPlanner(MovePlanner):
    """Motions at a bound, and along paths past obstacles, in space.

    Args:
        integrals: of what is minimised.
        keeps_branch: whether no stop leaves several postures to inverse kinematics; else branches plan paths.
    """

    integrals: IntegrandFunctions
    keeps_branch: bool

    @property
    def _is_simple(self) -> bool:
        """Whether nothing but a move from rest to rest in least time is asked for."""
        simple = self.task.at_rest and self.task.passes_nothing and self.task.duration_bounds is None
        return simple and self.objective.asks_for_least_time

    @property
    def replaces_descents(self) -> bool:
        """Whether there are programs, in space; in the plane a nonlinear program may do as well."""
        return self._is_simple and self._own is None and self.robot.dim == 3

    @property
    def ends_may_move(self) -> bool:
        places = (self.task.start, *self.task.goals)
        return any(place.chosen_by_inverse_kinematics or not place.always_reached for place in places)

    @property
    def least_bound(self) -> float:
        return min((each.bound for each in self._ends[:1]), default=np.inf)

    @property
    def in_free_space(self) -> Trajectory | None:
        with suppress(InvalidProblem):  # between states that move there may be none
            return next((self._motions(each.start, each.goal).direct for each in self._ends[:1]), None)
        return None

    def polished(self, start: Trajectory, is_enough: Callable[[bool], bool]) -> Iterator[Trajectory]:
        """Faster motions; none in the plane, where a nonlinear program does as well, without torques and movement."""
        hard = self.robot.dim == 3 or self.robot.limits.torque is not None or self.task.is_timed
        if not (self._is_simple and hard):
            return
        if self._own is not None:
            yield from faster_nearby(start, self.integrals, self._world, self.limits, is_enough=is_enough)
            return
        begin, end = start.at(start.breakpoints[[0, -1]])
        found = self._refinement(begin, end, start, is_enough).best_motion(0)
        if found is not None:
            ends = (FreeEnd(self.robot, self.task.start), FreeEnd(self.robot, self.task.reached_goal(end)))
            yield with_better_ends(found, ends, partial(self._near, is_enough))

    def _near(
        self, is_enough: Callable[[bool], bool], start: FloatArray, goal: FloatArray, known: Trajectory
    ) -> Trajectory | None:
        """The motion between two postures (dof,), rad, to which programs lead from a known one; None for none."""
        if (
            is_enough(True)
            or not self._world.clear(np.stack([start, goal])).all()
            or not self._allowed(goal[None]).all()
        ):
            return None
        return self._refinement(start, goal, known, is_enough).polished_motion()

    def _refinement(
        self, start: FloatArray, goal: FloatArray, known: Trajectory, is_enough: Callable[[bool], bool]
    ) -> PathRefinement:
        """The refinement of motions between two postures (dof,), rad, that begins at a known one."""
        motions = deviations_from_rest(start, goal, self.robot.limits, self._torques)
        return PathRefinement(
            world=self._world,
            motions=motions,
            objective=self._polish_objective(motions),
            box=joint_box(self.robot, start, goal),
            torques=self._torques,
            known=known,
            is_enough=is_enough,
            stay=self.task.stay,
        )

    def at_the_bound(self, rng: np.random.Generator) -> Iterator[Trajectory]:
        """Motions as fast as the direct one; of a pose to the postures around the branch's, the best first."""
        yield from super().at_the_bound(rng)
        if not (
            self.keeps_branch and self.objective.direct_is_least and self.task.passes_nothing and self.task.at_rest
        ):
            return
        if self._ends:
            around = Surroundings(self.robot, self.task.obstacles)
            starts, goals = (np.stack([getattr(each, end) for each in self._ends]) for end in ("start", "goal"))
            motions = at_the_bound(around, starts, goals, rng, self._allowed)
            too_fast = self._own is not None and not self._own.is_static.all()
            held = filter(self._held, islice(motions, MOST_TOO_FAST) if too_fast else motions)
            yield from map(self._in_time, held)

    def approaches(self) -> Sequence[Approach]:
        self._check_ends()
        if found_core() is None:  # which finds the paths past obstacles
            return ()
        return self._ends if self.keeps_branch else ()

    def _check_ends(self) -> None:
        """Check that given postures at the ends keep own limits, of several goals those of one.

        Raises:
            InvalidProblem: they break one.
        """
        for field, places in (("start", (self.task.start,)), ("goal", self.task.goals)):
            given = [branch_posture(self.robot, place) for place in places if isinstance(place, Joints)]
            if self._own is None or len(given) < len(places) or self._allowed(np.stack(given)).any():
                continue
            broken = self._own.broken_at(given[0])
            raise InvalidProblem(field, f"breaks {broken!r}, which is to hold from start to goal")

    def along_paths(
        self, approach: Approach, seed: int, to_beat: float, is_enough: Callable[[bool], bool]
    ) -> Iterator[Trajectory]:
        world, start, goal, vias = self._world, approach.start, approach.goal, self.task.vias
        bound, to_beat = approach.bound - self.task.goal_cost, to_beat - self.task.goal_cost
        try:
            motions = self._motions(start, goal)
        except InvalidProblem:  # of ends that move
            return
        usual = np.array([branch_posture(self.robot, via) for via in vias]).reshape(-1, self.robot.dof)
        passages = Passages(motions, self.robot, vias) if vias else None
        for through in postures_on_the_way(self.robot, vias, usual, start, goal):
            if bound >= to_beat or is_enough(to_beat < np.inf):
                return
            if not (world.still.clear(through) & self._allowed(through)).all():
                continue
            if self.task.at_rest and (np.stack([*through, goal]) == start).all():
                raise InvalidProblem("goal", "the same posture as the start and the vias: there is nothing to time")
            box = joint_box(self.robot, start, *through, goal)
            known = self._fastest_through(np.stack([start, *through, goal])) if vias else None
            if known is not None and self._held(known) and world.prove(known).status:
                yield self._in_time(known)
            refinement = PathRefinement(
                world=world,
                motions=motions,
                objective=self._polish_objective(motions),
                box=box,
                torques=self._torques,
                expressions=self._own,
                passages=passages,
                through=through,
                known=known,
                is_enough=is_enough,
                stay=self.task.stay,
            )
            best = self._guarded(refinement, seed, known, is_enough) if self._passes_postures else None
            if best is not None:
                yield self._in_time(best)
                to_beat = min(to_beat, best.duration)
                if known is not None and best.duration <= DEFAULT_GUARDED.near_bound * known.duration:
                    continue
            found = refinement.best_motion(seed, to_beat)
            if found is not None:
                yield from map(self._in_time, (found, *self._timed_anew(found, known)))
                to_beat = self.objective.of_motion(found, self.robot, found.breakpoints)

    @property
    def _passes_postures(self) -> bool:
        """Whether a move in least time passes exact postures, among obstacles that stand still."""
        exact = all(isinstance(via, Joints) and not via.within for via in self.task.vias)
        return bool(self.task.vias) and exact and self.objective.asks_for_least_time and not self._world.moves

    def _guarded(
        self, ways: PathRefinement, seed: int, known: Trajectory | None, is_enough: Callable[[bool], bool]
    ) -> Trajectory | None:
        """The best of the fastest motions near one without obstacles, and near paths past these; None for none."""
        best, bound = None, 0.0 if known is None else DEFAULT_GUARDED.near_bound * known.duration
        for draft in ways.drafts(seed):
            found = self._fastest_guarded(draft)
            if found is not None and (best is None or found.duration < best.duration):
                best = found
            if best is not None and (best.duration <= bound or is_enough(True)):
                break
        return best

    def _fastest_guarded(self, draft: Draft) -> Trajectory | None:
        return fastest_guarded(draft, self.robot.limits, self._world, self.limits, self.task.end_rates)

    def _motions(self, start: FloatArray, goal: FloatArray) -> Deviations:
        """The motions between postures at both ends, (dof,), rad."""
        limits, at_least = self.robot.limits, self._soonest if self._world.moves else 0.0
        pieces = max(PIECES, SEGMENT_PIECES * (len(self.task.vias) + 1))
        if self.task.at_rest:
            return deviations_from_rest(start, goal, limits, self._torques, at_least=at_least, pieces=pieces)
        rates = self.task.end_rates
        return Deviations(start, goal, limits, rates=rates, at_least=at_least, pieces=pieces)

    @cached_property
    def _world(self) -> World:
        return world_of(self.robot, self.task.obstacles, self.limits)

    @cached_property
    def _ends(self) -> list[Approach]:
        """Postures at both ends, clear and allowed; the least bound first, of equal ones what takes the least time."""
        starts, found = self._clear_postures(self._starts), list[tuple[float, float, Approach]]()
        goals = [postures_around(self.robot, goal, self.task.elbow) for goal in self.task.goals]
        for start in starts:
            near = [
                in_nearest_turns(self.robot, theta, start) if goal.chosen_by_inverse_kinematics else theta
                for goal, theta in zip(self.task.goals, goals, strict=True)
            ]
            theta = self._clear_postures(np.concatenate(near))
            times = least_times(self.task, theta - start)
            moves = DirectMoves(robot=self.robot, start=start, goals=theta, durations=times)
            bounds = (self.objective.lower_bound(moves) + self.task.goal_cost).tolist()
            made = [Approach(start, goal, bound) for goal, bound in zip(theta, bounds, strict=True)]
            found += zip(bounds, times.tolist(), made, strict=True)
        return [approach for _, _, approach in sorted(found, key=lambda each: each[:2])]

    @property
    def _starts(self) -> FloatArray:
        """Postures at the start, (n, dof), rad: in the plane of both branches, where inverse kinematics chooses."""
        start = self.task.start
        if not start.chosen_by_inverse_kinematics:
            return branch_posture(self.robot, start)[None]
        return postures_around(self.robot, start, self.task.elbow, 0)

    def _clear_postures(self, theta: FloatArray) -> FloatArray:
        """The postures, of some (n, dof) in rad, that are clear of what stands and keep own limits."""
        return theta[self._world.still.clear(theta) & self._allowed(theta)]

    @property
    def _torques(self) -> JointTorques | None:
        return JointTorques.among(self.limits)

    @cached_property
    def _own(self) -> ExpressionLimits | None:
        return ExpressionLimits.among(self.limits)

    @property
    def _allowed(self) -> Callable[[FloatArray], NDArray[np.bool_]]:
        """The test which postures (n, dof) keep own limits, (n,)."""
        return everywhere if self._own is None else self._own.allow

    @property
    def _soonest(self) -> float:
        """No motion may be there before, s."""
        bounds = self.task.total_time
        return 0.0 if bounds is None else bounds[0] * (1.0 + LATER)

    def _in_time(self, trajectory: Trajectory) -> Trajectory:
        """The motion, no sooner at its goal than it may be."""
        sooner = self._soonest / trajectory.duration
        return trajectory if sooner <= 1.0 else trajectory.time_scaled(sooner)

    def _held(self, trajectory: Trajectory) -> bool:
        """Whether motors give what a motion needs, and it keeps own limits, at times at which it is extreme."""
        torques, times = self._torques, trajectory.times(SAMPLE_TIMES)
        if self._own is not None and not self._own.are_kept(trajectory, times):
            return False
        return torques is None or torques.time_scale_of(trajectory, times) <= 1.0

    def _polish_objective(self, motions: Deviations) -> PolishObjective:
        longest = LARGEST_TIME_SCALE * motions.direct.duration
        bounds = self.task.total_time
        return PolishObjective(motions, self.integrals, (0.0, longest) if bounds is None else bounds)

    def _timed_anew(self, found: Trajectory, known: Trajectory | None) -> Iterator[Trajectory]:
        """Motions past vias that may take less than a found one: through a few of its postures, or along its path."""
        if not self.task.vias or not self.objective.sooner_is_better:
            return
        passed = np.concatenate([[0.0], self.task.via_times(found), [found.duration]])
        guarded = self._fastest_guarded(Draft.of_motion(found, passed))
        if guarded is not None:
            yield guarded
        best = found if guarded is None else guarded
        bound = 0.0 if known is None else RefinementSettings.near_bound * known.duration
        if self.task.at_rest and best.duration > bound:
            with suppress(InvalidProblem):
                yield retime(JointPath.of(found), self.robot.limits, chain=self.robot.rigid_chain)

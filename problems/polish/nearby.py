"""Faster motions near a known one: deviations of it, and the least time along their paths."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from problems.base import FloatArray
from problems.limits import Limit
from problems.motions import JointPath, Trajectory
from problems.polish.deviation import Deviations
from problems.polish.expression_limits import ExpressionLimits
from problems.polish.objective import IntegrandFunctions, PolishObjective
from problems.polish.passages import Passages
from problems.polish.refinement import PathRefinement, joint_box, never
from problems.polish.settings import DEFAULT_NEARBY, NearbySettings
from problems.polish.spline import PIECES
from problems.polish.torques import JointTorques
from problems.tasks import Place
from problems.timing import retime
from problems.worlds import World


def evenly_along(motion: Trajectory, count: int, times_per_point: int = NearbySettings.times_per_point) -> FloatArray:
    """Postures (count, dof) of a motion from rest to rest, in equal steps of the arc length in joint space."""
    times = motion.times(times_per_point * count)
    steps = np.linalg.norm(np.diff(motion.at(times), axis=0), axis=1)
    moved = np.append(True, steps > 0.0)
    length = np.append(0.0, np.cumsum(steps))[moved]
    return motion.at(np.interp(np.linspace(0.0, length[-1], count), length, times[moved]))


def faster_nearby(
    known: Trajectory,
    integrand: IntegrandFunctions,
    world: World,
    limits: Sequence[Limit],
    *,
    places: tuple[Place, ...] = (),
    pieces: int = PIECES,
    is_enough: Callable[[bool], bool] = never,
    settings: NearbySettings = DEFAULT_NEARBY,
) -> Iterator[Trajectory]:
    """A polished deviation of a motion from rest to rest: first timed anew along its path, then as it is.

    Nothing where obstacles move, where programs find none that is clear, or none that is worth it.

    Args:
        known: the motion that is deviated from.
        integrand: of the objective, in least time, and of the robot.
        world: the robot and its surroundings.
        limits: that are kept.
        places: that are passed, each as near as it says.
        pieces: of the spline by which motions deviate.
        is_enough: whether to come to an end, with a motion that is known or without one.
        settings: of the deviation and of the timing along its path.
    """
    robot, (start, goal) = integrand.robot, known.at(known.breakpoints[[0, -1]])
    if world.moves:
        return
    motions, expressions = (
        Deviations(start, goal, robot.limits, around=known, pieces=pieces),
        ExpressionLimits.among(limits),
    )
    refinement = settings.refinement
    if expressions is not None:
        refinement = refinement.beginning_with(expressions.longest_first_step)
    duration = motions.direct.duration
    polished = PathRefinement(
        world=world,
        motions=motions,
        objective=PolishObjective(motions, integrand, (0.0, duration)),
        box=joint_box(robot, start, goal),
        torques=JointTorques.among(limits),
        expressions=expressions,
        passages=Passages(motions, robot, places) if places else None,
        is_enough=is_enough,
        settings=refinement,
    ).polished_motion()
    if polished is None or polished.duration > settings.worth_timing * duration:
        return
    for count in settings.path_points:
        path = JointPath.through(evenly_along(polished, count, settings.times_per_point))
        yield retime(path, robot.limits, chain=robot.rigid_chain)
    yield polished

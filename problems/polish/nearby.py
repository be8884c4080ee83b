"""Faster motions near one that is known: deviations of it, and the least time along their paths."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from problems.base import FloatArray
from problems.core import World
from problems.limits import Limit
from problems.motions import JointPath, Trajectory
from problems.polish.climb import Climb, joint_box
from problems.polish.deviation import Deviations
from problems.polish.minimised import Integrals, Minimised
from problems.polish.own_limits import OwnLimits
from problems.polish.passages import Passages
from problems.polish.spline import PIECES
from problems.scene import Obstacle
from problems.sequential import JointTorques
from problems.tasks import Place
from problems.timing import retime

POINTS = (65, 257)  # of the path of a motion that is timed anew: so many first, more where that leaves a limit
LOOKS_EACH = 50  # times for each of them
WORTH_TIMING = 0.99  # of the duration: what programs gain less of is not timed anew


def evenly_along(motion: Trajectory, count: int) -> FloatArray:
    """Postures (count, dof) of a motion from rest to rest, in equal steps of the way that its joints go."""
    times = motion.times(LOOKS_EACH * count)
    steps = np.linalg.norm(np.diff(motion.at(times), axis=0), axis=1)
    moved = np.append(True, steps > 0.0)
    length = np.append(0.0, np.cumsum(steps))[moved]
    return motion.at(np.interp(np.linspace(0.0, length[-1], count), length, times[moved]))


def faster_nearby(
    known: Trajectory,
    integrals: Integrals,
    obstacles: tuple[Obstacle, ...],
    limits: Sequence[Limit],
    places: tuple[Place, ...] = (),
    pieces: int = PIECES,
) -> Iterator[Trajectory]:
    """What programs make of a motion from rest to rest: timed anew, as far as splines follow its path; then itself.

    Nothing where obstacles move, where programs find none that is clear, or none that is worth it.

    Args:
        known: the motion, between whose postures the others lead.
        integrals: of what is minimised, in least time, and of the robot.
        obstacles: to keep clear of.
        limits: that are kept.
        places: that are passed, each as near as it says.
        pieces: of the spline by which motions deviate.
    """
    robot = integrals.robot
    world, (start, goal) = World.of(robot, obstacles), known.at(known.breakpoints[[0, -1]])
    if world is None or world.moves:
        return
    motions = Deviations(start, goal, robot.limits, around=known, pieces=pieces)
    duration = motions.direct.duration
    found = Climb(
        world,
        motions,
        Minimised(motions, integrals, (0.0, duration)),
        joint_box(robot, start, goal),
        JointTorques.among(limits),
        OwnLimits.among(limits),
        Passages(motions, robot, places) if places else None,
    ).deviated()
    if found is None or found.duration > WORTH_TIMING * duration:
        return
    for count in POINTS:
        yield retime(JointPath.through(evenly_along(found, count)), robot.limits, chain=robot.rigid_chain)
    yield found

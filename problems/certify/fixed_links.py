"""Links that no joint moves, such as a robot's base, and the obstacles that they are not proven to be clear of.

No motion could avoid such a contact, and the cover of a foot sticks out into the table that it stands on. So it is no
verdict, but said beside the certificate, and what is not said there is proven for all t.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from problems.certify.settings import DEFAULT_APPROACH
from problems.core import CompiledWorld, Separation, fixed_links
from problems.motions import Trajectory
from problems.robots import SpatialArm
from problems.scene import Obstacle

FROM_OBSTACLES = Separation.FROM_OBSTACLES
LEAST = 1e-6  # m, by which a distance has to exceed what is kept, so that more than rounding is proven
PROVEN = 0.5  # share of the excess that the proof may leave out


@dataclass(frozen=True)
class FixedContact:
    """A link that no joint moves and an obstacle that is nearer to it than the margin, or not proven to be farther.

    Attributes:
        link: its name.
        place: of the obstacle among all, from 0 on.
        obstacle: its name in messages.
        distance: the least that was seen, m; negative where one goes into the other.
        margin: that is kept from obstacles, m.
        overhang: how far balls of a cover stick out of the link at most, m.
        time: at which the distance is seen, s; None where the obstacle stands still.
    """

    link: str
    place: int
    obstacle: str
    distance: float
    margin: float
    overhang: float
    time: float | None

    def __str__(self) -> str:
        when = "" if self.time is None else f" at t = {self.time:.4g} s"
        if self.distance >= LEAST:
            kept = f"no more than {self.distance:.3g} m{when}, and the margin of {self.margin:.3g} m is not proven"
            return f"clearance of {self.link}, which no joint moves, from {self.obstacle}: {kept}"
        depth = max(0.0, -self.distance)
        cover = f", within the {self.overhang:.2g} m by which its cover sticks out" if depth < self.overhang else ""
        return f"contact of {self.link}, which no joint moves, with {self.obstacle}: {depth:.2g} m deep{when}{cover}"


def fixed_contacts(robot: SpatialArm, obstacles: Sequence[Obstacle], seconds: float) -> tuple[FixedContact, ...]:
    """The links that no joint moves and obstacles that are not proven to keep the margin all the time.

    Args:
        robot: with its margin; what it may touch is left out.
        obstacles: around it, also those that move.
        seconds: from t = 0 on.
    """
    rest = Trajectory.standing(np.zeros(robot.dof), seconds)
    return () if _suspect(robot, obstacles, rest) is None else tuple(_contacts(robot, obstacles, rest))


def _suspect(
    robot: SpatialArm, obstacles: Sequence[Obstacle], rest: Trajectory, links: Sequence[str] | None = None
) -> tuple[CompiledWorld, float] | None:
    """The world of fixed links that are not proven to be clear, and the time at which that is seen; else None."""
    world = CompiledWorld.of_fixed(robot, obstacles, links)
    if world is None:
        return None
    proof = world.prove(rest, FROM_OBSTACLES, PROVEN)
    return None if proof.status and proof.smallest >= LEAST else (world, proof.time)


def _contacts(robot: SpatialArm, obstacles: Sequence[Obstacle], rest: Trajectory) -> Iterator[FixedContact]:
    for place, obstacle in enumerate(obstacles):
        if _suspect(robot, [obstacle], rest) is None:
            continue
        for link in fixed_links(robot):
            suspect = _suspect(robot, [obstacle], rest, [link])
            if suspect is not None:
                room, time, overhang = _nearest(*suspect, rest)
                when, label = time if obstacle.moves else None, obstacle.label(place + 1)
                yield FixedContact(link, place, label, robot.margin + room, robot.margin, overhang, when)


def _nearest(world: CompiledWorld, time: float, rest: Trajectory) -> tuple[float, float, float]:
    """The least clearance margin at many times and one, m, when that is, s, and how far a cover sticks out there, m."""
    times = np.append(rest.times(DEFAULT_APPROACH.times), time)
    found = world.closest(rest.at(times), FROM_OBSTACLES, times)
    first = int(np.argmin(found.clearance_margins))
    pair = found.pairs[first]
    return float(found.clearance_margins[first]), float(times[first]), 0.0 if pair is None else world.overhang(pair)

"""Inner control points and places on the way, searched; the timing follows.

Control points of a spline without bends lie on straight lines from stop to stop. A bend moves those of one segment
together, most in the middle; it takes a motion around obstacles, which offsets of single control points would have to
do in concert. One control point at each via is not free but such that the curve passes the via exactly;
where an end moves, the control point next to it lies in the direction of the velocity, and how far is free instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import ClassVar

import casadi as ca
import numpy as np

from problems.assembly import GRID_ALLOWANCE, Decoded, PathTiming, Variable
from problems.base import FloatArray, Matrix, Operand, as_array, largest, smallest, split
from problems.families.splines.branches import branch_posture
from problems.limits import Constraint, Limit
from problems.motions import DEGREE, Rates, TimedPath
from problems.objectives import MotionBounds
from problems.robots import Robot
from problems.tasks import ANGLE_TOLERANCE, Choice, Move, Place, elbow_signs

FARTHEST_TURN = 3.0 * pi  # rad: half a turn, and a whole one more for the limits of a joint


@dataclass(frozen=True)
class SplineStop:
    """A place of a move, or several of which any one will do.

    Attributes:
        name: for variables: ``start``, ``via_1``, ..., ``goal``.
        places: any of them.
        first: index of its first variable.
    """

    name: str
    places: tuple[Place, ...]
    first: int

    @property
    def chosen(self) -> bool:
        """Whether inverse kinematics chooses a posture at any of the places."""
        return any(place.chosen_by_inverse_kinematics for place in self.places)

    def choices(self, robot: Robot) -> tuple[Choice, ...]:
        """The numbers that are free here; those of all places with any are of one make."""
        return max((place.choices(robot) for place in self.places), key=len)

    def variables(self, task: Move) -> list[Variable]:
        """Variables of a stop: free numbers of its place, an elbow where one is chosen, which of several places."""
        choices = self.choices(task.robot)
        listed = [Variable(f"{each.name}_{self.name}{each.index}", each.lower, each.upper, "1") for each in choices]
        if self.chosen and task.elbow == "free":
            listed.append(Variable(f"elbow_{self.name}", -1.0, 1.0, "1"))
        if len(self.places) > 1:
            listed.append(Variable(f"which_{self.name}", 0.0, float(len(self.places)), "1"))
        return listed

    def posture(self, task: Move, x: Matrix, near: Matrix | None) -> Matrix:
        """The posture (1, dof), rad, that a search vector chooses."""
        robot, own = task.robot, x[self.first : self.first + len(self.variables(task)), :]
        free = int(self.chosen and task.elbow == "free")
        chosen, branch, which = split(own, [len(self.choices(robot)), free, int(len(self.places) > 1)])
        elbow: Operand = elbow_signs(task.elbow, branch, ends=1)[0] if self.chosen else 1.0
        postures = [place.posture(robot, chosen, elbow, near)[0] for place in self.places]
        return selected(postures, which)

    @property
    def may_be_missed(self) -> bool:
        """Whether a posture is found by projection, which may not arrive."""
        return not all(place.always_reached for place in self.places)

    def missed(self, robot: Robot, theta: Matrix) -> Matrix:
        """The distance of a posture (1, dof) from the nearest of the places, as a share of its tolerance."""
        misses = [largest(ca.fabs(place.miss(robot, theta))) / place.tolerance(robot) for place in self.places]
        return smallest(ca.vertcat(*misses))


def selected(postures: Sequence[Matrix], which: Matrix) -> Matrix:
    """The posture of several that a variable from 0 to their number selects."""
    found = postures[-1]
    for number in range(len(postures) - 2, -1, -1):
        found = ca.if_else(which < number + 1.0, postures[number], found)
    return found


def stops(task: Move) -> tuple[SplineStop, ...]:
    """Start, vias and goal, with their variables one after the other."""
    vias = [(f"via_{number}", (via,)) for number, via in enumerate(task.vias, start=1)]
    made: list[SplineStop] = []
    first = 0
    for name, places in (("start", (task.start,)), *vias, ("goal", task.goals)):
        made.append(SplineStop(name, places, first))
        first += len(made[-1].variables(task))
    return tuple(made)


def postures(task: Move, x: Matrix) -> list[Matrix]:
    """Joint angles at the stops, each (1, dof), rad.

    Angles that inverse kinematics finds are in the turns nearest to the stop before; those before the first given
    posture nearest to the stop after; where no posture is given, the start is in its first turn.

    Args:
        task: whose places; or its symbolic copy.
        x: search vector, which begins with the variables of the stops.
    """
    listed = stops(task)
    given = [i for i, stop in enumerate(listed) if not all(p.chosen_by_inverse_kinematics for p in stop.places)]
    anchor = given[0] if given else 0
    found: dict[int, Matrix] = {anchor: listed[anchor].posture(task, x, None)}
    for i in range(anchor - 1, -1, -1):
        found[i] = listed[i].posture(task, x, found[i + 1])
    for i in range(anchor + 1, len(listed)):
        found[i] = listed[i].posture(task, x, found[i - 1])
    return [found[i] for i in range(len(listed))]


def variables(task: Move) -> list[Variable]:
    """The variables of all stops, in order."""
    return [variable for stop in stops(task) for variable in stop.variables(task)]


def nominal(task: Move) -> FloatArray:
    """Postures at the stops, in the middle of what there is to choose, (stops, dof), rad."""
    listed = stops(task)
    if not any(stop.chosen for stop in listed):
        return np.stack([branch_posture(task.robot, stop.places[len(stop.places) // 2]) for stop in listed])
    middle = ca.DM([(variable.lower + variable.upper) / 2.0 for variable in variables(task)])
    return np.concatenate([as_array(posture) for posture in postures(task, middle)])


def spread(task: Move) -> float:
    """How far a joint can be from its angle in the posture that decides about turns, at any stop, rad."""
    robot, chosen, given = task.robot, 0, [np.empty((0, task.robot.dof))]
    for stop in stops(task):
        chosen += stop.chosen or bool(stop.choices(robot))
        kept = [place for place in stop.places if not place.chosen_by_inverse_kinematics]
        given += [
            as_array(place.posture(robot, ca.DM.zeros(len(place.choices(robot))), 1.0, None)[0]) for place in kept
        ]
    between_given = np.ptp(np.concatenate(given), axis=0).max() if len(given) > 1 else 0.0
    return float(between_given) + chosen * FARTHEST_TURN


BEND, OFFSET = pi, 0.6  # rad, the largest; what is decided is their square root, so that a short move finds small ones
END_TIME_SCALES = (
    0.3,
    3.0,
)  # square root of how far the control point next to a moving end is, over its usual distance


@dataclass(frozen=True)
class ControlPoints(PathTiming):
    """Feasible by construction, except for obstacles and joint ranges.

    Args:
        task: whose stops and end velocities.
        motion: that is decoded; the same number of pieces between any two stops.
        usual_duration: that a motion takes roughly, s.

    Attributes:
        shares: how far from one stop to the next each control point lies where nothing is off.
        via_bases: the three basis functions that are not zero at each via.
        end_rates: du of the curve's end over the distance of its last two control points.
    """

    numbers: ClassVar[tuple[str, ...]] = ("usual_duration", "shares", "via_bases", "end_rates")

    task: Move
    usual_duration: float
    shares: tuple[float, ...] = field(init=False)
    via_bases: tuple[tuple[float, ...], ...] = field(init=False)
    end_rates: tuple[float, float] = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        spline, nodes = self.motion.spline, np.array(self.motion.nodes)
        at_stops = nodes[:: self.pieces]
        segment = np.array([self.segment(i) for i in range(self.count)])
        shares = np.clip((spline.greville - at_stops[segment]) / np.diff(at_stops)[segment], 0.0, 1.0)
        bases, _ = spline.local_basis(at_stops[1:-1])
        object.__setattr__(self, "shares", tuple(shares.tolist()))
        object.__setattr__(self, "via_bases", tuple(map(tuple, bases[:, :DEGREE].tolist())))
        object.__setattr__(self, "end_rates", tuple((DEGREE / np.diff(nodes)[[0, -1]]).tolist()))

    @property
    def count(self) -> int:
        """The number of control points N."""
        return len(self.motion.nodes) + DEGREE - 1

    @property
    def segments(self) -> int:
        """The number of segments, each from one stop to the next."""
        return len(self.task.vias) + 1

    @property
    def pieces(self) -> int:
        """The number of pieces of the spline in each segment."""
        return (len(self.motion.nodes) - 1) // self.segments

    def segment(self, i: int) -> int:
        """The segment of a control point; one at a via counts to the segment that ends there."""
        return sum(i > via for via in self.at_vias)

    @property
    def at_vias(self) -> tuple[int, ...]:
        """The control points that make the curve pass the vias."""
        return tuple(via * self.pieces + DEGREE // 2 for via in range(1, self.segments))

    @cached_property
    def free(self) -> tuple[int, ...]:
        """The control points whose offsets are decided."""
        start, goal = self.moving_ends
        return tuple(i for i in range(1 + start, self.count - 1 - goal) if i not in self.at_vias)

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of the stops, bends, offsets, a time scale at each moving end, [local ones,] [that of all]."""
        joints = range(1, self.task.robot.dof + 1)
        segments = range(1, self.segments + 1)
        offsets = [Variable(f"bend_{segment}[{joint}]", -1.0, 1.0, "1") for segment in segments for joint in joints]
        offsets += [Variable(f"offset_{i}[{joint}]", -1.0, 1.0, "1") for i in self.free for joint in joints]
        ends = [name for name, moves in zip(("start", "goal"), self.moving_ends, strict=True) if moves]
        scales = (Variable(f"time_scale_{name}", *END_TIME_SCALES, "1") for name in ends)
        return (*variables(self.task), *offsets, *scales, *self.timing_variables)

    def decode(self, x: Matrix) -> Decoded[TimedPath]:
        at_stops = postures(self.task, x)
        timed = self.motion.timed(*self._through(x, at_stops), self.speed_shares(x))
        return Decoded(parameters=timed, reach=self._arrival(at_stops))

    def path(self, x: Matrix) -> tuple[Matrix, Rates]:
        return self._through(x, postures(self.task, x))

    def path_and_arrival(self, x: Matrix) -> tuple[Matrix, Rates, Constraint | None]:
        at_stops = postures(self.task, x)
        return *self._through(x, at_stops), self._arrival(at_stops)

    @cached_property
    def may_miss(self) -> bool:
        """Whether a stop may not be reached: one whose posture is found by projection."""
        return any(stop.may_be_missed for stop in stops(self.task))

    def _arrival(self, at_stops: Sequence[Matrix]) -> Constraint | None:
        robot, pairs = self.task.robot, zip(stops(self.task), at_stops, strict=True)
        misses = {stop.name: stop.missed(robot, theta) for stop, theta in pairs if stop.may_be_missed}
        return arrival(misses) if misses else None

    def _through(self, x: Matrix, at_stops: Sequence[Matrix]) -> tuple[Matrix, Rates]:
        """Control points of a spline that passes postures at the stops, and (du/dt)^2 at both ends."""
        k, of_stops = self.task.robot.dof, len(variables(self.task))
        sizes = [of_stops, k * self.segments, k * len(self.free), sum(self.moving_ends)]
        _, bends, offsets, scales = split(x[: sum(sizes)], sizes)
        bends, offsets = BEND * bends * ca.fabs(bends), OFFSET * offsets * ca.fabs(offsets)
        points: list[Matrix] = []
        for i in range(self.count):
            segment, share = self.segment(i), self.shares[i]
            before, after = at_stops[segment], at_stops[segment + 1]
            bend = bends[k * segment : k * (segment + 1)].T
            points.append(before + share * (after - before) + 4.0 * share * (1.0 - share) * bend)
        points[0], points[-1] = at_stops[0], at_stops[-1]
        for place, i in enumerate(self.free):
            points[i] = points[i] + offsets[k * place : k * (place + 1)].T
        rates = self._move_ends(points, scales)
        for via, i in enumerate(self.at_vias):
            left, middle, right = self.via_bases[via]
            points[i] = (at_stops[via + 1] - left * points[i - 1] - right * points[i + 1]) / middle
        return ca.vertcat(*points), rates

    def _move_ends(self, points: list[Matrix], scales: Matrix) -> Rates:
        """Put the control points next to moving ends in place; (du/dt)^2 at both ends."""
        start, goal = self.moving_ends
        at_start: Matrix = ca.DM(0.0)
        at_goal: Matrix | None = None
        if start:
            ahead = self.usual_duration / self.end_rates[0] * scales[0] ** 2
            points[1] = points[0] + ahead * ca.horzcat(*self.task.start_velocity)
            at_start = 1.0 / (self.end_rates[0] * ahead) ** 2
        if goal:
            behind = self.usual_duration / self.end_rates[1] * scales[int(start)] ** 2
            points[-2] = points[-1] - behind * ca.horzcat(*self.task.goal_velocity)
            at_goal = 1.0 / (self.end_rates[1] * behind) ** 2
        return at_start, at_goal

    def motion_bounds(self, limits: Sequence[Limit]) -> MotionBounds:
        """Bounds of the motions of the search box.

        The duration is that of d2u/dt2 = c up to the middle of the path and -c from there, with a c so small that
        du/dt <= sqrt(c) keeps every limit on any path of the box: 2 / sqrt(c), on a grid a little more. It says nothing
        of ends that move, nor of limits that slow a motion down further.
        """
        step, spacing = 2.0 * self._farthest(), float(np.diff(self.motion.nodes).min())
        first = DEGREE * step / spacing
        second = 2.0 * (DEGREE - 1) * first / spacing
        joints = self.task.robot.limits
        c = min(min(joints.acceleration) / (first + second), (min(joints.speed) / first) ** 2)
        return MotionBounds(
            duration=self.longest(GRID_ALLOWANCE * 2.0 / float(np.sqrt(c)), limits),
            rotation=self.task.robot.dof * step * self.count,
            radius=self.task.robot.reach()[1],
        )

    def _farthest(self) -> float:
        """How far a control point can be from one posture, whatever is chosen; of any joint, rad."""
        ahead = [END_TIME_SCALES[1] ** 2 * self.usual_duration / rate for rate in self.end_rates]
        moved = (np.abs(self.task.end_velocities).max(axis=1) * ahead).max()
        through_via = max(((1.0 + left + right) / middle for left, middle, right in self.via_bases), default=1.0)
        return float((spread(self.task) + max(BEND + OFFSET, moved)) * through_via)


def arrival(misses: Mapping[str, Matrix]) -> Constraint:
    """Stops are reached, given by their names how much they are missed, of their tolerances."""
    return Constraint(
        name="stops",
        unit="1",
        expression=ca.horzcat(*misses.values()),
        lower=None,
        upper=ca.DM.ones(1, len(misses)),
        columns=tuple(misses),
        scale=ca.DM.ones(1, len(misses)) / ANGLE_TOLERANCE,
        for_all_t=False,
        formula="a posture projected onto a pose has arrived there, to its tolerance",
    )

"""The postures through which a move leads: start, vias, one of the goals, each given or chosen by the search."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix, Operand, as_array, largest, smallest, split
from problems.encodings.encoding import Variable
from problems.robots.robot import Robot
from problems.tasks.elbow import elbow_signs
from problems.tasks.move import Move
from problems.tasks.place import Choice, Place

FARTHEST_TURN = 3.0 * pi  # rad: half a turn, and a whole one more for the limits of a joint


@dataclass(frozen=True)
class Stop:
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
        """What is free at a place, and its elbow, where a posture is chosen; which place, where there are several."""
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
        """By how much a posture (1, dof) misses the place that it misses least, of its tolerance."""
        misses = [largest(ca.fabs(place.miss(robot, theta))) / place.tolerance(robot) for place in self.places]
        return smallest(ca.vertcat(*misses))


def selected(postures: Sequence[Matrix], which: Matrix) -> Matrix:
    """The posture of several that a variable from 0 to their number selects."""
    found = postures[-1]
    for number in range(len(postures) - 2, -1, -1):
        found = ca.if_else(which < number + 1.0, postures[number], found)
    return found


def stops(task: Move) -> tuple[Stop, ...]:
    """Start, vias and goal, with their variables one after the other."""
    vias = [(f"via_{number}", (via,)) for number, via in enumerate(task.vias, start=1)]
    made: list[Stop] = []
    first = 0
    for name, places in (("start", (task.start,)), *vias, ("goal", task.goals)):
        made.append(Stop(name, places, first))
        first += len(made[-1].variables(task))
    return tuple(made)


def postures(task: Move, x: Matrix) -> list[Matrix]:
    """Joint angles at the stops, each (1, dof), rad.

    Angles that inverse kinematics finds are in the turns nearest to the stop before; those before the first given
    posture nearest to the stop after; where no posture is given, the start is in its first turn.

    Args:
        task: whose places; or its symbolic twin.
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


def nominal(task: Move) -> list[Matrix]:
    """Numeric postures at the stops, in the middle of what there is to choose."""
    return postures(task, ca.DM([(variable.lower + variable.upper) / 2.0 for variable in variables(task)]))


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

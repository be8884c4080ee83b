"""The postures through which a move leads: start, vias, one of the goals, each given or chosen by the search."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi

import casadi as ca
import numpy as np

from problems.base.matrix import Matrix, Operand, as_array, split
from problems.encodings.encoding import Variable
from problems.tasks.elbow import elbow_signs
from problems.tasks.move import Move
from problems.tasks.place import Place

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

    def variables(self, task: Move) -> list[Variable]:
        """Redundancy values and elbow, where a posture is chosen; which place, where there are several."""
        listed = []
        if self.chosen:
            links = range(3, 3 + task.robot.redundancy)
            listed += [Variable(f"x_phi_{self.name}[{link}]", 0.0, 1.0, "1") for link in links]
            if task.elbow == "free":
                listed.append(Variable(f"elbow_{self.name}", -1.0, 1.0, "1"))
        if len(self.places) > 1:
            listed.append(Variable(f"which_{self.name}", 0.0, float(len(self.places)), "1"))
        return listed

    def posture(self, task: Move, x: Matrix, near: Matrix | None) -> Matrix:
        """The posture (1, dof), rad, that a search vector chooses."""
        robot, own = task.robot, x[self.first : self.first + len(self.variables(task)), :]
        redundancy = robot.redundancy if self.chosen else 0
        free = int(self.chosen and task.elbow == "free")
        normalised, branch, which = split(own, [redundancy, free, int(len(self.places) > 1)])
        elbow: Operand = elbow_signs(task.elbow, branch, ends=1)[0] if self.chosen else 1.0
        postures = [place.posture(robot, normalised, elbow, near)[0] for place in self.places]
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
    chosen, given = 0, [np.empty((0, task.robot.dof))]
    for stop in stops(task):
        chosen += stop.chosen
        kept = [place for place in stop.places if not place.chosen_by_inverse_kinematics]
        given += [as_array(place.posture(task.robot, ca.DM(0, 1), 1.0, None)[0]) for place in kept]
    between_given = np.ptp(np.concatenate(given), axis=0).max() if len(given) > 1 else 0.0
    return float(between_given) + chosen * FARTHEST_TURN

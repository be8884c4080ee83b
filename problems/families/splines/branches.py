"""Branches of a move: where inverse kinematics has several postures at a stop, moves that keep to one of them each.

The quickest in free space comes first.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import casadi as ca
import numpy as np

from problems.base import FloatArray, InvalidProblem, as_array
from problems.robots import Robot
from problems.scene import standing
from problems.tasks import Move, Place
from problems.timing import least_durations

MOST_BRANCHES = 16


def branched(task: Move) -> tuple[Move, ...]:
    """The moves to a single posture's branch each, the quickest in free space first; where nothing is open, the task.

    A start that is a pose has one branch, the one nearest the middle of the joints' ranges; a via the one that is
    nearest in time to the stop before.

    Raises:
        InvalidProblem: a place has no posture that is clear.
    """
    places = (task.start, *task.vias, *task.goals)
    one_each = len(task.goals) > 1 and (task.robot.dim == 3 or any(goal.cost for goal in task.goals))
    if all(place.always_reached for place in places) and not one_each:
        return (task,)
    start = task.start.branches(task.robot, task.obstacles, None, "start")[0]
    vias = _nearest_vias(task, start)
    near = branch_posture(task.robot, (start, *vias)[-1])
    made = [task.narrowed(start, vias, (goal,)) for goal in _goals(task, near)]
    return tuple(sorted(made, key=lambda move: least_time(move) + move.goal_cost)[:MOST_BRANCHES])


def _nearest_vias(task: Move, start: Place) -> tuple[Place, ...]:
    found = [start]
    for number, via in enumerate(task.vias):
        before = branch_posture(task.robot, found[-1])
        field = f"via[{number}]" if len(task.vias) > 1 else "via"
        places = via.branches(task.robot, standing(task.obstacles), before, field)
        found.append(min(places, key=lambda place: _time(task, before, branch_posture(task.robot, place))))
    return tuple(found[1:])


def _goals(task: Move, near: FloatArray) -> Iterator[Place]:
    """The branches of all goals; of several goals some may have none."""
    refused: list[InvalidProblem] = []
    for number, goal in enumerate(task.goals):
        field = f"goal[{number}]" if len(task.goals) > 1 else "goal"
        try:
            yield from goal.branches(task.robot, standing(task.obstacles), near, field)
        except InvalidProblem as error:
            refused.append(error)
    if len(refused) == len(task.goals):
        raise refused[0]


def on_postures(task: Move, postures: Mapping[str, FloatArray]) -> Move:
    """The move to one goal with given postures (dof,) as the branches of its stops, by name.

    Raises:
        InvalidProblem: one is not at its place, or breaks a limit of the joints.
    """
    for name, theta in postures.items():
        check_posture_values(task.robot, name, theta)
    names = ["start", *(f"via_{number}" for number in range(1, len(task.vias) + 1)), "goal"]
    goal = task.reached_goal(postures["goal"]) if "goal" in postures else task.goals[0]
    places = [
        _on_posture(task.robot, name, place, postures[name]) if name in postures else place
        for name, place in zip(names, (task.start, *task.vias, goal), strict=True)
    ]
    return task.narrowed(places[0], tuple(places[1:-1]), (places[-1],))


def _on_posture(robot: Robot, name: str, place: Place, theta: FloatArray) -> Place:
    missed = np.abs(as_array(place.miss(robot, ca.DM(theta).T))).max()
    if not missed <= place.tolerance(robot):
        raise InvalidProblem(name, f"the branch's posture misses it by {missed:.2g} {place.unit}")
    return place.on_branch(theta)


def check_posture_values(robot: Robot, field: str, theta: FloatArray) -> None:
    """Check that there are as many values as joints, within their limits; a misfit is an InvalidProblem."""
    if theta.shape != (robot.dof,):
        raise InvalidProblem(field, f"{theta.size} joints for a robot of {robot.dof}")
    for joint, (value, (low, high)) in enumerate(zip(theta, robot.limits.position or (), strict=False), start=1):
        if not low <= value <= high:
            raise InvalidProblem(field, f"joint {joint}: {value:g} is not within {low:g} and {high:g}")


def branch_posture(robot: Robot, place: Place) -> FloatArray:
    """The posture (dof,) in the middle of what there is to choose at a place, rad."""
    middle = np.array([[(choice.lower + choice.upper) / 2.0 for choice in place.choices(robot)]])
    return np.asarray(place.postures(robot, middle)[0][0])


def least_time(task: Move) -> float:
    """The duration of a move between its branches' postures in free space, s, at rest at each; no less where it passes.

    Where an end moves, at full speed.
    """
    places: Sequence[Place] = (task.start, *task.vias, task.goals[0])
    stops = [branch_posture(task.robot, place) for place in places]
    return sum(_time(task, before, after) for before, after in pairwise(stops))


def least_times(task: Move, distances: FloatArray) -> FloatArray:
    """The durations of parts of a move over distances (n, dof) in rad in free space, (n,), s; no less where it moves.

    Between rests they are those of the fastest moves, where an end moves those at full speed.
    """
    limits = task.robot.limits
    by_joint = least_durations(distances, limits) if task.at_rest else np.abs(distances) / np.array(limits.speed)
    return np.asarray(by_joint.max(axis=1))


def _time(task: Move, before: FloatArray, after: FloatArray) -> float:
    return float(least_times(task, (after - before)[None])[0])

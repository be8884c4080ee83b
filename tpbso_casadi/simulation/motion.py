"""A simulation as a motion among the obstacles as they truly were, to be drawn and played."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from problems.assembly.criteria import Criteria
from problems.limits import proximity_limits
from problems.tasks.move import Move
from problems.tasks.place import Joints
from tpbso_casadi.planning.motion import Motion
from tpbso_casadi.simulation.record import Replan, SimulationRecord

MEANINGS = {"new": "a new motion", "old": "the motion goes on", "stop": "stops"}  # of the kinds of answers


def simulated_motion(record: SimulationRecord) -> Motion:
    """What was executed; its criteria are for drawing: true obstacles, and all goals."""
    start = Joints(tuple(record.executed.at(np.zeros(1))[0].tolist()))
    task = Move(record.robot, start, record.goals, obstacles=record.obstacles)
    limits = proximity_limits(replace(record.robot, margin=0.0), record.obstacles)
    objective = record.scenario.criteria().objective
    return Motion(Criteria(task=task, objective=objective, limits=limits), record.executed, {})


def notes(record: SimulationRecord) -> tuple[tuple[float, str], ...]:
    """From which time in s on, what the planner had answered last."""
    return tuple((replan.time, note(replan)) for replan in record.replans)


def note(replan: Replan) -> str:
    """An answer in one line."""
    proofs = {"proven clear of the prediction": replan.certified, "a stop in time proven": replan.fail_safe}
    held = ", ".join(claim for claim, holds in proofs.items() if holds) or "nothing proven"
    return f"replan {replan.tick}: {MEANINGS[replan.kind]} ({held}), {1000.0 * replan.seconds:.0f} ms"

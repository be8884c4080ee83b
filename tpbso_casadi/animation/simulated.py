"""A simulation of the planner as a page: what was executed in real time, and what the planner answered when."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player import page
from tpbso_casadi.simulation.motion import notes, simulated_motion
from tpbso_casadi.simulation.record import SimulationRecord
from tpbso_casadi.storage.files import write_text
from tpbso_casadi.storage.plain import visible

FRAMES_PER_SECOND = {2: 40, 3: 20}  # by the robot's dimensions; the player draws what is between two
MOST_FRAMES = 2000


def simulation_page(title: str, record: SimulationRecord) -> str:
    """A self-contained page that plays a simulation."""
    wanted = int(np.ceil(FRAMES_PER_SECOND[record.robot.dim] * record.duration)) + 1
    frames = frames_of(simulated_motion(record), min(wanted, MOST_FRAMES))
    frames = replace(frames, notes=notes(record), seconds=record.duration)
    return page(title, frames)


def write_player(folder: Path, title: str, record: SimulationRecord) -> Path:
    """Write ``simulation.html`` into a folder; what is not printable in the title is shown escaped."""
    text = simulation_page(visible(title), record)
    return write_text(folder / "simulation.html", lambda file: file.write(text))

"""A simulation of the planner while the arm moves and obstacles do what they want. It drives no robot."""

from tpbso_casadi.simulation.loop import Simulation, SimulationSetting
from tpbso_casadi.simulation.record import MEANINGS, Replan, SimulationRecord, notes, simulated_motion, stands
from tpbso_casadi.simulation.result import WHAT, SimulationResult, SummaryResult, write_simulation

__all__ = [
    "MEANINGS",
    "WHAT",
    "Replan",
    "Simulation",
    "SimulationRecord",
    "SimulationResult",
    "SimulationSetting",
    "SummaryResult",
    "notes",
    "simulated_motion",
    "stands",
    "write_simulation",
]

"""A benchmark suite of robot-arm motions: boxes of numbers with values, frozen, the same bits on every machine.

What is imported from here loads NumPy and nothing else of size; CasADi is loaded when a problem is asked for motions.
"""

from tpbso_casadi.suite.evaluation import Values
from tpbso_casadi.suite.fronts import BestFront
from tpbso_casadi.suite.frozen import SUITE, SUITES, Description, InvalidSuite
from tpbso_casadi.suite.problem import BestKnown, SuiteProblem
from tpbso_casadi.suite.recording import HEADER, Recording, keep_falls, read_runs, write_runs
from tpbso_casadi.suite.suites import Suite, problem_named, suite

__all__ = [
    "HEADER",
    "SUITE",
    "SUITES",
    "BestFront",
    "BestKnown",
    "Description",
    "InvalidSuite",
    "Recording",
    "Suite",
    "SuiteProblem",
    "Values",
    "keep_falls",
    "problem_named",
    "read_runs",
    "suite",
    "write_runs",
]

"""What a population costs: one expression, evaluated for thousands of candidates by whatever the machine offers.

The expression becomes a tape (``tape``) of operations that every processor rounds alike (``elementary``). CasADi's
virtual machine runs it anywhere (``virtual_machine``); where there is a C++ compiler it is written out (``emission``),
compiled (``compiler``), kept (``cache``) and loaded (``native``). All give the same bits, so that ``population`` may
change from one to the other in the middle of a search.
"""

from problems.evaluation.population import (
    BACKENDS,
    EvaluationOptions,
    InvalidEvaluation,
    PopulationFunction,
    processors,
)

__all__ = ["BACKENDS", "EvaluationOptions", "InvalidEvaluation", "PopulationFunction", "processors"]

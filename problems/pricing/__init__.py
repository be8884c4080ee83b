"""What a population costs: one expression, evaluated for thousands of candidates by whatever the machine offers.

The expression becomes a tape (``tape``) of operations that every processor rounds alike (``elementary``). CasADi's
virtual machine runs it anywhere (``virtual_machine``); where there is a C++ compiler it is written out (``emission``),
compiled (``compiler``), kept (``cache``) and loaded (``native``). All give the same bits, so that ``population`` may
change from one to the other in the middle of a search.
"""

from problems.pricing.population import BACKENDS, InvalidPricing, PopulationFunction, Pricing, processors

__all__ = ["BACKENDS", "InvalidPricing", "PopulationFunction", "Pricing", "processors"]

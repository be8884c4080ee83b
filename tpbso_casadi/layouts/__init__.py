"""Layouts of a cell: where robot, bins and fixtures stand so that cycles are short, and certified plans of the best."""

from tpbso_casadi.layouts.apart import outlines_around
from tpbso_casadi.layouts.cycle_map import CycleMap, cycle_map
from tpbso_casadi.layouts.evaluation import INFEASIBLE, Evaluation, LayoutEvaluator
from tpbso_casadi.layouts.finalists import Finalist, planned_finalists, planned_layout, rows_of
from tpbso_casadi.layouts.search import EvaluatedLayouts, LayoutSearch, Record, header_of, read_records, searched
from tpbso_casadi.layouts.template import ROBOT, LayoutTemplate, Variable

__all__ = [
    "INFEASIBLE",
    "ROBOT",
    "CycleMap",
    "EvaluatedLayouts",
    "Evaluation",
    "Finalist",
    "LayoutEvaluator",
    "LayoutSearch",
    "LayoutTemplate",
    "Record",
    "Variable",
    "cycle_map",
    "header_of",
    "outlines_around",
    "planned_finalists",
    "planned_layout",
    "read_records",
    "rows_of",
    "searched",
]

"""The picture of the best plan of a case."""

from __future__ import annotations

from matplotlib.figure import Figure

from tpbso_casadi.campaign.analysis.best import BestPlan
from tpbso_casadi.figures.paths import path_figure
from tpbso_casadi.planning.planned_motion import PlannedMotion


def best_plan_figure(best: BestPlan) -> Figure:
    """The path of the tool, with postures and obstacles."""
    return path_figure(PlannedMotion(scenario=best.run.scenario, motion=best.motion))

"""``tp.audit`` and ``tp.read_run``."""

from __future__ import annotations

from pathlib import Path

from tpbso_casadi.audit_report import audit_scenario
from tpbso_casadi.facade.arguments import file_path
from tpbso_casadi.facade.audit import Audit, ScenarioAudit
from tpbso_casadi.facade.plan import Plan, StoredPlan
from tpbso_casadi.facade.statement import HasScenario, What, check_plannable, scenario_of
from tpbso_casadi.scenario import TITLES, is_folder, plugin_failures_named
from tpbso_casadi.storage import read_run as read_stored_run


def audit(what: Plan | What | HasScenario) -> Audit:
    """Audit a plan, a run folder or a scenario.

    Args:
        what: a plan, or the path of a run folder: its certificate, its optimality, shadow prices of its limits, as
            :meth:`Plan.audit`. Or anything else that :func:`plan` takes: the structure of the constraints of its search
            model and of its nonlinear program, before anything is searched.

    Raises:
        InvalidRun: the folder has been changed, or a number in it is not what a recomputation gives.
        ScenarioError: the task cannot be done.
    """
    if isinstance(what, Plan):
        return what.audit()
    if isinstance(what, str | Path) and what not in TITLES and is_folder(str(what)):
        return read_run(what).audit()
    check_plannable("what", what, "a plan, the folder of a run")
    scenario = scenario_of(what)
    with plugin_failures_named(scenario):
        return ScenarioAudit(audit_scenario(scenario))


def read_run(folder: str | Path) -> StoredPlan:
    """The plan in a run folder, all of it computed again; of its search there is only the record, in its ``result``.

    Args:
        folder: that ``plan.save(folder)`` or ``tpbso solve`` wrote.

    Raises:
        TypeError: the folder is no path.
        InvalidRun: a file is missing or was changed, or a number is not what a recomputation gives.
    """
    return StoredPlan.of(read_stored_run(file_path("folder", folder)))

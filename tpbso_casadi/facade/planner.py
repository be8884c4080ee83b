"""``tp.Planner``: a robot among obstacles, and many plans for it."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from typing import Any

from tpbso_casadi.facade.arguments import whole
from tpbso_casadi.facade.plan import Plan
from tpbso_casadi.facade.planning import plan
from tpbso_casadi.facade.statement import What
from tpbso_casadi.planning import PlannedMotion
from tpbso_casadi.scenario import ScenarioError


class Planner:
    """Plans again and again for one robot, among the same obstacles.

    What does not change is made once: the robot and its cover, what it keeps clear of, compiled code. Plans are
    those of :func:`plan`, to the bit.

    Args:
        robot: as the first argument of :func:`plan`.
        keys: further arguments of :func:`plan` that all plans share, such as ``obstacles``, ``margin`` or ``solver``.
    """

    def __init__(self, robot: What, **keys: Any) -> None:
        self._robot, self._keys = robot, keys

    def __repr__(self) -> str:
        return f"<planner: {', '.join([repr(self._robot), *self._keys])}>"

    def plan(self, start: Any, goal: Any, **keys: Any) -> Plan:
        """A plan from a start to a goal.

        Args:
            start: as of :func:`plan`.
            goal: likewise.
            keys: further arguments of :func:`plan`, in place of those of all plans.

        Raises:
            ScenarioError: as of :func:`plan`.
        """
        return plan(self._robot, **(self._keys | keys), start=start, goal=goal)

    def plan_many(
        self, tasks: Iterable[tuple[Any, Any]], processes: int = 1, **keys: Any
    ) -> list[Plan | ScenarioError]:
        """Plans from starts to goals, in their order; the same, whatever the number of processes.

        Args:
            tasks: pairs of start and goal.
            processes: that share the work. In a script of your own the call stands below ``if __name__ == "__main__"``,
                as each of them reads it again.
            keys: further arguments of :func:`plan`, in place of those of all plans.

        Returns:
            Where a task is refused, the error in place of its plan.

        Raises:
            ScenarioError: ``processes`` is no whole number from 1 on.
        """
        if whole("processes", processes) < 1:
            raise ScenarioError(f"processes: {processes} is fewer than 1")
        pairs, planned = list(tasks), partial(_attempt, self, keys)
        if processes == 1 or len(pairs) < 2:
            found = [planned(pair) for pair in pairs]
        else:
            with ProcessPoolExecutor(min(processes, len(pairs)), get_context("spawn")) as pool:
                found = list(pool.map(planned, pairs))
        return [one if isinstance(one, ScenarioError) else Plan(one) for one in found]


def _attempt(planner: Planner, keys: dict[str, Any], task: tuple[Any, Any]) -> PlannedMotion | ScenarioError:
    try:
        return planner.plan(*task, **keys).planned
    except ScenarioError as error:
        return error

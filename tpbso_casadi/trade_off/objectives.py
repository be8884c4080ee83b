"""Two objectives of a scenario, and the scenarios that minimise one, or a sum of both."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

from problems import Objective, Problem
from problems.assembly.criteria import Criteria
from problems.base.matrix import FloatArray
from problems.motions.trajectory import Trajectory
from tpbso_casadi.plugins import PluginError
from tpbso_casadi.scenario.catalogues import find_objective
from tpbso_casadi.scenario.scenario import Scenario, parse_scenario
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.trade_off.placement import ENDS
from tpbso_casadi.trade_off.point import Pair, Request, Scalarisation

BOUND = "total_time"  # the key of [task] that bounds the duration
SHORTEST = 1e-3  # of the longest duration, where the scenario states no shortest


@dataclass(frozen=True)
class Objectives:
    """Two objectives of one scenario.

    Args:
        scenario: that states everything but the objective.
        names: of the two.

    Raises:
        ScenarioError: there are not two different ones, one is unknown, or the task has no objective to choose.
    """

    scenario: Scenario
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        if len(self.names) != len(ENDS) or len(set(self.names)) != len(ENDS):
            raise ScenarioError(f"--objectives {','.join(self.names)}: two different ones are needed")
        for name in self.names:
            try:
                find_objective(name, self.scenario.task.own_objectives)
            except PluginError as error:
                raise ScenarioError(f"--objectives: {error}") from error
        if "objective" not in type(self.scenario.task).model_fields:
            raise ScenarioError(f"task.kind: {self.scenario.task.kind!r} has no objective to choose")
        if self.scenario.solver.within is not None:
            raise ScenarioError("solver.within: a trade-off makes plans of so many evaluations; leave it out")

    @property
    def both(self) -> tuple[Objective, Objective]:
        """The objectives themselves."""
        first, second = (find_objective(name, self.scenario.task.own_objectives) for name in self.names)
        return first, second

    @property
    def headings(self) -> tuple[str, str]:
        """Their names with their units."""
        first, second = (f"{objective.name} [{objective.unit}]" for objective in self.both)
        return first, second

    @property
    def duration(self) -> int | None:
        """Which of them is the duration, where the scenario can bound that; None where none is."""
        task, motion = self.scenario.task, self.scenario.model.motion
        foreign = {key for keys in task.keys_of.values() for key in keys} - set(task.keys_of.get(motion, ()))
        if BOUND not in type(task).model_fields or BOUND in foreign:
            return None
        return next((i for i, objective in enumerate(self.both) if objective.is_duration), None)

    def values(self, criteria: Criteria, trajectory: Trajectory, times: FloatArray) -> Pair:
        """Both, of a finished motion; one without a closed form at times (n,) in s."""
        first, second = (objective.of_motion(trajectory, criteria.robot, times) for objective in self.both)
        return first, second

    def asked_for(self, request: Request) -> Scenario:
        """The scenario of a request: as many more starts of a refinement as it gives, another seed at each attempt.

        Raises:
            ScenarioError: there is no such scenario.
        """
        solver = self.scenario.solver
        starts = solver.polish_starts if solver.kind().solves_program else solver.polish_starts + len(request.starts)
        further = {"seed": solver.seed + request.attempt, "polish_starts": starts}
        return self._scenario(request.scalarisation, further)

    @cached_property
    def _timing(self) -> dict[str, bool]:
        """Keys of [model] with which all points are timed alike: anew, where one of the ends would be.

        A plan for the least time that keeps the timing of its search would lose against any other that does not.
        """
        ends = [parse_scenario(self._content(Scalarisation(end), {})).model.retime for end in ENDS]
        return {"retime": True} if len(set(ends)) > 1 else {}

    def _scenario(self, asked: Scalarisation, further: dict[str, Any]) -> Scenario:
        content = self._content(asked, further)
        content["model"] |= self._timing
        return parse_scenario(content)

    def _content(self, asked: Scalarisation, further: dict[str, Any]) -> dict[str, Any]:
        content = self.scenario.model_dump()
        content["model"] = self.scenario.model.stated()
        content["solver"] |= further
        content["task"]["objective"] = self._objective(asked.weights)
        if asked.longest is not None:
            stated = content["task"][BOUND]
            content["task"][BOUND] = [SHORTEST * asked.longest if stated is None else stated[0], asked.longest]
        return content

    def _objective(self, weights: Pair) -> str | dict[str, float]:
        """The key of [task]: one alone, or a table of both."""
        terms = {name: weight for name, weight in zip(self.names, weights, strict=True) if weight != 0.0}
        return dict(terms) if len(terms) > 1 else next(iter(terms))

    def problems(self) -> tuple[Problem[Any], Problem[Any]]:
        """The problems of both ends.

        Raises:
            ScenarioError: the robot cannot do the task, or an objective does not apply to it.
        """
        first, second = (self.asked_for(Request(scalarisation=Scalarisation(end))).problem() for end in ENDS)
        return first, second

"""The runs of a campaign: scenarios times solvers times seeds."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from tpbso_casadi.campaign.run import Run
from tpbso_casadi.scenario.scenario import Scenario, SolverSection, parse_scenario
from tpbso_casadi.scenario.section import ScenarioError

SPEC = re.compile(r"(?P<name>[^()+\s]+)(?:\((?P<settings>[^()]*)\))?(?P<polish>\+polish(?P<starts>\d*))?")


@dataclass(frozen=True)
class SolverSpec:
    """A solver as stated on a command line.

    Attributes:
        label: as stated; for tables.
        name: of the solver.
        settings: those that differ from the solver's defaults.
        polish_starts: candidates that IPOPT refines afterwards.
        table: further keys of the scenario's [solver] table.
    """

    label: str
    name: str
    settings: Mapping[str, int | float | str] = field(default_factory=dict)
    polish_starts: int = 0
    table: Mapping[str, Any] = field(default_factory=dict)

    def applied(self, scenario: Scenario, seed: int) -> Scenario:
        """The scenario with this solver. Of its own [solver] table only the budget is kept if the solver is another.

        Raises:
            ScenarioError: an unknown solver or setting.
        """
        content = scenario.model_dump()
        table = content["solver"]
        if self.name != scenario.solver.name:
            table |= {"population": None, "settings": {}}
        table |= {"name": self.name, "polish_starts": self.polish_starts, "seed": seed, **self.table}
        table["settings"] |= dict(self.settings)
        if not SolverSection(name=self.name).kind().has_population:
            table["population"] = None
        applied = parse_scenario(content)
        applied.solver.build()
        return applied


def parse_solvers(text: str) -> list[SolverSpec]:
    """Read a list of solvers: ``bso,bso(lambda_=0.4,antenna_sign=printed),pso+polish,abso+polish3,ipopt``.

    Raises:
        ScenarioError: a solver cannot be read, or is stated twice.
    """
    specs = [parse_solver(part.strip()) for part in re.split(r",(?![^()]*\))", text)]
    labels = [spec.label for spec in specs]
    duplicate = next((label for label in labels if labels.count(label) > 1), None)
    if duplicate is not None:
        raise ScenarioError(f"solvers: {duplicate} is there twice")
    return specs


def parse_solver(text: str) -> SolverSpec:
    """Read one solver: ``NAME``, ``NAME(setting=value,...)``, either with ``+polish`` or ``+polishN`` behind it.

    Raises:
        ScenarioError: it cannot be read.
    """
    match = SPEC.fullmatch(text)
    if match is None:
        raise ScenarioError(f"solvers: {text!r} is not NAME, NAME(setting=value) or NAME+polish")
    pairs = match["settings"].split(",") if match["settings"] else []
    settings = dict(_setting(text, pair) for pair in pairs)
    starts = 0 if match["polish"] is None else int(match["starts"] or 1)
    return SolverSpec(text, match["name"], settings, starts)


def _setting(text: str, pair: str) -> tuple[str, int | float | str]:
    name, equals, value = (part.strip() for part in pair.partition("="))
    if not (name and equals and value):
        raise ScenarioError(f"solvers: {text!r}: {pair.strip()!r} is not setting=value")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value


def grid(scenarios: Mapping[str, Scenario], specs: Sequence[SolverSpec], seeds: Sequence[int]) -> list[Run]:
    """Every scenario with every solver and seed; all of one seed before the next, so that any part is a fair sample.

    Raises:
        ScenarioError: naming the case: its task cannot be done, or a solver does not fit it.
    """
    runs = []
    for case, scenario in scenarios.items():
        try:
            scenario.problem()
        except ScenarioError as error:
            raise ScenarioError(f"{case}: {error}") from error
    for seed in seeds:
        for case, scenario in scenarios.items():
            for spec in specs:
                try:
                    runs.append(Run(case, spec.label, spec.applied(scenario, seed)))
                except ScenarioError as error:
                    raise ScenarioError(f"{case}: {spec.label}: {error}") from error
    return runs

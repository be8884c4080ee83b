"""One run of a campaign: what identifies it, and how it is done, wherever that is."""

from __future__ import annotations

import json
import threading
import time
import traceback
from dataclasses import asdict, dataclass
from functools import cached_property, lru_cache
from hashlib import sha256
from typing import Any

from problems import Problem
from problems.evaluation import EvaluationOptions
from tpbso_casadi.planning.plan import plan
from tpbso_casadi.scenario.scenario import Scenario, SolverSection, parse_scenario
from tpbso_casadi.storage.run_folder import as_json, result_of
from tpbso_casadi.storage.versions import versions

KEPT = 64  # problems of a worker: some 10 MB each
ONE_AT_A_TIME = threading.Lock()  # IPOPT's linear solver is not made for threads, and a cluster's worker may have many


@dataclass(frozen=True)
class Run:
    """One search of one scenario.

    Attributes:
        case: what the scenario is called in tables.
        solver: what the solver and its settings are called there.
        scenario: everything else: arm, task, limits, solver, budget and seed.
    """

    case: str
    solver: str
    scenario: Scenario

    @property
    def seed(self) -> int:
        """Of the search."""
        return self.scenario.solver.seed

    @cached_property
    def key(self) -> str:
        """A digest of everything that decides what comes out, defaults filled in; labels do not count."""
        content, asked = self.scenario.model_dump(mode="json"), self.scenario.solver
        content["solver"] |= {"settings": asdict(asked.build()), "budget": asdict(asked.budget())}  # type: ignore[arg-type]
        return sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]

    @property
    def task(self) -> tuple[str, dict[str, str]]:
        """What :func:`run_one` takes; plain data, so that it can travel anywhere."""
        return self.scenario.model_dump_json(), versions()


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes:
        result: the text of its ``result.json``, compact; None where it failed.
        seconds: that it took as a whole.
        error: why it failed, one line.
        details: the traceback.
    """

    result: str | None
    seconds: float
    error: str = ""
    details: str = ""


class OtherVersions(RuntimeError):
    """Whoever does the run has other versions of what decides its result."""


def run_one(scenario: str, expected: dict[str, str], backend: str | None = None) -> Outcome:
    """Do one run; whatever goes wrong in it is an outcome too.

    Args:
        scenario: JSON.
        expected: the versions that the campaign is made with.
        backend: what prices a population; None for what the environment says. It changes no result.
    """
    with ONE_AT_A_TIME:
        began = time.perf_counter()
        try:
            return Outcome(_result(scenario, expected, backend), time.perf_counter() - began)
        except Exception as error:
            message = " ".join(f"{type(error).__name__}: {error}".split())
            return Outcome(None, time.perf_counter() - began, message, traceback.format_exc())


def _result(scenario: str, expected: dict[str, str], backend: str | None) -> str:
    ours = versions()
    if ours != expected:
        raise OtherVersions(f"{difference(ours, expected)} on this worker")
    asked = parse_scenario(json.loads(scenario))
    problem = _problem(asked.model_copy(update={"solver": SolverSection()}).model_dump_json())
    found = plan(asked, pricing=None if backend is None else EvaluationOptions(backend), problem=problem)
    if found.interrupted:
        raise InterruptedError("the run was interrupted")
    content: dict[str, Any] = result_of(found)
    return as_json(content, indent=None)


@lru_cache(maxsize=KEPT)
def _problem(scenario: str) -> Problem:
    """The problem of a scenario; the same one, with its compiled costs, for all runs of a worker."""
    return parse_scenario(json.loads(scenario)).problem()


def difference(found: dict[str, str], expected: dict[str, str]) -> str:
    """The first version that differs, in words."""
    name = next(name for name in {**expected, **found} if found.get(name) != expected.get(name))
    return f"{name} {found.get(name, 'is missing')} where {expected.get(name, 'none')} is needed"

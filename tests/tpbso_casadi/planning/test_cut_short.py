"""A callback or a solver that raises while a motion is planned: it is raised again, with the best until then."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.slow import slow_except
from helpers.space_scenarios import space_scenario

import tpbso_casadi as tp
from solvers import Status, best_so_far
from tpbso_casadi.planning import JudgedMotion, PlannedMotion, Progress, plan
from tpbso_casadi.storage import read_run, write_plan


class Boom(RuntimeError):
    """Raised in the tests."""


class Raising:
    """Callbacks that raise: when a phase begins for the n-th time, or after so many statuses of it.

    Args:
        phase: that it begins in.
        number: how often the phase begins until then.
        statuses: that it gets in it before; None to raise when it begins.
    """

    def __init__(self, phase: str, number: int = 1, statuses: int | None = None) -> None:
        self.phases: list[str] = []
        self.statuses: list[Status] = []
        self._phase, self._number, self._left = phase, number, statuses

    @property
    def progress(self) -> Progress:
        return Progress(self._status, self._begins)

    def _is_there(self) -> bool:
        return self.phases[-1] == self._phase and self.phases.count(self._phase) == self._number

    def _begins(self, phase: str) -> None:
        self.phases.append(phase)
        if self._left is None and self._is_there():
            raise Boom(phase)

    def _status(self, status: Status) -> None:
        self.statuses.append(status)
        if self._left is not None and self._is_there():
            self._left -= 1
            if self._left < 0:
                raise Boom(str(status.evaluations))


def cut_short(scenario: tp.Scenario, raising: Raising) -> PlannedMotion:
    with pytest.raises(Boom) as caught:
        plan(scenario, raising.progress)
    found = best_so_far(caught.value, PlannedMotion)
    assert found is not None and found.interrupted
    return found


def stated(name: str, **keys: Any) -> tp.Scenario:
    return tp.scenario_of(name, **{"solver": "pso", "evaluations": 600, "polish": False, **keys})


def test_in_a_search() -> None:
    raising = Raising("searching", statuses=3)
    found = cut_short(stated("time-3", solver="random", retime=True), raising)
    assert found.search.stop_reason == "error" and found.polish is found.retiming is None
    assert (found.search.cost, found.search.evaluations) == (
        raising.statuses[-1].cost,
        raising.statuses[-1].evaluations,
    )
    whole = plan(stated("time-3", solver="random", evaluations=found.search.evaluations, retime=False))
    assert whole.search.x.tolist() == found.search.x.tolist()
    assert whole.trajectory.coefficients.tolist() == found.trajectory.coefficients.tolist()


@pytest.mark.parametrize("raising", [("polishing", 1, None), ("polishing", 1, 0), ("retiming", 1, None)])
def test_after_a_search(raising: tuple[str, int, int | None]) -> None:
    found = cut_short(stated("time-2", polish=2, retime=True), Raising(*raising))
    assert found.search.stop_reason == "evaluations"
    assert found.retiming is None and (found.polish is None) == (raising[0] == "polishing")


def test_in_descents() -> None:
    found = cut_short(tp.scenario_of("time-2", solver="ipopt", iterations=3), Raising("searching", statuses=1))
    assert (found.search.iterations, found.search.stop_reason) == (2, "error")
    assert found.motion.trajectory.is_finite


@pytest.mark.parametrize(("number", "statuses"), slow_except([(1, 3), (2, 2)], [(1, 3)]))
def test_within_a_time(number: int, statuses: int) -> None:
    """In the first search its own best is left; in a later one the best of all rounds."""
    raising = Raising("searching", number, statuses)
    found = cut_short(stated("time-2", within=60.0, evaluations=400, polish=1), raising)
    assert raising.phases.count("searching") == number
    assert found.rounds == number and (found.polish is None) == (number == 1)


MOVED = space_scenario(solver={"name": "pso", "evaluations": 600})


def test_in_the_race_of_branches(tmp_path: Path) -> None:
    raising = Raising("racing branches", statuses=0)
    found = cut_short(tp.parse_scenario(MOVED), raising)
    assert found.rounds == 1 and found.search.evaluations == raising.statuses[-1].evaluations
    assert found.problem.branch and found.search.stop_reason == "error"
    write_plan(tmp_path / "run", found)  # what is stored is checked like any run
    assert read_run(tmp_path / "run").result.interrupted


@pytest.mark.parametrize("number", slow_except((1, 2), (1,)))
def test_in_the_search_of_a_finalist(number: int) -> None:
    raising = Raising("searching", number, 2)
    found = cut_short(tp.parse_scenario(MOVED), raising)
    assert found.rounds > 1 and raising.phases.count("searching") == number
    assert (found.search.stop_reason == "error") == (number == 1)


def test_before_there_is_anything_nothing_is_kept() -> None:
    for raising in (Raising("modelling"), Raising("searching")):
        with pytest.raises(Boom) as caught:
            plan(stated("time-2"), raising.progress)
        assert best_so_far(caught.value, object) is None


@dataclass(frozen=True)
class Bursts(tp.Solver):
    """Raises after its first candidates."""

    def search(self, box: tp.SearchBox, rng: np.random.Generator, iterations: tp.Iterations) -> tp.Search:
        yield box.sample(rng, 10)
        raise Boom


def test_a_sequence_is_no_plan_before_all_of_it_is() -> None:
    arm = tp.robot([0.5, 0.5], max_speed=4.0, max_acceleration=20.0)
    start, stages = tp.Joints((0.3, 0.9)), [tp.MoveTo(tp.Joints((1.3, 0.2)))]
    with pytest.raises(Boom) as caught:
        tp.sequence(arm, start=start, stages=stages, solver=Bursts())
    assert best_so_far(caught.value, object) is None


def test_of_a_call_it_is_a_plan_that_can_be_saved(tmp_path: Path) -> None:
    with pytest.raises(Boom) as caught:
        tp.plan("time-2", solver=Bursts())
    kept = best_so_far(caught.value, tp.Plan)
    assert kept is not None
    kept.save(tmp_path / "run", figures=())
    assert tp.read_run(tmp_path / "run").result.stop_reason == "error"


# Motions and candidates that are no numbers


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_no_model_evaluates_a_candidate_that_is_not_finite(bad: float) -> None:
    problem = tp.scenario_of("time-3", formulation="reduced").problem()
    x = np.mean(problem.bounds, axis=0)
    for column in range(x.size):
        candidates = np.stack([x, x])
        candidates[1, column] = bad
        reason = f"variable {column} of candidate 1 is {bad}; finite numbers are needed"
        evaluations: tuple[Callable[[np.ndarray], np.ndarray], ...] = (problem.cost, problem.evaluator())
        for evaluate in evaluations:
            with pytest.raises(ValueError, match=re.escape(reason)):
                evaluate(candidates)


def test_a_motion_that_is_none_is_worse_than_any() -> None:
    found = plan(stated("time-2"))
    trajectory = replace(found.trajectory, coefficients=np.full_like(found.trajectory.coefficients, np.nan))
    none: JudgedMotion = replace(found.motion, trajectory=trajectory)
    assert none.merit == np.inf and not none.feasible
    assert np.isfinite(found.motion.merit)

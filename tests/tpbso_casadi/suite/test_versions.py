"""Versions of the suite: what the second has of its own, and how far merits are from what motions are certified at."""

from __future__ import annotations

from hashlib import sha256
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from helpers.evaluation import needs_compiler

import tpbso_casadi as tp
from benchmarks.freeze.definitions import INSTANCES
from benchmarks.suite import difference_line, differences_of
from problems.base import as_array
from tpbso_casadi.suite import frozen, problem_named
from tpbso_casadi.suite.motions import problem_of

SUITE, SECOND = tp.suite(), tp.suite(version=2)
OWN = [each for each in SECOND if each.suite == SECOND.name]
KNOWN = [each.name for each in (*SUITE, *OWN) if each.best_known is not None]
FIRST_SUITE = "79b77459a5ef0a934cb7818ae4ed2e448d2c4cdeda4537c18aa5541c3fdd9bf0"  # digest of its descriptions
PAGE = Path(__file__).parents[3] / "benchmarks/results/suite.md"
MOST_APART = 0.005  # of a merit: from what the motion of a best known candidate is certified at
FARTHER = {  # of which more is known, and why: the page says it
    **dict.fromkeys(("star-rotation", "curve-rotation"), 0.012),
    **dict.fromkeys(("panda-boxes", "panda-payload"), 0.015),
    **{"narrow-5": 0.01, "ur5e-box": 0.006, "ur5e-box-coarse": 0.051, "time-length-4": 0.019},
}
FARTHER_FIRST = {"energy-3": 0.223, "time-energy-3": 0.289}  # of the first suite, mended in the second
FEW = "arm-motions-2/time-energy-3@8"


def most_apart(name: str) -> float:
    """The largest relative difference that a function is known to have."""
    function = problem_named(name).function.name
    first = FARTHER_FIRST if name.startswith("arm-motions-1/") else {}
    return {**FARTHER, **first}.get(function, MOST_APART)


def _slow_of(function: frozen.Description) -> list[pytest.MarkDecorator]:
    """Fronts have 360 motions, which are not stored."""
    return [pytest.mark.slow] if len(function.objectives) > 1 else []


# Which there are


def test_the_second_suite_has_two_functions_of_its_own() -> None:
    """All else is the first one's, under its names, so that what is published of that stays true."""
    assert repr(SECOND) == "<suite arm-motions-2: 540 problems of 36 functions>"
    assert {each.function.name for each in OWN} == {"energy-3", "time-energy-3"} and len(OWN) == 2 * INSTANCES
    for first, second in zip(SUITE, SECOND, strict=True):
        assert (first.function.name, first.instance) == (second.function.name, second.instance)
        if second.suite == "arm-motions-1":
            assert first.name == second.name and first.function is second.function
            continue
        assert second.name == first.name.replace("motions-1", "motions-2")
        assert second._content.scenarios == first._content.scenarios
        assert all(np.array_equal(*pair) for pair in zip(first.bounds, second.bounds, strict=True))
        for key in ("group", "title", "form", "dimension", "variables", "objectives", "constraints", "instances"):
            assert getattr(first.function, key) == getattr(second.function, key)
    assert SECOND["spline-3@2"] is SECOND["arm-motions-2/spline-3@2"] is SECOND["arm-motions-1/spline-3@2"]
    assert problem_named("arm-motions-2/spline-3@2").name == "arm-motions-1/spline-3@2"
    assert problem_named("arm-motions-2/energy-3@2").name == "arm-motions-2/energy-3@2"


def test_the_first_suite_stays_what_it_was() -> None:
    folder = frozen.folder_of("arm-motions-1")
    assert sha256((folder / "suite.json").read_bytes()).hexdigest() == FIRST_SUITE
    for function in SUITE.functions:
        assert sha256((folder / f"{function.name}.npz.xz").read_bytes()).hexdigest() == function.digest


def test_a_name_or_a_version_says_which() -> None:
    assert tp.suite().name == tp.suite("arm-motions-1").name == tp.suite(version=1).name == "arm-motions-1"
    assert [each.name for each in tp.suite("arm-motions-2")] == [each.name for each in SECOND]
    for wrong in ("2", 2.0, True):
        with pytest.raises(TypeError, match="version: a whole number is needed"):
            tp.suite(version=wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="name and version: one of them says which suite"):
        tp.suite("arm-motions-2", version=2)
    with pytest.raises(TypeError, match="name: that of a suite is needed"):
        tp.suite(2)  # type: ignore[arg-type]


# Merits and motions


def test_known_merits_are_near_the_objectives_of_their_motions() -> None:
    """As stored; that they are so is what a slow test of :mod:`test_suite` says of each."""
    assert [name for name in KNOWN if abs(differences_of(problem_named(name))).max() > most_apart(name)] == []


@needs_compiler
def test_merits_on_a_known_front_are_near_the_objectives_of_their_motions() -> None:
    """A few of one front; all of all fronts are what the page is compared with below."""
    assert abs(differences_of(problem_named(FEW), 8)).max() <= most_apart(FEW)


@pytest.mark.parametrize("function", [pytest.param(each.name, marks=_slow_of(each)) for each in SUITE.functions])
def test_the_manual_says_how_far_merits_are_from_motions(function: str) -> None:
    assert difference_line(function) in PAGE.read_text()


@needs_compiler
def test_what_a_merit_of_the_second_suite_says_is_what_its_motion_takes() -> None:
    """The torques of the motion, squared and summed over 20,000 equal steps; the first suite counts 44 % less.

    The candidate is the best one that is known there, which hides torques on one side of accelerations that jump.
    """
    first, second = (each["energy-3@6"] for each in (SUITE, SECOND))
    assert first.best_known is not None
    x = first.best_known.x
    energies: list[float] = []
    counted: list[float] = []
    for each in (first, second):
        model = problem_of(each.scenario, each.suite)
        own = model.motion.trajectory(model.parameters_of(x))
        steps = (np.arange(20_000) + 0.5) / 20_000 * own.duration
        torques = as_array(model.criteria.robot.dynamics.torques(*(ca.DM(own.at(steps, order)) for order in range(3))))
        energies.append(own.duration * (torques**2).sum(axis=1).mean())
        counted.append((each.merit(x[None])[0] - own.duration) / 0.002)
    assert energies[0] == pytest.approx(energies[1], rel=1e-12)
    assert counted[1] == pytest.approx(energies[1], rel=1e-3)
    assert counted[0] == pytest.approx(0.563 * energies[0], rel=1e-2)

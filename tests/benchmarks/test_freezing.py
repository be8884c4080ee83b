"""How instances of the suite are made, and lower bounds of what they are worth."""

from __future__ import annotations

import numpy as np
import pytest

import tpbso_casadi as tp
from benchmarks.freeze.definitions import DEFINITIONS
from benchmarks.freeze.freezing import instance_of, lower_bound
from tpbso_casadi.suite import problem_named
from tpbso_casadi.suite.frozen import content_of
from tpbso_casadi.suite.motions import problem_of

SUITE = tp.suite()


@pytest.mark.parametrize("name", ["arm-motions-1/spline-2@5", "arm-motions-2/energy-3@5"])
def test_an_instance_is_made_of_its_scenario(name: str) -> None:
    """What is stored follows from the tables alone; the last digits may be those of another CasADi."""
    each = problem_named(name)
    [definition] = [found for found in DEFINITIONS if found.name == each.function.name]
    content = content_of(each.suite, each.function.name, each.function.digest)
    instance = instance_of(content.scenarios[4], definition)
    [(numbers, indices)] = instance.scenes()
    np.testing.assert_allclose(numbers, content.numbers[0][4], rtol=1e-13)
    assert np.array_equal(indices, content.indices[0][4])
    assert [structure.source for structure in instance.structures] == [kernel.source for kernel in content.kernels]


def test_lower_bounds_are_those_of_joints_by_themselves() -> None:
    each = SUITE["spline-2@1"]
    tables, model = each._content.scenarios[0], problem_of(each.scenario, each.suite)
    arm, task = tables["arm"], tables["task"]
    way = np.abs(np.subtract(task["goal"]["joints"], task["start"]["joints"]))
    speed, acceleration = np.array(arm["max_speed"]), np.array(arm["max_acceleration"])
    full, short = way / speed + speed / acceleration, 2.0 * np.sqrt(way / acceleration)
    ramps = np.where(way * acceleration > speed**2, full, short)
    assert lower_bound(tables, model) == pytest.approx(ramps.max(), rel=1e-12)
    assert each.lower_bound == pytest.approx(ramps.max(), rel=1e-12)
    paper = SUITE["paper-time-3@1"]
    assert (
        lower_bound(paper._content.scenarios[0], problem_of(paper.scenario, paper.suite)) is None
        and paper.lower_bound is None
    )

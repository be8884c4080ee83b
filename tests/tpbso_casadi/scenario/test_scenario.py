"""The scenario file: defaults and round trips; built-in scenarios and the best plans known of them."""

from __future__ import annotations

from tpbso_casadi import Scenario, builtin, parse_scenario
from tpbso_casadi.scenario.cases import BEST_KNOWN, TITLES, best_known

ARM = {"link_lengths": [0.5, 0.5, 0.5, 0.5], "max_speed": 4.0, "max_acceleration": 20.0}
POINT = {
    "arm": ARM,
    "task": {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]},
    "obstacles": [{"center": [0.8, 0.8], "semi_axes": [0.15, 0.25]}],
}


def test_built_in_scenarios_survive_the_round_trip() -> None:
    for name in TITLES:
        scenario = builtin(name)
        assert isinstance(scenario, Scenario)
        assert parse_scenario(scenario.table()) == scenario


def test_defaults_are_filled_in() -> None:
    scenario = parse_scenario(POINT)
    assert scenario.task.elbow == "free"
    assert (scenario.model.samples, scenario.model.motion, scenario.model.retime) == (50, "spline", True)
    assert (scenario.solver.name, scenario.solver.seed, scenario.solver.budget().evaluations) == ("bso", 1, 30_000)
    assert scenario.problem().criteria.robot.limits.speed == (4.0,) * 4


def test_the_best_known_is_that_of_the_same_statement() -> None:
    assert set(BEST_KNOWN) == set(TITLES)
    for name, best in BEST_KNOWN.items():
        assert best_known(builtin(name)) == best
    content = builtin("time-3").table()
    assert best_known(parse_scenario(content | {"model": {"formulation": "reduced"}})) == BEST_KNOWN["time-3"]
    content["arm"]["max_speed"] = 5.0
    assert best_known(parse_scenario(content)) is None

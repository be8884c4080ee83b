"""Files whose angles are in degrees."""

from __future__ import annotations

from math import degrees, pi
from typing import Annotated, Any

import pytest
from pydantic import Field

from tpbso_casadi.scenario import ScenarioError, Section, parse_scenario
from tpbso_casadi.scenario.validation import ANGULAR, Angle, FileSection, Number


class Place(Section):
    """A table within a table."""

    joints: Annotated[list[Number] | None, ANGULAR] = None
    point: list[Number] | None = None


class Places(FileSection):
    """A file with tables, a list of tables, an angle by default."""

    start: Place
    goals: list[Place] = Field(default_factory=list)
    turn: Angle = pi / 2.0


def scenario(unit: str, factor: float) -> dict[str, Any]:
    return {
        "unit": unit,
        "arm": {
            "link_lengths": [0.7, 0.6, 0.5],
            "max_speed": 4.0 * factor,
            "max_acceleration": [20.0 * factor, 21.0 * factor, 22.0 * factor],
            "joint_limits": [[-3.0 * factor, 3.0 * factor]] * 3,
        },
        "task": {"kind": "path", "shape": "pentagram", "radius": 0.5, "accuracy": 0.1, "angle": 1.0 * factor},
        "obstacles": [{"center": [0.0, 3.0], "semi_axes": [0.1, 0.2], "angle": 0.5 * factor}],
    }


def test_degrees_are_radians_once_the_file_is_read() -> None:
    in_degrees, in_radians = (
        parse_scenario(scenario(unit, factor)).model_dump() for unit, factor in (("deg", degrees(1.0)), ("rad", 1.0))
    )
    assert in_degrees.pop("unit") == in_radians.pop("unit") == "rad"
    assert _flat(in_degrees) == pytest.approx(_flat(in_radians), rel=1e-15, abs=0.0)


def _flat(content: Any, key: str = "") -> dict[str, Any]:
    if isinstance(content, dict | list | tuple):
        items = content.items() if isinstance(content, dict) else enumerate(content)
        return {name: leaf for k, value in items for name, leaf in _flat(value, f"{key}.{k}").items()}
    return {key: content} if isinstance(content, float) else {}


def test_what_is_no_angle_and_what_is_not_stated_stays() -> None:
    read = Places.model_validate(
        {"unit": "deg", "start": {"joints": [180.0]}, "goals": [{"joints": [90.0, 0.0]}, {"point": [90.0]}]}
    ).normalised()
    assert read.start.joints == [pi]
    assert [place.joints for place in read.goals] == [[pi / 2.0, 0.0], None]
    assert read.goals[1].point == [90.0]
    assert read.turn == pi / 2.0
    assert read == Places.model_validate(read.model_dump()).normalised()


def test_another_unit_is_a_named_error() -> None:
    with pytest.raises(ScenarioError, match=r"^unit: input should be 'rad' or 'deg', not 'grad'"):
        parse_scenario(scenario("grad", 1.0))

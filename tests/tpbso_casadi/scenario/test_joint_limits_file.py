"""``joint_limits.yaml``: what it changes of a robot, what overrides it, what is refused of it."""

from __future__ import annotations

from math import pi
from pathlib import Path
from typing import Any

import pytest
from helpers.refused import SHORT

import tpbso_casadi as tp
from tpbso_casadi import ScenarioError

TURN = "has_velocity_limits: true, max_velocity: 1.0, has_acceleration_limits: true, max_acceleration: 4.0"
LIFT = "max_velocity: 2.0, max_acceleration: 3, max_deceleration: -2.0"


@pytest.fixture(autouse=True)
def urdf(in_an_empty_folder: None) -> None:
    Path("short.urdf").write_text(SHORT)


def robot(turn: str = TURN, lift: str = LIFT, more: str = "", **keys: Any) -> Any:
    """The model of the arm with limits of its two joints."""
    text = f"joint_limits:\n  turn: {{{turn}}}\n  lift: {{{lift}}}\n  finger: {{max_velocity: 1.0}}\n{more}"
    Path("limits.yaml").write_text(text)
    return tp.robot("short.urdf", limits="limits.yaml", **keys).model


def test_limits_of_the_file_replace_those_of_the_urdf_and_numbers_replace_both() -> None:
    limits = robot().limits
    assert (limits.speed, limits.acceleration, limits.jerk) == ((1.0, 2.0), (4.0, 2.0), None)
    assert limits.position == ((-2.0, 2.0), (-1.0, 1.0))
    stated = robot(max_speed=0.5, max_acceleration=[1.0, 7.0], max_jerk=90.0, joint_limits=[[0.0, 1.0]] * 2).limits
    assert (stated.speed, stated.acceleration, stated.jerk) == ((0.5, 0.5), (1.0, 7.0), (90.0, 90.0))
    assert stated.position == ((0.0, 1.0), (0.0, 1.0))


def test_what_it_leaves_out_stays_and_ranges_jerks_degrees_and_soft_limits_are_read() -> None:
    turn = "max_acceleration: 1.0, max_jerk: 50.0, min_position: !degrees -90.0, max_position: !radians 1.0"
    soft = "max_acceleration: 1.0, max_jerk: 60, has_soft_limits: true, soft_lower_limit: -0.5"
    limits = robot(turn, soft).limits
    assert limits.speed == (1.5, 2.5) and limits.jerk == (50.0, 60.0)
    assert limits.position == (pytest.approx((-pi / 2.0, 1.0)), (-0.5, 1.0))


def test_moveits_shares_are_of_speed_and_acceleration_of_the_urdf_too() -> None:
    shares = "default_velocity_scaling_factor: 0.1\ndefault_acceleration_scaling_factor: 0.5\n"
    limits = robot("max_acceleration: 4.0", more=shares).limits
    assert limits.speed == pytest.approx((0.15, 0.2)) and limits.acceleration == (2.0, 1.0)
    assert robot(more=shares, max_speed=1.5).limits.speed == (1.5, 1.5)


def test_a_range_ends_a_joint_that_turns_without_end() -> None:
    Path("short.urdf").write_text(SHORT.replace('"turn" type="revolute"', '"turn" type="continuous"'))
    assert robot().limits.position[0][1] > 1000.0
    assert robot(f"{TURN}, min_position: -3.0, max_position: 2.0").limits.position[0] == (-3.0, 2.0)


def test_what_is_built_in_is_replaced_in_part() -> None:
    Path("limits.yaml").write_text("joint_limits: {panda_joint2: {max_acceleration: 1.5, max_jerk: 99.0}}")
    before, after = (tp.robot("panda", **keys).model.limits for keys in ({}, {"limits": "limits.yaml"}))
    assert after.acceleration == (before.acceleration[0], 1.5, *before.acceleration[2:])
    assert after.jerk == (before.jerk[0], 99.0, *before.jerk[2:]) and after.speed == before.speed


@pytest.mark.parametrize(
    ("turn", "more", "line"),
    [
        ("max_velocity: 1.0", "", "max_acceleration: missing: none is known for joint 'turn'"),
        (f"{TURN}, max_jerk: 9.0", "", "max_jerk: missing: none is known for joint 'lift'"),
        ("has_velocity_limits: false", "", "max_speed: missing: none is known for joint 'turn'"),
        ("has_position_limits: false", "", "joint_limits: missing: none are known for joint 'turn'"),
        ("has_jerk_limits: true", "", "limits: joint_limits.turn.max_jerk: missing key; has_jerk_limits says"),
        ("max_velocity: 0.0", "", "limits: joint_limits.turn.max_velocity: 0, so it never moves"),
        ("max_deceleration: 0", "", "limits: joint_limits.turn.max_deceleration: 0, so it never moves"),
        ("min_position: 3.0", "", "limits: joint_limits.turn.max_position: the range from 3 to 2 is empty"),
        ("max_velocty: 1.0", "", "limits: joint_limits.turn.max_velocty: unknown key; did you mean max_velocity?"),
        ("max_velocity: fast", "", "limits: joint_limits.turn.max_velocity: a number is needed, not 'fast'"),
        ("max_velocity: -1", "", "limits: joint_limits.turn.max_velocity: input should be greater than or equal to 0"),
        ("has_velocity_limits: 3", "", "limits: joint_limits.turn.has_velocity_limits: "),
        ("max_velocity: !degrees fast", "", "limits: not YAML in line 2: a tag says number"),
        ("max_velocity: 1.0, max_velocity: 2.0", "", "limits: not YAML in line 2: the key 'max_velocity' is there tw"),
        ("max_velocity: [1", "", "limits: not YAML in line"),
        (TURN, "default_velocity_scaling_factor: 1.5", "limits: default_velocity_scaling_factor: input should be"),
        (TURN, "default_velocity_scaling_factor: 0", "limits: default_velocity_scaling_factor: input should be"),
        (TURN, "robot_description: {}", "limits: robot_description: unknown key"),
    ],
)
def test_what_is_refused_or_missing_is_said_in_one_line(turn: str, more: str, line: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        robot(turn, "has_velocity_limits: true, max_velocity: 1.0, max_acceleration: 1.0", more)
    assert str(caught.value).startswith(line) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("joint_limits: {thumb: {max_velocity: 1.0}}", "limits: states no limit of turn, lift; it names thumb"),
        ("default_velocity_scaling_factor: 0.5", "limits: states no limit of turn, lift; it names no joints"),
        ("[]", "limits: "),
        ("", "limits: one document is needed, not 0"),
    ],
)
def test_other_files_are_refused(text: str, line: str) -> None:
    Path("limits.yaml").write_text(text)
    with pytest.raises(ScenarioError, match=f"^{line}"):
        tp.robot("short.urdf", limits="limits.yaml", max_acceleration=1.0).model  # noqa: B018
    with pytest.raises(ScenarioError, match=r"^limits: .*none\.yaml"):
        tp.robot("short.urdf", limits="none.yaml")

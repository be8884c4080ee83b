"""Functions of one instant: what they may be made of, how they are written down, and text that is none."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.cases import equal_links
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import InvalidProblem, Trajectory
from problems.evaluation.interpreter import BINARY, UNARY
from problems.motions import InvalidText, SampleFunction, Samples, random_states, read, traced
from problems.motions.expression_text import written
from problems.robots import Robot, SpatialArm
from tpbso_casadi import robot as space_robot

ARM = equal_links(3)
LENGTHS = np.array(ARM.link_lengths)


def states_of(robot: Robot, count: int = 5) -> tuple[np.ndarray, list[np.ndarray]]:
    states = random_states(robot, count)
    return states, np.split(states[:, :-1], 4, axis=1)


def tip(q: np.ndarray) -> np.ndarray:
    angles = np.cumsum(q, axis=1)
    return np.column_stack([np.cos(angles) @ LENGTHS, np.sin(angles) @ LENGTHS])


def tip_velocity(q: np.ndarray, speed: np.ndarray) -> np.ndarray:
    angles, turns = np.cumsum(q, axis=1), np.cumsum(speed, axis=1)
    return np.column_stack([-(np.sin(angles) * turns) @ LENGTHS, (np.cos(angles) * turns) @ LENGTHS])


def value(stated: Any, robot: Robot = ARM) -> np.ndarray:
    return traced(stated, robot, "constraint 'c'").probed(robot, states_of(robot)[0], duration=2.0)


def test_everything_that_a_view_has() -> None:
    states, (q, v, a, j) = states_of(ARM)
    np.testing.assert_allclose(value(lambda m: m.q), q)
    np.testing.assert_allclose(value(lambda m: m.theta + m.speed), q + v)
    np.testing.assert_allclose(value(lambda m: [m.acceleration[0], m.jerk[1]]), np.column_stack([a[:, 0], j[:, 1]]))
    np.testing.assert_allclose(value(lambda m: m.tool), tip(q), atol=1e-14)
    np.testing.assert_allclose(value(lambda m: m.positions[-1]), tip(q), atol=1e-14)
    np.testing.assert_allclose(value(lambda m: m.tool_velocity), tip_velocity(q, v), atol=1e-14)
    np.testing.assert_allclose(value(lambda m: m.time / m.duration)[:, 0], states[:, -1] / 2.0)


def test_what_is_differentiated_where_nobody_looks_first() -> None:
    def rare(m: Any) -> Any:
        return ca.if_else(m.q[0] < -5.0, ca.sumsqr(ca.jacobian(m.tool, m.q)), 0.0)

    states = states_of(ARM)[0]
    states[0, 0] = -6.0
    found = traced(rare, ARM, "constraint 'c'").probed(ARM, states)[:, 0]
    angles = np.cumsum(states[0, :3])
    reach = [np.linalg.norm([LENGTHS[n:] @ np.cos(angles[n:]), LENGTHS[n:] @ np.sin(angles[n:])]) for n in range(3)]
    np.testing.assert_allclose(found, [np.square(reach).sum(), 0.0, 0.0, 0.0, 0.0])


def test_the_rotation_of_a_tool_in_space() -> None:
    panda = space_robot("panda").model
    assert isinstance(panda, SpatialArm)
    states, (q, *_) = states_of(panda, 3)
    found = traced(lambda m: m.rotation[:, 2], panda, "c").probed(panda, states)
    np.testing.assert_allclose(found, panda.tool.at(q)[1][:, :, 2], atol=1e-13)


def test_short_where_it_can_be_and_written_out_where_it_is_differentiated() -> None:
    short = traced(lambda m: m.tool[1], ARM, "c")
    assert short.text == "= tool[1]"
    assert short.formula == "tool_1"
    _, (q, v, *_) = states_of(ARM)
    long = traced(lambda m: ca.jtimes(m.tool, m.q, m.speed), ARM, "c")
    assert {name for name, _ in long.entries} == {"q", "speed"}
    np.testing.assert_allclose(long.probed(ARM, states_of(ARM)[0]), tip_velocity(q, v), atol=1e-14)


def test_rows_of_symbols_and_of_numbers_are_the_same() -> None:
    function = traced(lambda m: [ca.norm_2(m.tool_velocity), m.time, 1.0], ARM, "c")
    coefficients = np.random.default_rng(3).normal(size=(4, 2, 3))
    motion = Trajectory(np.array([0.0, 0.7, 1.5]), coefficients)
    samples = motion.samples(np.linspace(0.0, 1.5, 7), ARM)
    all_at_once = np.asarray(function.at(samples))
    assert all_at_once.shape == (7, 3)
    one_by_one = [np.asarray(function.at(samples.rows(slice(row, row + 1)), smooth=True)) for row in range(7)]
    np.testing.assert_allclose(np.vstack(one_by_one), all_at_once, atol=1e-10)


def test_the_gradient_of_a_length_is_finite_at_rest() -> None:
    function = traced(lambda m: ca.norm_2(m.speed), ARM, "c")
    v, rest = ca.SX.sym("v", 1, 3), ca.DM.zeros(1, 3)
    samples = Samples(robot=ARM, derivatives=(ca.SX(1, 3), v), duration=ca.SX(1.0))
    for smooth in (False, True):
        slope = ca.Function("slope", [v], [ca.jacobian(function.at(samples, smooth), v)])
        assert bool(np.isfinite(np.asarray(slope(rest))).all()) is smooth


def test_every_operation_comes_back_as_it_was() -> None:
    x = ca.SX.sym("q", 2)
    points = np.random.default_rng(1).uniform(0.05, 0.9, (2, 9))
    for name in (*UNARY, *BINARY):
        operation = ca.SX.unary(UNARY[name], x[0]) if name in UNARY else ca.SX.binary(BINARY[name], x[0], x[1])
        text = written(operation, {"q": x})
        entries, function = read(text)
        chosen = [index for _, index in entries]
        before = ca.Function("f", [x], [operation])
        np.testing.assert_array_equal(np.asarray(function(points[chosen])), np.asarray(before(points)), name)
        assert text.startswith("w0 = ")


@settings(max_examples=40)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_numbers_come_back_to_the_last_bit(number: float) -> None:
    q = ca.SX.sym("q", 1)
    _, function = read(written(ca.vertcat(q + number, ca.SX(number)), {"q": q}))
    assert float(function(0.0)[1]) == number


NO_EXPRESSION = [
    ("", "neither"),
    ("w0 = sq(q[0])", "no line begins with ="),
    ("= w0", "w0 is not known yet"),
    ("w1 = sq(q[0])\n= w1", "w0 is next"),
    ("w0 = system(q[0])\n= w0", "no operation 'system' of 1"),
    ("w0 = sq(q[0], q[1])\n= w0", "no operation 'sq' of 2"),
    ("= password[0]", "nothing of a motion is called 'password'"),
    ("= nan", "no finite number"),
    ("= 1e999", "no finite number"),
    ("= __import__('os')", "no number"),
    ("= q[0]" + " " * 300 + "x", "too long"),
    ("jhpnnagiieahaaaadaaaaaaaaaaaaaaaaaaakaaaaaaadfifgefhogdgehjg", "neither"),
    ("= 1\n" * 50_000, "more than"),
]


def test_text_that_is_no_expression() -> None:
    for text, reason in NO_EXPRESSION:
        with pytest.raises(InvalidText, match="(?s)" + reason.replace("(", r"\(")) as error:
            read(text)
        assert "\n" not in str(error.value)
        assert len(str(error.value)) < 200


@settings(max_examples=60)
@given(st.text(alphabet="w01q[](), =.-e\nsqaddtool", max_size=60))
def test_no_text_crashes_the_reader(text: str) -> None:
    try:
        entries, function = read(text)
    except InvalidText:
        return
    assert function.size1_in(0) == len(entries)


def test_what_a_robot_has_not() -> None:
    for text, reason in (
        ("= tool[2]", r"tool\[2\] of 2"),
        ("= torque[0]", "masses"),
        ("= rotation[0]", "in space only"),
        ("= frame_9[0]", "no frame_9"),
    ):
        with pytest.raises(InvalidProblem, match=reason):
            SampleFunction(text).check(ARM, "constraints", "c")

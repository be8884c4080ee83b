"""The comparison of inverse kinematics: what arms are given to others, and how answers are judged."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import tpbso_casadi as tp
from benchmarks.inverse_kinematics import Answers, asked_arm, judged
from benchmarks.peers.inverse import restarted
from problems.base import FloatArray


@pytest.mark.parametrize(("name", "dof"), [("ur5e", 6), ("panda", 7)])
def test_others_are_given_the_chain_alone(name: str, dof: int, tmp_path: Path) -> None:
    arm, known = asked_arm(name, tmp_path), tp.robot(name)
    root = ElementTree.parse(arm.urdf).getroot()
    assert [joint.get("type") for joint in root.findall("joint")].count("revolute") == dof
    assert len(root.findall("link")) == len(root.findall("joint")) + 1
    read = tp.robot(str(arm.urdf), tip_link=arm.tip, max_acceleration=10.0)
    theta = arm.start(np.random.default_rng(0))
    np.testing.assert_allclose(read.forward(theta), known.forward(theta), atol=1e-12)
    np.testing.assert_allclose(read.forward(0.0 * theta), arm.at_zero, atol=1e-12)


def test_answers_are_judged_by_the_arm_itself_and_the_closed_form(tmp_path: Path) -> None:
    arm, robot = asked_arm("ur5e", tmp_path), tp.robot("ur5e")
    theta = np.array([0.3, -1.2, 1.4, -1.8, -1.5, 0.2])
    poses = robot.forward([theta] * 4)
    turn, off = 2.0 * np.pi * np.eye(6), 2e-6 * np.eye(6)
    postures = [robot.inverse(poses[0], touching=True), theta[None] - turn[4] * 2.0, (theta + off[5])[None], arm.none()]
    solved, median, most, wrong, out, found = judged(arm, Answers(postures, np.array([1.0, 2.0, 3.0, 4.0])), poses)
    assert (solved, median, most) == ("25.0%", "2,500,000", "3,850,000")
    assert (wrong, out) == ("1", "1")
    assert found == f"{(len(postures[0]) + 2) / (4 * len(postures[0])):.2%}"


def test_descents_begin_again_until_one_is_within_the_limits(tmp_path: Path) -> None:
    arm, answers = asked_arm("panda", tmp_path), iter([None, np.full(7, 3.0), None, np.zeros(7) + 2.0 * np.pi])

    def descend(_: FloatArray, theta: FloatArray) -> FloatArray | None:
        assert arm.keeps(theta)
        answer = next(answers)
        return answer if answer is None else answer - 1.5 * (np.arange(7) == 3) + 1.5 * (np.arange(7) == 5)

    theta = restarted(arm, descend)(np.eye(4), np.random.default_rng(0))
    np.testing.assert_allclose(theta, [[0.0, 0.0, 0.0, -1.5, 0.0, 1.5, 0.0]], atol=1e-12)

"""``tpbso robots inverse``: the postures it prints and writes, what it says where there is none, what it refuses."""

from __future__ import annotations

import csv
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.running import status
from helpers.urdf import ARM
from scipy.spatial.transform import Rotation

import tpbso_casadi as tp
from tpbso_casadi.cli.commands.robots import main

TABLE = {"shape": "box", "center": [0.0, 0.0, -0.06], "size": [2.0, 2.0, 0.1]}
OBSTACLES = '[[obstacles]]\nshape = "box"\ncenter = [0.0, 0.0, -0.06]\nsize = [2.0, 2.0, 0.1]\n'
POINT, DOWN = (0.4, 0.2, 0.3), (1.0, 0.0, 0.0, 0.0)
POSE = ("--position", "0.4", "0.2", "0.3", "--quaternion", "1", "0", "0", "0")


@pytest.fixture(autouse=True)
def folder(in_an_empty_folder: None) -> None:
    Path("cell.toml").write_text(f'[robot]\nmodel = "ur5e"\n{OBSTACLES}')
    Path("around.toml").write_text(OBSTACLES)
    Path("moving.toml").write_text(f"{OBSTACLES}velocity = [0.1, 0.0, 0.0]\n")
    Path("plane.toml").write_text("[arm]\nlink_lengths = [1.0, 1.0]\nmax_speed = 1.0\nmax_acceleration = 1.0\n")


def told(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> str:
    assert status(main, "inverse", *arguments) == code
    printed = capsys.readouterr()
    assert printed.err == ""
    return printed.out


def as_json(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 0) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(told(capsys, *arguments, "--json", code=code))
    return content


def joints(content: dict[str, Any]) -> np.ndarray:
    return np.array([posture["joints"] for posture in content["postures"]])


def test_all_postures_are_printed_with_what_they_are_worth(capsys: pytest.CaptureFixture[str]) -> None:
    arm = tp.robot("ur5e")
    theta = arm.inverse(tp.Pose(POINT, DOWN))
    assert isinstance(theta, np.ndarray)
    title, heading, _, *rows = told(capsys, "ur5e", *POSE).splitlines()
    assert title.startswith("8 postures, rad, of joints that slide m: q1 shoulder_pan_joint, q2 shoulder_lift_joint")
    assert heading.split() == [*(f"q{n}" for n in range(1, 7)), "manipulability", "clearance", "[m]"]
    numbers = np.array([row.split() for row in rows], dtype=float)
    np.testing.assert_allclose(numbers[:, :6], theta, atol=5.1e-4)
    np.testing.assert_allclose(numbers[:, 6], arm.manipulability(theta), atol=5.1e-5)
    np.testing.assert_allclose(numbers[:, 7], arm.clearance(theta), atol=5.1e-5)
    assert max(map(len, rows)) <= 80


def test_json_and_csv_hold_every_digit(capsys: pytest.CaptureFixture[str]) -> None:
    content = as_json(capsys, "ur5e", *POSE, "--csv", "postures.csv")
    arm, theta = tp.robot("ur5e"), joints(content)
    np.testing.assert_array_equal(theta, arm.inverse(tp.Pose(POINT, DOWN)))
    frames = arm.forward(theta)
    np.testing.assert_allclose(frames[:, :3, 3], np.tile(POINT, (8, 1)), atol=2e-9)
    np.testing.assert_allclose(frames[:, :3, :3], np.tile(Rotation.from_quat(DOWN).as_matrix(), (8, 1, 1)), atol=3e-9)
    header, *rows = csv.reader(Path("postures.csv").read_text().splitlines())
    assert header == [*content["joint_names"], "manipulability", "clearance"]
    np.testing.assert_array_equal(np.array(rows, dtype=float)[:, :6], theta)
    measures = [[posture["manipulability"], posture["clearance"]] for posture in content["postures"]]
    np.testing.assert_array_equal(np.array(rows, dtype=float)[:, 6:], measures)


def test_what_is_around_takes_postures_away(capsys: pytest.CaptureFixture[str]) -> None:
    low = ("--position", "0.4", "0.2", "0.12", "--quaternion", "1", "0", "0", "0")
    alone, own = joints(as_json(capsys, "ur5e", *low)), joints(as_json(capsys, "cell.toml", *low))
    np.testing.assert_array_equal(own, tp.robot("ur5e").inverse(tp.Pose((0.4, 0.2, 0.12), DOWN), clear_of=[TABLE]))
    assert 0 < len(own) < len(alone)
    np.testing.assert_array_equal(joints(as_json(capsys, "ur5e", *low, "--clear-of", "around.toml")), own)
    np.testing.assert_array_equal(joints(as_json(capsys, "ur5e", *low, "--clear-of", "cell.toml")), own)


def test_near_a_posture_in_all_turns_and_turned_in_any_way(capsys: pytest.CaptureFixture[str]) -> None:
    near = ("--near", "-2.4", "-1.5", "-2.1", "-1.1", "1.6", "-8e-1")
    nearest = joints(as_json(capsys, "ur5e", *POSE, *near))
    np.testing.assert_allclose(nearest[0], np.array(near[1:], dtype=float), atol=0.05)
    turned = joints(as_json(capsys, "ur5e", *POSE, *near, "--turns"))
    posture = np.array(near[1:], dtype=float)
    np.testing.assert_array_equal(turned, tp.robot("ur5e").inverse(tp.Pose(POINT, DOWN), near=posture, turns=True))
    assert len(turned) > 8
    few = joints(as_json(capsys, "ur5e", "--position", "0.4", "0.2", "0.3", "--descents", "4"))
    np.testing.assert_array_equal(few, tp.robot("ur5e").inverse(tp.Pose(POINT), starts=4))


def test_where_nothing_can_come_near_the_clearance_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    Path("bare.urdf").write_text(re.sub(r"<collision.*?</collision>", "", ARM, flags=re.DOTALL))
    Path("bare.toml").write_text('[robot]\nurdf = "bare.urdf"\ntip_link = "tool0"\nmax_acceleration = 1.0\n')
    stated = ("bare.toml", "--position", "-0.5", "0.1", "1.7")
    content = as_json(capsys, *stated)
    assert content["postures"] and all(posture["clearance"] is None for posture in content["postures"])
    assert told(capsys, *stated).splitlines()[3].split()[-1] == "-"


def test_none_is_told_in_one_line_with_how_far_the_nearest_is(capsys: pytest.CaptureFixture[str]) -> None:
    far = told(capsys, "ur5e", "--position", "3", "0", "0.1625", code=1)
    said = re.fullmatch(r"no posture reaches it: the nearest that was found is (.*) m away\n", far)
    assert said is not None
    arm = tp.robot("ur5e")
    known = [arm.forward([0.0, lift, 0.0, wrist, -1.57, 0.0]) for lift in (0.0, 3.1416) for wrist in (0.0, -1.57)]
    assert float(said[1]) <= min(np.linalg.norm(frame[:3, 3] - [3.0, 0.0, 0.1625]) for frame in known) + 0.01
    turned = told(capsys, "ur5e", "--position", "0.4", "0.2", "0.9", "--quaternion", "1", "0", "0", "0", code=1)
    assert re.fullmatch(r"no posture reaches it: the nearest that was found is 0\.0\d+ m and 0\.\d+ rad away\n", turned)
    low = ("--position", "0.4", "0.2", "-0.03", "--quaternion", "1", "0", "0", "0")
    touching = told(capsys, "cell.toml", *low, code=1)
    theta = arm.inverse(tp.Pose((0.4, 0.2, -0.03), DOWN), touching=True)
    lacks = -arm.clearance(theta, [TABLE]).max()  # type: ignore[arg-type]
    assert touching == f"no posture is clear: of {len(theta)} that reach it the best lacks {lacks:.3g} m\n"
    assert as_json(capsys, "cell.toml", *low, code=1)["postures"] == []
    assert told(capsys, "cell.toml", *low, "--quiet", "--csv", "none.csv", code=1) == ""
    assert len(Path("none.csv").read_text().splitlines()) == 1


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["nosuch", *POSE], "'nosuch': is no robot"),
        (["missing.toml", *POSE], "missing.toml"),
        (["plane.toml", *POSE], "plane.toml: robot: an arm in space is needed"),
        (["ur5e"], "the following arguments are required: --position"),
        (["ur5e", "--position", "0.4", "0.2"], "argument --position: expected 3 arguments"),
        (["ur5e", "--position", "0.4", "0.2", "up"], "argument --position: a number is needed, not 'up'"),
        (["ur5e", "--position", "0.4", "0.2", "nan"], "argument --position: nan is not a number from"),
        (["ur5e", "--position", "-1e300", "0", "0"], "argument --position: -1e300 is not a number from"),
        (["ur5e", *POSE[:-1], "1"], "--quaternion: (1.0, 0.0, 0.0, 1.0) is no quaternion x, y, z, w of length 1"),
        (["ur5e", *POSE[:5], "0", "0", "0", "0"], "--quaternion: (0.0, 0.0, 0.0, 0.0) is no quaternion"),
        (["ur5e", *POSE, "--near", "1", "2"], "--near: 6 finite numbers are needed"),
        (["ur5e", *POSE, "--tip", "left"], "--tip: no arm is called 'left'"),
        (["ur5e", *POSE, "--descents", "1000000"], "--descents: a whole number from 1 to 100000 is needed"),
        (["ur5e", *POSE, "--clear-of", "none.toml"], "none.toml"),
        (["ur5e", *POSE, "--clear-of", "moving.toml"], "moving.toml: obstacles.0: moves"),
        (["ur5e", *POSE, "--csv", "cell.toml/a.csv"], "cell.toml"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    arguments: list[str], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert status(main, "inverse", *arguments) == 2
    printed = capsys.readouterr()
    assert printed.out == "" and reason in printed.err and printed.err.strip().count("\n") == 0

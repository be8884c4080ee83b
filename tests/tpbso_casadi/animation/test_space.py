"""Players and films of motions in space, and what comes closest in them."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.browser import fetched, opened
from helpers.massive import lifted_motion
from helpers.space_plans import SOLIDS, SPHERES, space_plan
from PIL import Image, ImageSequence

from problems.limits import Clearance
from tpbso_casadi.animation import write as writing
from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player import page
from tpbso_casadi.animation.player_data import closest_of
from tpbso_casadi.animation.write import animate

MINUS = "\N{MINUS SIGN}"


def data_of(text: str) -> dict[str, Any]:
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    return json.loads(content)


def test_the_player_is_one_file_that_fetches_nothing() -> None:
    frames = frames_of(space_plan().motion, 31)
    text = page("a <b>&</b> b", frames)
    assert fetched(text) == []
    assert not re.search(r"https?:|//\w+\.\w|import\s*\(|fetch\s*\(|XMLHttpRequest", text)
    assert "<title>a &lt;b&gt;" in text
    data = data_of(text)
    assert np.shape(data["centers"]) == (31, len(SPHERES), 3) and data["radii"] == [s.radius for s in SPHERES]
    assert data["kinds"] == [0, 1, 2, 3]
    assert data["joint_names"] == ["joint_0", "joint_1", "joint_2", "joint_3"]
    assert len(data["solids"]) == len(SOLIDS) and [len(data["solids"][0][k]) for k in ("vertices", "faces")] == [8, 6]
    np.testing.assert_allclose(data["joints"], frames.joints, atol=1e-4)
    labels = [curve["label"] for curve in data["curves"]]
    assert labels == [
        "joint position [rad]",
        "joint speed / limit",
        "joint acceleration / limit",
        "joint jerk / limit",
    ]
    np.testing.assert_allclose(data["curves"][0]["values"], frames.theta, atol=1e-6)
    peaks = [np.abs(curve["values"]).max() for curve in data["curves"][1:]]
    assert all(0.3 < peak <= 1.0 + 1e-6 for peak in peaks)


def test_the_player_runs_in_a_browser(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page("panda", frames_of(space_plan().motion)), encoding="utf-8")
    document = opened(path, tmp_path / "profile")
    assert re.search(r">\d\.\d{3} s</output>", document)
    assert re.search(r"Closest: \w+, [\w ]+, -?\d+\.\d mm<", document)
    assert document.count("<li>") == 4 and "joint_3" in document
    assert re.search(rf">{MINUS}?\d\.\d{{3}} rad</output>", document)


def test_the_player_shows_torques_as_shares_of_their_limits() -> None:
    motion = lifted_motion()
    frames = frames_of(motion, 21)
    curve = data_of(page("lift", frames))["curves"][-1]
    assert curve["label"] == "joint torque / limit" and curve["limits"] == [120.0, 40.0, 20.0, 10.0]
    np.testing.assert_allclose(curve["values"], motion.torques(frames.times) / [120.0, 40.0, 20.0, 10.0], atol=1e-6)


def test_the_player_shows_torques_that_nothing_limits_in_their_units(tmp_path: Path) -> None:
    motion = lifted_motion(limited=False)
    text = page("lift", frames_of(motion, 21))
    curve = data_of(text)["curves"][-1]
    assert curve["label"] == "joint torque [N m or N]" and "limits" not in curve
    path = tmp_path / "page.html"
    choose = "const s = document.querySelector('.quantity'); s.selectedIndex = s.options.length - 1; "
    path.write_text(f"{text}<script>{choose}s.dispatchEvent(new Event('change'));</script>", encoding="utf-8")
    document = opened(path, tmp_path / "profile")
    shown = [
        float(value.replace(MINUS, "-")) for value in re.findall(rf">({MINUS}?[0-9.]+) N(?: m)?</output>", document)
    ]
    assert len(shown) == 4 and re.search(rf">{MINUS}?[0-9.]+ N</output>", document)
    values = np.array(curve["values"])  # at whatever time the page was when it was read
    assert (shown >= values.min(axis=0) - 1e-3).all() and (shown <= values.max(axis=0) + 1e-3).all()
    assert shown[0] > 60.0  # what it carries up


def test_names_of_others_stay_text() -> None:
    plan = space_plan()
    hostile = "</script><script>alert('x')</script>"
    robot = plan.criteria.robot
    joints = (replace(robot.chain.joints[0], name=hostile), *robot.chain.joints[1:])
    criteria = replace(
        plan.motion.problem,
        task=replace(plan.criteria.task, robot=replace(robot, chain=replace(robot.chain, joints=joints))),
    )
    text = page("hostile", replace(frames_of(plan.motion, 5), problem=criteria))
    assert hostile not in text
    assert data_of(text)["joint_names"][0] == hostile


def test_a_robot_without_spheres_has_a_player_too(tmp_path: Path) -> None:
    text = page("bare", frames_of(space_plan(obstacles=False, spheres=False).motion, 5))
    data = data_of(text)
    assert data["closest"] is None and data["solids"] == [] and np.shape(data["centers"]) == (5, 0)
    path = tmp_path / "page.html"
    path.write_text(text)
    assert "joint_0" in opened(path, tmp_path / "profile")


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
def test_the_closest_points_lie_on_both_surfaces(solid) -> None:
    plan = space_plan()
    robot = plan.criteria.robot
    times = np.linspace(0.0, plan.trajectory.duration, 7)
    theta = plan.trajectory.at(times)
    criteria = replace(plan.motion.problem, limits=(Clearance.for_robot(robot, (solid,)),))
    closest = closest_of(criteria, theta, times)
    assert closest is not None
    frames = [np.array(position) for position in robot.positions(ca.DM(theta))]
    balls = [pair.body for pair in criteria.limits[0].pairs]  # those that can reach it
    expected = [
        min(float(solid.point_clearance(ca.DM(frames[ball.start][row : row + 1]))) - ball.radius for ball in balls)
        for row in range(7)
    ]
    assert closest.distances == pytest.approx(expected, abs=1e-12)
    for row, (near, far) in enumerate(closest.points):
        body = closest.pairs[closest.numbers[row]].body
        center = frames[body.start][row]
        assert np.linalg.norm(near - center) == pytest.approx(body.radius)
        assert np.linalg.norm(far - near) == pytest.approx(closest.distances[row])
        assert float(solid.point_clearance(ca.DM([far]))) == pytest.approx(0.0, abs=2e-3 * np.linalg.norm(far - center))


def test_two_balls_of_the_robot_that_are_the_closest() -> None:
    plan = space_plan(obstacles=False)
    closest = closest_of(plan.criteria, plan.trajectory.at(np.zeros(1)), np.zeros(1))
    assert closest is not None and [str(pair) for pair in closest.pairs] == ["foot, link_4"]
    centers = [
        np.array(plan.criteria.robot.positions(ca.DM(plan.trajectory.at(np.zeros(1))))[5 + k])[0] for k in (0, 3)
    ]
    away = centers[1] - centers[0]
    length = np.linalg.norm(away)
    assert closest.distances == pytest.approx([length - 0.13])
    np.testing.assert_allclose(
        closest.points[0], [centers[0] + 0.08 * away / length, centers[1] - 0.05 * away / length]
    )


@pytest.mark.parametrize("name", ["way.gif", "way.html"])
def test_animations_of_motions_in_space(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "FILM_FRAMES", 4)
    animate(tmp_path / name, "way", space_plan().motion)
    if name == "way.html":
        assert 'data-stage="space"' in (tmp_path / name).read_text(encoding="utf-8")
        return
    with Image.open(tmp_path / name) as film:
        images = [np.asarray(frame.convert("RGB"), dtype=np.int64) for frame in ImageSequence.Iterator(film)]
    assert len(images) >= 4
    assert (np.abs(images[0] - images[3]).max(axis=2) > 100).sum() > 500  # the robot moves

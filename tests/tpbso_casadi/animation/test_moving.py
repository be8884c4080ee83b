"""Players and films in which obstacles move."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pytest
from helpers.browser import opened
from helpers.moving_plans import IN_PLANE, IN_SPACE, moving_space_plan, plane_plan
from PIL import Image, ImageSequence

from problems.limits import Clearance
from problems.scene.moving import MovingObstacle
from tpbso_casadi.animation import write as writing
from tpbso_casadi.animation.frames import frames_of
from tpbso_casadi.animation.player import page
from tpbso_casadi.animation.player_data import closest_of
from tpbso_casadi.animation.write import animate
from tpbso_casadi.planning import PlannedMotion


def data_of(text: str) -> dict[str, Any]:
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    return json.loads(content)


def test_the_player_of_the_plane_moves_outlines() -> None:
    frames = frames_of(plane_plan().motion, 11)
    data = data_of(page("plane", frames))
    np.testing.assert_allclose(data["obstacles"], [IN_PLANE[0].outline()], atol=1e-4)
    assert len(data["moving"]) == 2
    for sent, obstacle in zip(data["moving"], IN_PLANE[1:], strict=True):
        p, q = np.array(sent["outline"]).T
        for time, (x, y, u, v) in zip(frames.times, sent["frames"], strict=True):
            shown = np.column_stack([x + p * u - q * v, y + p * v + q * u])
            np.testing.assert_allclose(shown, obstacle.at(time).outline(), atol=5e-4)
    left, right, bottom, top = data["extent"]
    reach = 1.8 + 0.05
    assert left > -1.2 * reach and right < 1.2 * reach and bottom > -1.2 * reach and top < 1.2 * reach


def test_the_player_of_space_moves_solids() -> None:
    frames = frames_of(moving_space_plan().motion, 11)
    data = data_of(page("space", frames))
    assert [moving["number"] for moving in data["moving"]] == [1] and data["planes"] == []
    still = np.array(data["solids"][1]["vertices"])
    for time, (origin, *axes) in zip(frames.times, data["moving"][0]["frames"], strict=True):
        np.testing.assert_allclose(still @ axes + origin, IN_SPACE[1].at(time).surface()[0], atol=2e-4)


@pytest.mark.parametrize("plan", [plane_plan, moving_space_plan])
def test_the_players_run_in_a_browser(plan: Any, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page("moving", frames_of(plan().motion)), encoding="utf-8")
    assert re.search(r">\d\.\d{3} s</output>", opened(path, tmp_path / "profile"))


def test_the_closest_two_are_measured_at_their_time(tmp_path: Path) -> None:
    plan = moving_space_plan()
    robot, ball = plan.criteria.robot, IN_SPACE[1]
    grown = MovingObstacle(ball.still, ball.motion, margin_rate=0.3)  # what is kept is no part of the distance
    criteria = replace(plan.motion.problem, limits=(Clearance.for_robot(robot, (grown,)),))
    times = np.linspace(0.0, plan.trajectory.duration, 9)
    closest = closest_of(criteria, plan.trajectory.at(times), times)
    assert closest is not None
    frames = [np.array(position) for position in robot.positions(ca.DM(plan.trajectory.at(times)))]
    moved = [body for body in robot.bodies if body.name != "foot"]
    for row, time in enumerate(times):
        center = np.array([1.0, 0.9, 0.9]) + time * np.array([-0.8, -0.3, 0.0])
        apart = min(np.linalg.norm(frames[body.start][row] - center) - body.radius - 0.15 for body in moved)
        assert closest.distances[row] == pytest.approx(apart, abs=1e-9)
        near, far = closest.points[row]
        assert np.linalg.norm(far - center) == pytest.approx(0.15, abs=1e-9)
        assert np.linalg.norm(far - near) == pytest.approx(abs(apart), abs=1e-9)
    text = page("end", replace(frames_of(plan.motion, 9), problem=criteria))
    to_end = "const s = document.querySelector('.time'); s.value = 1000; s.dispatchEvent(new Event('input'));"
    path = tmp_path / "page.html"
    path.write_text(f"{text}<script>{to_end}</script>", encoding="utf-8")
    shown = re.search(r"Closest: \w+, obstacle 1, (-?[0-9.]+) mm<", opened(path, tmp_path / "profile"))
    assert shown is not None and float(shown[1]) == pytest.approx(1000.0 * closest.distances[-1], abs=0.051)


def reds(image: Image.Image) -> np.ndarray:
    """Where an obstacle that stands in front of nothing is seen: columns of its pixels."""
    colours = np.asarray(image.convert("RGB"), dtype=np.int64)
    red = (colours[..., 0] > 180) & (colours[..., 0] - colours[..., 1:].max(axis=2) > 40)
    return np.flatnonzero(red.any(axis=0))


@pytest.mark.parametrize("plan", [lambda: plane_plan(IN_PLANE[1]), moving_space_plan])
def test_obstacles_move_in_films(plan: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(writing, "FILM_FRAMES", 4)
    planned: PlannedMotion = plan()
    animate(tmp_path / "film.gif", "film", planned.motion)
    with Image.open(tmp_path / "film.gif") as film:
        images = [frame.copy() for frame in ImageSequence.Iterator(film)]
    first, last = reds(images[0]), reds(images[3])
    assert first.size and last.size
    assert abs(float(first.mean() - last.mean())) > 10.0

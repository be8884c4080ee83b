"""The player: what its page holds, and what a reader does with it in a browser."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from html import escape, unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser import DRAWN_BY_CLOCK, after, fetched, opened
from helpers.massive import lifted_motion
from helpers.moving_plans import IN_PLANE, IN_SPACE, moving_space_plan, plane_plan
from helpers.space_plans import SOLIDS, SPHERES, space_plan

import tpbso_casadi as tp
from problems import Joints, PlanarArm
from tpbso_casadi.animation.frames import Frames, frames_of, judged_frames
from tpbso_casadi.animation.player import COLOURS, FOLDER, PARTS, SCRIPT, STYLE, page, player
from tpbso_casadi.animation.player_data import closest_of, shared_data
from tpbso_casadi.figures.palette import colour_of
from tpbso_casadi.planning import JudgedMotion, PlannedMotion

BROWSER = pytest.mark.process
CALM = "--force-prefers-reduced-motion"
STEPS = 10
SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4]
SCREENS = [(360, 740), (740, 360), (800, 1280), (1920, 1080)]
# What is done shows when the page is drawn again.
TOLD = '<pre id="told"></pre>'
STORY = """(async () => {
const find = (name) => document.querySelector(name), told = {};
const key = (name, target = document.body, more = {}) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true, ...more }));
const drawn = () => new Promise(requestAnimationFrame);
const note = async (name, what) => { await drawn(); told[name] = what(); };
%s
find("#told").textContent = JSON.stringify(told);
})();"""


def told(text: str, story: str, folder: Path, *flags: str) -> dict[str, Any]:
    """What a script notes in a page."""
    [answer] = re.findall(r'<pre id="told">(.+?)</pre>', after(STORY % story, text + TOLD, folder, *flags))
    return dict(json.loads(unescape(answer)))


@pytest.fixture(scope="module")
def frames() -> Frames:
    return frames_of(plane_plan().motion, STEPS + 1)


@BROWSER
def test_keys_and_pointer_move_the_time(frames: Frames, tmp_path: Path) -> None:
    story = """
const clock = () => find(".clock").textContent, play = () => find(".play").textContent;
const speed = () => Number(find(".speed").value), live = () => find(".clock").getAttribute("aria-live");
await note("calm", () => [clock(), play()]);
const keys = ["Home", "ArrowRight", "ArrowRight", "ArrowLeft", "ArrowLeft", "ArrowLeft", "End", "ArrowRight"];
for (const [i, name] of keys.entries()) { key(name); await note(`step ${i}`, clock); }
await note("fit", speed);
key("ArrowUp");
await note("faster", speed);
for (let i = 0; i < 9; i++) key("ArrowUp");
await note("fastest", speed);
key("ArrowDown");
await note("slower", speed);
await note("pace", () => [find(".whole").textContent, find(".pace").textContent]);
for (let i = 0; i < 9; i++) key("ArrowDown");
key("ArrowUp", find(".speed"));
key("ArrowUp", document.body, { ctrlKey: true });
await note("slowest", speed);
key("?");
key("Home", find("dialog"));
await note("help", () => [find("dialog").open, clock()]);
find("dialog").close();
const curves = find(".curves"), place = curves.getBoundingClientRect();
curves.setPointerCapture = () => {};
const point = (kind, clientX, buttons) => curves.dispatchEvent(new PointerEvent(kind, { clientX, buttons }));
point("pointerdown", place.left + 46 + (place.width - 58) / 2, 1);
await note("middle", clock);
point("pointermove", place.right + 50, 1);
await note("beyond", clock);
point("pointermove", place.left, 0);
await note("released", clock);
Object.assign(find(".time"), { value: 250 }).dispatchEvent(new Event("input"));
await note("slid", () => [clock(), find(".time").getAttribute("aria-valuetext"), live()]);
key(" ", find(".play"));
await note("not twice", play);  // a button hears this key itself
key(" ");
await note("playing", () => [play(), live()]);
key(" ");
await note("paused", play);
await note("listed", () => [...document.querySelectorAll("dt")].map((term) => term.textContent));
"""
    answers = told(page("keys", frames), story, tmp_path, CALM)
    end = frames.duration
    shown = [f"{share * end:.3f} s" for share in np.linspace(0.0, 1.0, STEPS + 1)]
    assert answers["calm"] == [shown[-1], "Play"]
    steps = [answers[f"step {i}"] for i in range(8)]
    assert steps == [shown[step] for step in (0, 1, 2, 1, 0, 0, STEPS, STEPS)]
    assert answers["fit"] == 1
    assert answers["faster"] == next(speed for speed in SPEEDS if speed > answers["fit"])
    assert [answers[name] for name in ("fastest", "slower", "slowest")] == [4, 2, 0.1]
    assert answers["pace"] == [f"of {end:.3f} s", f"real duration {end:.3f} s, shown in {end / 2.0:.1f} s"]
    assert answers["help"] == [True, shown[-1]]
    assert [answers[name] for name in ("middle", "beyond", "released")] == [shown[STEPS // 2], shown[-1], shown[-1]]
    assert answers["slid"] == [f"{end / 4.0:.3f} s"] * 2 + ["polite"]
    assert answers["not twice"] == answers["paused"] == "Play" and answers["playing"] == ["Pause", "off"]
    assert answers["listed"] == ["space", "← →", "Home, End", "↑ ↓", "f", "?"]


@pytest.fixture(scope="module")
def staged() -> Frames:
    """Two motions of an arm in the plane, a signal and a wait between them."""
    arm, start, there = PlanarArm((0.5, 0.5), (2.0, 2.0), (10.0, 10.0)), Joints((0.1, 0.5)), Joints((0.9, 0.5))
    stages = [tp.MoveTo(there), tp.Output("gripper", "close"), tp.Wait(0.3), tp.MoveTo(start)]
    return judged_frames(tp.sequence(arm, start=start, stages=stages).motion)


def test_a_motion_is_played_in_real_time_unless_it_is_long(staged: Frames) -> None:
    assert (staged.seconds, len(staged.times)) == (staged.duration, 121)
    assert frames_of(plane_plan().motion).seconds == plane_plan().motion.trajectory.duration
    slow = replace(staged.criteria, stages=()), staged.trajectory.time_scaled(30.0 / staged.duration)
    long = judged_frames(JudgedMotion(*slow, {}))
    assert (long.seconds, len(long.times)) == (20.0, 241)


def test_stages_are_data_of_a_player(staged: Frames) -> None:
    first, told, waiting, last = shared_data(staged)["stages"]
    assert [one["name"] for one in (first, told, waiting, last)] == ["1 move", "2 output", "3 wait", "4 move"]
    assert (first["start"], last["end"]) == (0.0, round(staged.duration, 6))
    assert told["start"] == told["end"] and told["signal"] == "gripper = close" and not first["signal"]


@BROWSER
def test_stages_are_on_the_time_line_and_are_jumped_to(staged: Frames, tmp_path: Path) -> None:
    story = """
const clock = () => find(".clock").textContent, parts = [...document.querySelectorAll(".part")];
await note("names", () => parts.map((part) => part.getAttribute("aria-label")));
await note("signals", () => [...document.querySelectorAll(".signal")].map((mark) => mark.textContent));
await note("speed", () => Number(find(".speed").value));
parts[1].click();
await note("clicked", () => [clock(), find(".part.now").getAttribute("aria-label")]);
key("PageDown");
await note("next", clock);
key("PageUp");
key("PageUp");
await note("before", clock);
await note("shown", () => parts.map((part) => part.textContent));
"""
    answers = told(page("stages", staged), story, tmp_path, CALM)
    starts = [f"{stage.start:.3f} s" for stage in staged.criteria.stages]
    assert answers["names"] == ["stage 1 (move)", "stage 3 (wait)", "stage 4 (move)"]
    assert answers["shown"] == ["1 move", "3 wait", "4 move"]
    assert (answers["signals"], answers["speed"]) == (["gripper = close"], 1)
    assert answers["clicked"] == [starts[2], "stage 3 (wait)"]
    assert (answers["next"], answers["before"]) == (starts[3], "0.000 s")


@BROWSER
def test_one_player_fills_any_screen(frames: Frames, tmp_path: Path) -> None:
    in_plane, in_space = page("plane", frames), page("space", frames_of(space_plan().motion, STEPS + 1))
    shown = [(in_plane, screen) for screen in SCREENS] + [(in_space, screen) for screen in SCREENS[::2]]
    screens = "".join(
        f'<iframe style="width:{width}px;height:{height}px;border:0" srcdoc="{escape(DRAWN_BY_CLOCK + text)}"></iframe>'
        for text, (width, height) in shown
    )
    story = """
await new Promise((loaded) => window.addEventListener("load", loaded));
await new Promise((done) => setTimeout(done, 300));
for (const [i, frame] of [...document.querySelectorAll("iframe")].entries()) {
  const inner = frame.contentDocument, all = (names) => [...inner.querySelectorAll(names)];
  const box = (element) => { const b = element.getBoundingClientRect(); return [b.left, b.top, b.right, b.bottom]; };
  const page = inner.documentElement;
  await note(i, () => ({
    page: [page.scrollWidth, page.scrollHeight],
    areas: all(".stage, .plots").map(box),
    controls: all(".bar > :not([hidden]):not(.pace), .quantity, .views button").map(box),
    scene: all(".scene").map((canvas) => [canvas.width, canvas.height, canvas.clientWidth, canvas.clientHeight])[0],
    named: all("button, input, select, canvas").filter((e) => !e.textContent.trim() && !e.ariaLabel).length,
  }));
}
"""
    answers = told(screens, story, tmp_path)
    assert len(answers) == len(shown)
    for (_, (width, height)), answer in zip(shown, answers.values(), strict=True):
        assert answer["page"] == [width, height]  # nothing to scroll
        stage, plots = np.array(answer["areas"])
        seen = sum(float(np.prod(area[2:] - area[:2])) for area in (stage, plots))
        assert seen > (0.7 if width * height > 900_000 else 0.45) * width * height
        assert min(stage[2] - stage[0], stage[3] - stage[1]) > 0.4 * min(width, height)
        boxes = np.array([stage, plots, *answer["controls"]])
        assert (boxes >= 0.0).all() and (boxes <= np.array([width, height] * 2) + 0.5).all()
        assert (boxes[:, 2:] - boxes[:, :2] >= 19.0).all()
        for one in range(1, len(answer["controls"]) + 2):  # nothing covers another; the views lie on the stage
            over = np.minimum(boxes[:one, 2:], boxes[one, 2:]) - np.maximum(boxes[:one, :2], boxes[one, :2]) > 0.5
            inside = (boxes[:one, :2] <= boxes[one, :2]).all(axis=1) & (boxes[:one, 2:] >= boxes[one, 2:]).all(axis=1)
            assert (over.all(axis=1) <= inside).all()
        assert answer["scene"][:2] == answer["scene"][2:]  # as many pixels as it has place
        assert answer["named"] == 0


@BROWSER
def test_several_players_share_a_page(frames: Frames, tmp_path: Path) -> None:
    figures = player("first", frames) + player("second", frames)
    text = f"<style>{STYLE}</style>{figures}<script>{SCRIPT}</script>"
    story = """
const clocks = () => [...document.querySelectorAll(".clock")].map((clock) => clock.textContent);
const figures = [...document.querySelectorAll("figure")];
await note("wide", () => figures.map((figure) => figure.clientWidth));
key("Home");
await note("nobody's", clocks);
key("Home", figures[1].querySelector(".scene"));
await note("the second's", clocks);
"""
    answers = told(text, story, tmp_path, CALM)
    end = f"{frames.duration:.3f} s"
    assert answers == {"wide": [480, 480], "nobody's": [end, end], "the second's": [end, "0.000 s"]}


@BROWSER
def test_keys_turn_the_camera(tmp_path: Path) -> None:
    story = """
const picture = () => find(".scene").toDataURL(), shift = { shiftKey: true };
await note("at first", picture);
for (const [name, more] of [["ArrowLeft", shift], ["ArrowUp", shift], ["+", {}], ["1", {}], ["2", {}], ["0", {}]]) {
  key(name, document.body, more);
  await note(name, picture);
}
await note("clock", () => find(".clock").textContent);
"""
    frames = frames_of(space_plan().motion, STEPS + 1)
    answers = told(page("turned", frames), story, tmp_path, CALM)
    assert answers.pop("clock") == f"{frames.duration:.3f} s"
    assert answers.pop("0") == answers["at first"]
    assert len(set(answers.values())) == len(answers) == 6


def test_the_script_holds_every_file_once_and_the_style_every_colour() -> None:
    assert sorted(PARTS) == sorted(str(path.relative_to(FOLDER).with_suffix("")) for path in FOLDER.rglob("*.js"))
    assert all(SCRIPT.count((FOLDER / f"{part}.js").read_text(encoding="utf-8")) == 1 for part in PARTS)
    assert all(
        f"--print-{name}:{colour};" in STYLE and f"var(--print-{name})" in STYLE for name, colour in COLOURS.items()
    )


def test_curves_have_units_limits_and_the_lines_of_the_figures(frames: Frames) -> None:
    content, robot = shared_data(frames), frames.criteria.robot
    assert [line["colour"] for line in content["lines"]] == [colour_of(joint) for joint in range(robot.dof)]
    assert len({(line["colour"], *line["dashes"]) for line in content["lines"]}) == robot.dof
    position, *limited = content["curves"]
    assert position["units"] == ["rad"] * robot.dof and position["bounds"] == robot.limits.position
    assert [curve["units"][0] for curve in limited[:2]] == ["rad/s", "rad/s²"]
    for order, curve in enumerate(limited[:2], start=1):
        expected = frames.trajectory.at(frames.times, order)
        np.testing.assert_allclose(np.array(curve["values"]) * curve["limits"], expected, atol=1e-5)


MINUS = "\N{MINUS SIGN}"


def data_of(text: str) -> dict[str, Any]:
    [content] = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    return json.loads(content)


PAGES: list[Callable[[], PlannedMotion]] = [
    plane_plan,
    moving_space_plan,
    space_plan,
    lambda: space_plan(obstacles=False, spheres=False),
    lambda: space_plan(appearances=True),
]


@BROWSER
@pytest.mark.parametrize("plan", PAGES)
def test_players_run_in_a_browser(plan: Callable[[], PlannedMotion], tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text(page("a <b>&</b> b", frames_of(plan().motion)), encoding="utf-8")
    document = opened(path, tmp_path / "profile")
    assert "<title>a &lt;b&gt;" in document
    assert re.search(r">\d\.\d{3} s</output>", document) and ">Pause</button>" in document  # it plays
    if plan is space_plan:
        assert re.search(r"Closest now: \w+, [\w ]+, -?\d+\.\d mm found<", document)
        assert document.count("<li>") == 4 and "joint_3" in document
        assert re.search(rf">{MINUS}?\d\.\d{{3}} rad</output>", document)


@BROWSER
def test_a_key_shows_and_hides_the_cover_of_a_robot_that_has_looks(tmp_path: Path) -> None:
    story = """
const scene = find(".scene");
const colours = () => {
  const copy = document.createElement("canvas");
  Object.assign(copy, { width: scene.width, height: scene.height });
  const pen = copy.getContext("2d", { willReadFrequently: true });
  pen.drawImage(scene, 0, 0);
  const { data } = pen.getImageData(0, 0, scene.width, scene.height);
  let red = 0, grey = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] > 90 && data[i + 1] < 60 && data[i + 2] < 60) red++;
    if (data[i + 3] > 200 && data[i] < data[i + 1] && data[i + 1] < data[i + 2] && data[i] > 60) grey++;
  }
  return [red, grey];
};
key("2");
await note("bare", colours);
key("c");
await note("covered", colours);
find(".cover").click();
await note("bare again", colours);
await note("listed", () => [...document.querySelectorAll("dt")].map((term) => term.textContent));
"""
    plan = space_plan(obstacles=False, appearances=True)
    answers = told(page("looks", frames_of(plan.motion, 3)), story, tmp_path, CALM)
    assert answers["bare"] == answers["bare again"]
    red, grey = answers["bare"]
    assert red > 200 and grey > 200  # the bar, and the balls of links without a look
    assert answers["covered"][0] < 0.9 * red  # behind balls
    assert "c" in answers["listed"]


def test_frames_are_the_arm() -> None:
    motion = plane_plan().motion
    frames = frames_of(motion, 31)
    arm = motion.criteria.robot
    assert frames.joints.shape == (31, arm.links + 1, 2)
    assert frames.times[0] == 0.0 and frames.duration == motion.trajectory.duration
    lengths = np.linalg.norm(np.diff(frames.joints, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.broadcast_to(arm.link_lengths, lengths.shape), atol=1e-12)
    assert np.linalg.norm(frames.joints[[0, -1], -1] - frames.task_points[[0, -1]], axis=1).max() < 0.11
    left, right, bottom, top = frames.extent
    assert (frames.joints > [left, bottom]).all() and (frames.joints < [right, top]).all()


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
    assert labels == ["joint position [rad]", *(f"joint {name} / limit" for name in ("speed", "acceleration", "jerk"))]
    np.testing.assert_allclose(data["curves"][0]["values"], frames.theta, atol=1e-6)
    peaks = [np.abs(curve["values"]).max() for curve in data["curves"][1:]]
    assert all(0.3 < peak <= 1.0 + 1e-6 for peak in peaks)
    bare = data_of(page("bare", frames_of(space_plan(obstacles=False, spheres=False).motion, 5)))
    assert bare["closest"] is None and bare["solids"] == [] and np.shape(bare["centers"]) == (5, 0)


def test_the_player_shows_torques_as_shares_of_their_limits() -> None:
    motion = lifted_motion()
    frames = frames_of(motion, 21)
    curve = data_of(page("lift", frames))["curves"][-1]
    assert curve["label"] == "joint torque / limit" and curve["limits"] == [120.0, 40.0, 20.0, 10.0]
    np.testing.assert_allclose(curve["values"], motion.torques(frames.times) / [120.0, 40.0, 20.0, 10.0], atol=1e-6)
    curve = data_of(page("lift", frames_of(lifted_motion(limited=False), 21)))["curves"][-1]
    assert curve["label"] == "joint torque [N m or N]" and "limits" not in curve
    assert set(curve["units"]) == {"N m", "N"} and np.abs(curve["values"]).max() > 60.0  # what the first carries up


def test_names_of_others_stay_text() -> None:
    plan = space_plan()
    hostile = "</script><script>alert('x')</script>"
    robot = plan.criteria.robot
    joints = (replace(robot.chain.joints[0], name=hostile), *robot.chain.joints[1:])
    criteria = replace(
        plan.motion.criteria,
        task=replace(plan.criteria.task, robot=replace(robot, chain=replace(robot.chain, joints=joints))),
    )
    text = page("hostile", replace(frames_of(plan.motion, 5), criteria=criteria))
    assert hostile not in text
    assert data_of(text)["joint_names"][0] == hostile


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


@BROWSER
def test_the_closest_distance_is_shown_as_it_is_at_the_end(tmp_path: Path) -> None:
    plan = moving_space_plan()
    frames = frames_of(plan.motion, 9)
    closest = closest_of(plan.motion.criteria, frames.theta, frames.times)
    assert closest is not None
    to_end = "const s = document.querySelector('.time'); s.value = 1000; s.dispatchEvent(new Event('input'));"
    document = after(to_end, page("end", frames), tmp_path)
    shown = re.search(r"Closest now: \w+, [\w ]+, (-?[0-9.]+) mm found<", document)
    assert shown is not None and float(shown[1]) == pytest.approx(1000.0 * closest.distances[-1], abs=0.051)

"""What a reader does with the player: keys, pointer, screens of any size, several players on one page."""

from __future__ import annotations

import json
import re
from html import escape, unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.browser import opened
from helpers.moving_plans import plane_plan
from helpers.space_plans import space_plan

from tpbso_casadi.animation.frames import Frames, frames_of
from tpbso_casadi.animation.player import COLOURS, FOLDER, PARTS, SCRIPT, STYLE, page, player
from tpbso_casadi.animation.player_data import shared_data
from tpbso_casadi.figures.palette import colour_of

CALM = "--force-prefers-reduced-motion"
STEPS = 10
SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4]
SCREENS = [(360, 740), (740, 360), (420, 900), (800, 1280), (1280, 800), (1920, 1080)]
# A browser whose window nobody sees gives frames when it likes: here they come by the clock.
DRAWN_BY_CLOCK = """<!DOCTYPE html>
<script>window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 10);</script>"""
# What is done shows when the page is drawn again.
STORY = """<pre id="told"></pre><script>(async () => {
const find = (name) => document.querySelector(name), told = {};
const key = (name, target = document.body, more = {}) =>
  target.dispatchEvent(new KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true, ...more }));
const drawn = () => new Promise(requestAnimationFrame);
const note = async (name, what) => { await drawn(); told[name] = what(); };
%s
find("#told").textContent = JSON.stringify(told);
})();</script>"""


def told(text: str, story: str, folder: Path, *flags: str) -> dict[str, Any]:
    """What a script notes in a page."""
    path = folder / "page.html"
    path.write_text(f"{DRAWN_BY_CLOCK}{text}{STORY % story}", encoding="utf-8")
    [answer] = re.findall(r'<pre id="told">(.+?)</pre>', opened(path, folder / "profile", *flags))
    return dict(json.loads(unescape(answer)))


@pytest.fixture(scope="module")
def frames() -> Frames:
    return frames_of(plane_plan().motion, STEPS + 1)


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
    assert answers["fit"] == pytest.approx(end / frames.seconds)
    assert answers["faster"] == next(speed for speed in SPEEDS if speed > answers["fit"])
    assert [answers[name] for name in ("fastest", "slower", "slowest")] == [4, 2, 0.1]
    assert answers["pace"] == [f"of {end:.3f} s", f"real duration {end:.3f} s, shown in {end / 2.0:.1f} s"]
    assert answers["help"] == [True, shown[-1]]
    assert [answers[name] for name in ("middle", "beyond", "released")] == [shown[STEPS // 2], shown[-1], shown[-1]]
    assert answers["slid"] == [f"{end / 4.0:.3f} s"] * 2 + ["polite"]
    assert answers["not twice"] == answers["paused"] == "Play" and answers["playing"] == ["Pause", "off"]
    assert answers["listed"] == ["space", "← →", "Home, End", "↑ ↓", "f", "?"]


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
    content, robot = shared_data(frames), frames.problem.robot
    assert [line["colour"] for line in content["lines"]] == [colour_of(joint) for joint in range(robot.dof)]
    assert len({(line["colour"], *line["dashes"]) for line in content["lines"]}) == robot.dof
    position, *limited = content["curves"]
    assert position["units"] == ["rad"] * robot.dof and position["bounds"] == robot.limits.position
    assert [curve["units"][0] for curve in limited[:2]] == ["rad/s", "rad/s²"]
    for order, curve in enumerate(limited[:2], start=1):
        expected = frames.trajectory.at(frames.times, order)
        np.testing.assert_allclose(np.array(curve["values"]) * curve["limits"], expected, atol=1e-5)

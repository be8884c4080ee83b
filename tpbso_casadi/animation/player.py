"""A motion as a player in a web page: a canvas, a button and a slider, all in one file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from problems.scene.obstacle import standing
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.figures.courses import Course

FOLDER = Path(__file__).parent
SCRIPT = Markup((FOLDER / "player.js").read_text(encoding="utf-8"))
STYLE = Markup((FOLDER / "player.css").read_text(encoding="utf-8"))
DIGITS = 4  # of metres and seconds
PLAYER = Markup("""\
<figure class="player">
<canvas role="img" aria-label="{title}: the arm from start to end"></canvas>
<div><button type="button">Pause</button>
<input type="range" min="0" max="{last}" value="0" aria-label="time"><output></output></div>
<p></p>
<script type="application/json">{data}</script>
</figure>
""")
PAGE = Markup("""\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{style}</style></head>
<body><h1>{title}</h1>
{player}<script>{script}</script></body>
</html>
""")


def player(title: str, frames: Frames) -> Markup:
    """The HTML element that shows a motion; its page must contain ``STYLE`` and, after the element, ``SCRIPT``."""
    data = {
        "times": frames.times.round(DIGITS + 2).tolist(),
        "joints": frames.joints.round(DIGITS).tolist(),
        "extent": [round(edge, DIGITS) for edge in frames.extent],
        "points": frames.task_points.round(DIGITS).tolist(),
        "bodies": [[body.start, body.end, float(body.radius)] for body in frames.problem.robot.bodies if body.radius],
        "obstacles": [obstacle.outline().round(DIGITS).tolist() for obstacle in standing(frames.problem.obstacles)],
        "moving": [_moving(course) for course in frames.courses],
        "notes": frames.notes,
        "seconds": frames.seconds,
    }
    content = htmlsafe_json_dumps(data, separators=(",", ":"))
    return PLAYER.format(title=title, last=len(frames.times) - 1, data=content)


def _moving(course: Course) -> dict[str, Any]:
    """An obstacle that moves: its outline as seen from its frame, and origin and first axis of that at each time."""
    frames = course.frames[:, :2].reshape(-1, 4)
    return {
        "outline": course.obstacle.unmoved.outline().round(DIGITS).tolist(),
        "frames": frames.round(DIGITS).tolist(),
        "way": course.middles.round(DIGITS).tolist(),
    }


def page(title: str, frames: Frames) -> str:
    """A self-contained page with one player."""
    return str(PAGE.format(title=title, style=STYLE, script=SCRIPT, player=player(title, frames)))

"""A motion in space as a page: a picture to be turned, joint curves, and the closest two of all that keep apart."""

from __future__ import annotations

from pathlib import Path

from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.animation.space.content import content_of

FOLDER = Path(__file__).parent
PARTS = ("camera", "order", "painter", "curves", "player")
SOURCES = "".join((FOLDER / f"{part}.js").read_text(encoding="utf-8") for part in PARTS)
SCRIPT = Markup(f'"use strict";\n(() => {{\n{SOURCES}}})();\n')
STYLE = Markup((FOLDER / "player.css").read_text(encoding="utf-8"))
PAGE = Markup("""\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{style}</style></head>
<body><h1>{title}</h1>
<figure class="space-player">
<div class="stage">
<canvas class="scene" tabindex="0" role="img" aria-label="{title}: the robot from start to end; drag to turn, wheel to \
zoom, shift and drag to move"></canvas>
<div class="views"><button type="button" class="top">Top</button><button type="button" class="front">Front</button>\
<button type="button" class="side">Side</button><button type="button" class="fit">Reset</button></div>
<p class="near"></p>
</div>
<div class="bar"><button type="button" class="play">Pause</button>
<input class="time" type="range" min="0" max="1000" value="0" aria-label="time"><output class="clock"></output>
<select class="speed" aria-label="speed"></select><p class="note"></p></div>
<div class="panel">
<select class="quantity" aria-label="curves"></select>
<canvas class="curves" role="img" aria-label="joints over time"></canvas>
<ul class="joints"></ul>
</div>
<script type="application/json">{data}</script>
</figure>
<script>{script}</script></body>
</html>
""")


def page(title: str, frames: Frames) -> str:
    """A self-contained page that plays a motion in space."""
    return str(PAGE.format(title=title, style=STYLE, script=SCRIPT, data=htmlsafe_json_dumps(content_of(frames))))

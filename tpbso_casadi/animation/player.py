"""A motion as a player in a web page: a canvas, a button and a slider; nothing is fetched."""

from __future__ import annotations

import json
from pathlib import Path

from markupsafe import Markup

from tpbso_casadi.animation.frames import Frames

HERE = Path(__file__).parent
SCRIPT = Markup((HERE / "player.js").read_text(encoding="utf-8"))
STYLE = Markup((HERE / "player.css").read_text(encoding="utf-8"))
DIGITS = 4  # of metres and seconds
PLAYER = Markup("""\
<figure class="player">
<canvas role="img" aria-label="{title}: the arm from start to end"></canvas>
<div><button type="button">Pause</button>
<input type="range" min="0" max="{last}" value="0" aria-label="time"><output></output></div>
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
    """The element that shows a motion; its page must hold ``STYLE`` and, behind it, ``SCRIPT``."""
    data = {
        "times": frames.times.round(DIGITS + 2).tolist(),
        "joints": frames.joints.round(DIGITS).tolist(),
        "extent": [round(edge, DIGITS) for edge in frames.extent],
        "points": frames.task_points.round(DIGITS).tolist(),
        "obstacles": [[*o.center, *o.semi_axes, o.angle] for o in frames.problem.obstacles],
    }
    text = Markup(json.dumps(data, separators=(",", ":")))
    return PLAYER.format(title=title, last=len(frames.times) - 1, data=text)


def page(title: str, frames: Frames) -> str:
    """A page that holds one player and needs nothing else."""
    return str(PAGE.format(title=title, style=STYLE, script=SCRIPT, player=player(title, frames)))

"""A motion as a player in a web page: a picture, joint curves and what moves the time, all in one file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from tpbso_casadi.animation.content import shared_content
from tpbso_casadi.animation.frames import Frames
from tpbso_casadi.animation.plane.content import content_of as content_in_plane
from tpbso_casadi.animation.player.sources import SCRIPT, STYLE
from tpbso_casadi.animation.space.content import content_of as content_in_space


@dataclass(frozen=True)
class Stage:
    """Where a motion is shown.

    Attributes:
        name: of the script's stage.
        picture: what a reader who does not see it is told of the picture.
        content: the data that this stage needs beyond those that all need.
    """

    name: str
    picture: str
    content: Callable[[Frames], dict[str, Any]]


STAGES = {
    2: Stage("plane", "the arm from start to end", content_in_plane),
    3: Stage(
        "space",
        "the robot from start to end; drag to turn, wheel to zoom, shift and drag to move",
        content_in_space,
    ),
}  # by the robot's dimensions

PLAYER = Markup("""\
<figure class="{kind}" data-stage="{stage.name}" aria-label="{title}">
<div class="stage"><canvas class="scene" tabindex="0" role="img" aria-label="{title}: {stage.picture}"></canvas>
<div class="views"></div></div>
<div class="said"><p class="near"></p><p class="note"></p></div>
<div class="bar"><button type="button" class="play">Pause</button>
<button type="button" class="back" aria-label="one step back">&lsaquo;</button>
<button type="button" class="next" aria-label="one step on">&rsaquo;</button>
<input class="time" type="range" min="0" value="0" aria-label="time"><output class="clock"></output>
<small class="whole"></small><select class="speed" aria-label="speed, as a share of real time"></select>
<small class="pace"></small><button type="button" class="screen">Full screen</button>
<button type="button" class="help" aria-label="help: keys">?</button></div>
<div class="panel"><select class="quantity" aria-label="curves"></select>
<div class="plots"><canvas class="curves" role="img" aria-label="joints over time; drag to choose a time"></canvas>
</div>
<ul class="joints"></ul></div>
<dialog class="keys" aria-label="keys"><h2>Keys</h2><dl class="list"></dl>
<p>Drag on the curves to choose a time.</p><form method="dialog"><button>Close</button></form></dialog>
<script type="application/json">{data}</script>
</figure>
""")
PAGE = Markup("""\
<!DOCTYPE html>
<html lang="en">
<head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title><style>{style}</style></head>
<body class="page"><h1>{title}</h1>
{player}<script>{script}</script></body>
</html>
""")


def player(title: str, frames: Frames, kind: str = "player") -> Markup:
    """The HTML element that shows a motion; its page must contain ``STYLE`` and, after the element, ``SCRIPT``.

    Args:
        title: of the motion.
        frames: of it.
        kind: classes of the element; ``player full`` fills what its page leaves.
    """
    stage = STAGES[frames.problem.robot.dim]
    data = htmlsafe_json_dumps(shared_content(frames) | stage.content(frames), separators=(",", ":"))
    return PLAYER.format(title=title, kind=kind, stage=stage, data=data)


def page(title: str, frames: Frames) -> str:
    """A self-contained page with one player that fills the screen."""
    return str(PAGE.format(title=title, style=STYLE, script=SCRIPT, player=player(title, frames, "player full")))

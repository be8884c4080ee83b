"""The HTML player: an element, and the page around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup

from tpbso_casadi.animation.frames import Frames, frames_of
from tpbso_casadi.animation.player_data import plane_data as content_in_plane
from tpbso_casadi.animation.player_data import shared_data
from tpbso_casadi.animation.player_data import space_data as content_in_space
from tpbso_casadi.figures.palette import BLUE, BROKEN, CLOSEST, COURSE, GREEN, OBSTACLE, VERMILLION
from tpbso_casadi.plain import visible
from tpbso_casadi.simulation import SimulationRecord, notes, simulated_motion
from tpbso_casadi.storage import write_text

FOLDER = Path(__file__).parent
SHARED = ("numbers", "pen", "theme", "clock", "choices", "transport", "stages", "keys", "curves", "legend", "measures")
STAGE_SCRIPTS = (
    "plane/stage",
    "space/camera",
    "space/order",
    "space/ground",
    "space/looks",
    "space/painter",
    "space/steer",
    "space/stage",
)
PARTS = (*(f"player/{part}" for part in SHARED), *STAGE_SCRIPTS, "player/player")
COLOURS = {
    "way": BLUE,
    "task": GREEN,
    "obstacle": OBSTACLE,
    "edge": COURSE,
    "close": CLOSEST,
    "broken": BROKEN,
    "axis-x": VERMILLION,
    "axis-y": GREEN,
    "axis-z": BLUE,
}


def _read(name: str) -> str:
    return (FOLDER / name).read_text(encoding="utf-8")


_PRINTED = "".join(f"--print-{name}:{colour};" for name, colour in COLOURS.items())
SCRIPT = Markup('"use strict";\n(() => {{\n{}}})();\n').format(
    Markup("").join(Markup(_read(f"{part}.js")) for part in PARTS)
)
STYLE = Markup(f":root{{{_PRINTED}}}\n{_read('player/player.css')}")


@dataclass(frozen=True)
class Stage:
    """A place in a page where a motion is shown.

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
<div class="said"><p class="near"></p><p class="whole-way"></p><p class="note"></p></div>
<div class="bar"><button type="button" class="play">Pause</button>
<button type="button" class="back" aria-label="one step back">&lsaquo;</button>
<button type="button" class="next" aria-label="one step on">&rsaquo;</button>
<div class="line"><div class="stages" hidden></div>
<input class="time" type="range" min="0" value="0" aria-label="time"></div><output class="clock"></output>
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
    stage = STAGES[frames.criteria.robot.dim]
    data = htmlsafe_json_dumps(shared_data(frames) | stage.content(frames), separators=(",", ":"))
    return PLAYER.format(title=title, kind=kind, stage=stage, data=data)


def page(title: str, frames: Frames) -> str:
    """A self-contained page with one player that fills the screen."""
    return str(PAGE.format(title=title, style=STYLE, script=SCRIPT, player=player(title, frames, "player full")))


FRAMES_PER_SECOND = {2: 40, 3: 20}  # by the robot's dimensions; the player draws what is between two
MOST_FRAMES = 2000


def simulation_page(title: str, record: SimulationRecord) -> str:
    """A self-contained page that plays a simulation."""
    wanted = int(np.ceil(FRAMES_PER_SECOND[record.robot.dim] * record.duration)) + 1
    frames = frames_of(simulated_motion(record), min(wanted, MOST_FRAMES))
    frames = replace(frames, notes=notes(record), seconds=record.duration)
    return page(title, frames)


def write_player(folder: Path, title: str, record: SimulationRecord) -> Path:
    """Write ``simulation.html`` into a folder; what is not printable in the title is shown escaped."""
    text = simulation_page(visible(title), record)
    return write_text(folder / "simulation.html", lambda file: file.write(text))

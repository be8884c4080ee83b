"""Script and style sheet of the players, joined of files that hold one idea each."""

from __future__ import annotations

from pathlib import Path

from markupsafe import Markup

from tpbso_casadi.figures.style.colours import BLUE, CLOSEST, COURSE, GREEN, OBSTACLE, VERMILLION

FOLDER = Path(__file__).parents[1]
SHARED = ("numbers", "pen", "theme", "clock", "transport", "keys", "curves", "legend", "measures")
STAGES = ("plane/stage", "space/camera", "space/order", "space/ground", "space/painter", "space/steer", "space/stage")
PARTS = (*(f"player/{part}" for part in SHARED), *STAGES, "player/player")
COLOURS = {
    "way": BLUE,
    "task": GREEN,
    "obstacle": OBSTACLE,
    "edge": COURSE,
    "close": CLOSEST,
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

"""Scenario files written from tables, and the tables of small arms that many tests plan with."""

from __future__ import annotations

import json
from typing import Any

TWO_LINKS = {"link_lengths": [1.0, 0.8], "max_speed": 4.0, "max_acceleration": 20.0}
SWING = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]}
SHORT_ARM = {"link_lengths": [0.5, 0.4], "max_speed": 3.0, "max_acceleration": 15.0}
TURN = {"kind": "point-to-point", "start": {"joints": [-0.6, 0.4]}, "goal": {"joints": [0.8, -0.3]}}
CART = {"shape": "box", "center": [1.05, -0.6], "size": [0.1, 0.1], "velocity": [0.0, 0.2]}  # passes the short arm
COURSES = {"changes_every": 0.3, "course_rate": 0.5, "region": [[0.9, -1.0], [1.3, 1.0]]}  # of the cart


def toml(**tables: Any) -> str:
    """The file of a scenario: keys of its own, tables, and lists of tables, in this order."""
    lines: list[str] = []
    for name, stated in tables.items():
        several = stated if isinstance(stated, list) else [stated]
        if not all(isinstance(table, dict) for table in several):
            lines.append(f"{name} = {_inline(stated)}")
            continue
        for table in several:
            lines.append(f"[[{name}]]" if stated is several else f"[{name}]")
            lines += [f"{key} = {_inline(value)}" for key, value in table.items()]
    return "\n".join([*lines, ""])


def _inline(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{key} = {_inline(each)}' for key, each in value.items())} }}"
    return f"[{', '.join(map(_inline, value))}]" if isinstance(value, (list, tuple)) else json.dumps(value)

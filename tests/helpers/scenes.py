"""Scenario files written from tables, and the tables of small arms that many tests plan with."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

TWO_LINKS = {"link_lengths": [1.0, 0.8], "max_speed": 4.0, "max_acceleration": 20.0}
SWING = {"kind": "point-to-point", "start": [1.0, 0.0], "goal": [0.5, 1.5]}
SHORT_ARM = {"link_lengths": [0.5, 0.4], "max_speed": 3.0, "max_acceleration": 15.0}
TURN = {"kind": "point-to-point", "start": {"joints": [-0.6, 0.4]}, "goal": {"joints": [0.8, -0.3]}}
CART = {"shape": "box", "center": [1.05, -0.6], "size": [0.1, 0.1], "velocity": [0.0, 0.2]}  # passes the short arm
COURSES = {"changes_every": 0.3, "course_rate": 0.5, "region": [[0.9, -1.0], [1.3, 1.0]]}  # of the cart


@dataclass(frozen=True)
class Raw:
    """A value as it is written in a TOML file."""

    text: str


def toml(**content: Any) -> str:
    """Plain data as TOML, one line a key: those of the file first, then its tables."""
    tables = {name: table for name, table in content.items() if isinstance(table, dict) and table}
    lines = [f"{_key(name)} = {_literal(value)}" for name, value in content.items() if name not in tables]
    for name, table in tables.items():
        lines += [f"[{_key(name)}]", *(f"{_key(key)} = {_literal(value)}" for key, value in table.items())]
    return "\n".join(lines) + "\n"


def _literal(value: Any) -> str:
    if isinstance(value, Raw):
        return value.text
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_key(key)} = {_literal(entry)}" for key, entry in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(_literal, value)) + "]"
    return _key(value) if isinstance(value, str) else json.dumps(value)


def _key(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")

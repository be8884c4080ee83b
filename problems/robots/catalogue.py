"""Robots that are built in: their files, by name."""

from __future__ import annotations

import tomllib
from collections.abc import Collection
from dataclasses import replace
from importlib.resources import files
from typing import Any

from problems.base import InvalidProblem
from problems.robots.description import RobotDescription, read_spheres
from problems.robots.urdf import read_urdf

BUILT_IN: Collection[str] = ("panda", "ur5e", "iiwa14")


def built_in(name: str, tip_link: str | None = None) -> RobotDescription:
    """A robot that is built in, with its limits and spheres.

    Args:
        name: one of ``BUILT_IN``.
        tip_link: the end of the chain; the robot's usual tool frame by default.

    Raises:
        InvalidProblem: there is no such robot, or no such link.
    """
    if name not in BUILT_IN:
        raise InvalidProblem("model", f"{name!r} is not built in; there are {', '.join(BUILT_IN)}")
    known = tomllib.loads(_text(f"{name}.toml"))
    description = read_urdf(_text(f"{name}.urdf"), tip_link=tip_link or known["tip_link"])
    return replace(
        description,
        title=known["title"],
        spheres=read_spheres(_text(f"{name}-spheres.toml"), description.links),
        max_acceleration=_known(description, known, "max_acceleration"),
        max_jerk=_known(description, known, "max_jerk"),
        disabled=tuple((one, two) for one, two in known["disabled"]),
        notes=tuple(known["notes"]),
    )


def _known(description: RobotDescription, known: dict[str, Any], field: str) -> tuple[float, ...] | None:
    """The values of the chain's joints; None where one of them has none."""
    values: dict[str, float] = known.get(field, {})
    names = [joint.name for joint in description.chain.joints]
    return tuple(values[name] for name in names) if set(names) <= set(values) else None


def _text(name: str) -> str:
    return files(__package__).joinpath("models", name).read_text(encoding="utf-8")

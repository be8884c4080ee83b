"""The robots that are built in: kinematics and masses of a URDF, limits, covers and looks of the links."""

from __future__ import annotations

import tomllib
from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache
from importlib.resources import files
from typing import Any

from problems.base import InvalidProblem
from problems.robots.appearance import Parts, read_appearances
from problems.robots.description import RobotDescription
from problems.robots.link_covers import LinkCover, read_covers
from problems.robots.urdf import read_urdf

BUILT_IN: Collection[str] = ("panda", "ur5e", "iiwa14")


@lru_cache
def built_in(name: str, tip_link: str | None = None) -> RobotDescription:
    """A built-in robot with its limits and covers.

    Args:
        name: one of ``BUILT_IN``.
        tip_link: the end of the chain; the robot's usual tool frame by default.

    Raises:
        InvalidProblem: there is no such robot, or no such link.
    """
    if name not in BUILT_IN:
        raise InvalidProblem("model", f"{name!r} is not built in; there are {', '.join(BUILT_IN)}")
    known, covers = tomllib.loads(_text(f"{name}.toml")), _covers(name)
    description = read_urdf(_text(f"{name}.urdf"), tip_link=tip_link or known["tip_link"])
    links = {frame.name for frame in description.links}
    covered = replace(description, shapes=tuple((link, ()) for link in covers if link in links)).with_covers(covers)
    return replace(
        covered.with_appearances(_appearances(name)),
        title=known["title"],
        max_acceleration=_known(description, known, "max_acceleration"),
        max_jerk=_known(description, known, "max_jerk"),
        notes=tuple(known["notes"]),
    )


@lru_cache
def _covers(name: str) -> dict[str, LinkCover]:
    return read_covers(_text(f"{name}-covers.json"))


@lru_cache
def _appearances(name: str) -> dict[str, Parts]:
    return read_appearances(_text(f"{name}-looks.json"))


def _known(description: RobotDescription, known: dict[str, Any], field: str) -> tuple[float, ...] | None:
    """The values of the chain's joints; None where one of them has none."""
    values: dict[str, float] = known.get(field, {})
    names = [joint.name for joint in description.chain.joints]
    return tuple(values[name] for name in names) if set(names) <= set(values) else None


def _text(name: str) -> str:
    return files(__package__).joinpath("models", name).read_text(encoding="utf-8")

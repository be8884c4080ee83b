"""Objects of a model as the tables of a scenario file that state them: the way back from what a scenario builds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields
from typing import Any

from problems import (
    Ball,
    Box,
    Capsule,
    ConstantVelocity,
    Cylinder,
    Ellipse,
    Ellipsoid,
    HalfSpace,
    Joints,
    MovingObstacle,
    Obstacle,
    PlanarArm,
    Polygon,
    Position,
    Rectangle,
    Robot,
)
from problems.tasks.place import Place
from problems.tasks.pose import Pose
from tpbso_casadi.facade.plain_data import plain
from tpbso_casadi.scenario.section import ScenarioError
from tpbso_casadi.scenario.world.robots import ARM_KEYS

SHAPE_NAMES: dict[type[Obstacle], str] = {
    Ellipse: "ellipse",
    Rectangle: "box",
    Polygon: "polygon",
    Box: "box",
    Ball: "sphere",
    Capsule: "capsule",
    Cylinder: "cylinder",
    Ellipsoid: "ellipsoid",
    HalfSpace: "half-space",
}
OF_THE_MODEL = ("margin", "self_collision")  # fields of a robot that a scenario states in [model]


def arm_table(arm: PlanarArm) -> dict[str, Any]:
    """The [arm] table of a planar arm."""
    table = {ARM_KEYS.get(key, key): value for key, value in _stated(arm).items()}
    table["base"] = [*arm.base_point, arm.base_angle]
    if arm.payload is not None:
        payload = arm.payload
        table["payload"] = {"mass": payload.mass, "center": payload.center[:2], "inertia": payload.matrix[2][2]}
    return dict(plain(table))


def settings_table(robot: Robot) -> dict[str, Any]:
    """The [robot] table of a robot of any class, by its path."""
    return {"model": path_of(type(robot)), "settings": plain(_stated(robot))}


def obstacle_table(obstacle: Obstacle | dict[str, Any]) -> dict[str, Any]:
    """One of the [[obstacles]].

    Raises:
        ScenarioError: no table states it.
    """
    if isinstance(obstacle, dict):
        return dict(plain(obstacle))
    if isinstance(obstacle, MovingObstacle):
        if not isinstance(obstacle.motion, ConstantVelocity):
            raise ScenarioError("obstacles: state a tabulated motion as a table with motion_rows")
        table = obstacle_table(obstacle.still) | {"velocity": plain(obstacle.motion.velocity)}
        return table | ({"margin_rate": obstacle.margin_rate} if obstacle.margin_rate else {})
    shape = SHAPE_NAMES.get(type(obstacle), "")
    if not shape:
        raise ScenarioError(f"obstacles: no table states {type(obstacle).__name__}; say it as a dict")
    return {"shape": shape, **plain(_stated(obstacle))}


def place_table(place: Any, dof: int, dim: int) -> Any:
    """A place of a [task] table.

    Args:
        place: :class:`Joints`, :class:`Position`, :class:`Pose`, a table, or numbers: a point where there are as many
            as the space has dimensions, joint values where there are as many as joints.
        dof: how many joints the robot has.
        dim: of its space.

    Raises:
        ScenarioError: it is none of these.
    """
    if isinstance(place, Joints):
        return {"joints": plain(place.values)}
    if isinstance(place, Position):
        return {"position": plain(place.point)}
    if isinstance(place, Pose):
        turned = {} if place.quaternion is None else {"quaternion": plain(place.quaternion)}
        return {"position": plain(place.point), **turned}
    if isinstance(place, Place):
        raise ScenarioError(f"task: no table states {type(place).__name__}")
    given = plain(place)
    if not isinstance(given, list) or any(isinstance(entry, list | dict) for entry in given):
        return given
    if len(given) == dim == dof and dim > 2:
        raise ScenarioError(f"task: {given} may be a point or joint values: say tp.Pose(...) or tp.Joints(...)")
    if len(given) == dim:
        return given if dim == 2 else {"position": given}
    return {"joints": given}


def goals_table(goal: Any, dof: int, dim: int) -> Any:
    """A goal, or a list of goals of which any will do."""
    several = isinstance(goal, Sequence) and not isinstance(goal, str) and bool(goal) and not _is_number(goal[0])
    return places_table(goal, dof, dim) if several else place_table(goal, dof, dim)


def places_table(places: Sequence[Any], dof: int, dim: int) -> list[Any]:
    """A list of places."""
    return [place_table(place, dof, dim) for place in places]


def path_of(kind: type) -> str:
    """``package.module:Class``, as a scenario names classes of anyone."""
    return f"{kind.__module__}:{kind.__qualname__}"


def _is_number(value: Any) -> bool:
    return isinstance(plain(value), int | float)


def _stated(thing: Any) -> dict[str, Any]:
    """The fields of a dataclass that a table states: those that are not None, and of no other table."""
    values = {field.name: getattr(thing, field.name) for field in fields(thing)}
    derived = {"base_point", "base_angle", "payload", *OF_THE_MODEL}
    return {key: value for key, value in values.items() if value is not None and key not in derived}

"""Constraints of a hand: values by hand, what falls with time, what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.space import small_arm
from scipy.spatial.transform import Rotation

from problems import InvalidProblem, PlanarArm, Robot
from problems.limits import HAND_CONSTRAINTS, HandConstraint, ToolOrientation, ToolRegion, ToolSpeed, Upright

PLANE = PlanarArm((0.6, 0.4), (2.0, 2.0), (5.0, 5.0))
SPACE = small_arm()


def values(constraint: HandConstraint, robot: Robot, q: Any, speed: Any = None) -> np.ndarray:
    """Of the expression at joints (dof,) with speeds (dof,)."""
    state = np.zeros((1, 4 * robot.dof + 1))
    state[0, : robot.dof] = q
    state[0, robot.dof : 2 * robot.dof] = 0.0 if speed is None else speed
    return constraint.stated(robot).function.probed(robot, state)[0]


@pytest.mark.parametrize("away", [0.0, 1e-9, 1e-3, 0.2, 1.5, 3.0])
def test_in_the_plane_it_is_the_angle_of_the_last_link(away: float) -> None:
    constraint = Upright(axis=(2.0, 0.0), toward=(0.0, 0.5), tolerance=0.1)
    [angle] = values(constraint, PLANE, [0.4, np.pi / 2.0 - 0.4 + away])
    assert angle == pytest.approx(away, abs=1e-14)
    sideways = Upright(axis=(0.0, 1.0), toward=(-1.0, 0.0), tolerance=0.1)
    assert values(sideways, PLANE, [0.4, np.pi / 2.0 - 0.4 + away]) == pytest.approx([away], abs=1e-14)


def test_in_space_it_is_the_angle_between_axis_and_direction() -> None:
    q = np.random.default_rng(1).uniform(-1.0, 1.0, SPACE.dof)
    rotation = SPACE.tool.at(q[None])[1][0].reshape(3, 3)
    axis, toward = np.array([0.6, 0.0, 0.8]), np.array([0.0, 0.0, -1.0])
    expected = np.arctan2(np.linalg.norm(np.cross(rotation @ axis, toward)), rotation @ axis @ toward)
    constraint = Upright(axis=tuple(3.0 * axis), toward=tuple(toward), tolerance=0.1)
    assert values(constraint, SPACE, q) == pytest.approx([expected], abs=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 2.9])
def test_an_orientation_is_missed_by_the_angle_of_the_turn(angle: float) -> None:
    q = np.random.default_rng(2).uniform(-1.0, 1.0, SPACE.dof)
    own = Rotation.from_matrix(SPACE.tool.at(q[None])[1][0].reshape(3, 3))
    turned = own * Rotation.from_rotvec(angle * np.array([0.6, 0.0, 0.8]))
    constraint = ToolOrientation(quaternion=tuple(turned.as_quat().tolist()), tolerance=0.1)
    assert values(constraint, SPACE, q) == pytest.approx([angle], abs=1e-9)
    leans = 2.0 * np.arcsin(np.linalg.norm(turned.apply(np.eye(3)) - own.apply(np.eye(3)), axis=1) / 2.0)
    for axis, lean in zip(("x", "y", "z"), leans, strict=True):
        assert values(replace(constraint, free=axis), SPACE, q) == pytest.approx([lean], abs=1e-9)


def test_a_box_is_stated_along_its_axes_and_a_plane_by_the_distance() -> None:
    tool = np.array([0.6, 0.4])  # the first link along x, the second along y
    box = ToolRegion(center=(0.5, 0.2), size=(0.2, 0.6), angle=np.pi / 2.0)
    assert values(box, PLANE, [0.0, np.pi / 2.0]) == pytest.approx([tool[1] - 0.2, 0.5 - tool[0]])
    limit = box.for_robot(PLANE, ())
    assert limit.lower == pytest.approx((-0.1, -0.3)) and limit.upper == pytest.approx((0.1, 0.3))
    plane = ToolRegion(point=(0.1, 0.0), normal=(2.0, 0.0))
    assert values(plane, PLANE, [0.0, np.pi / 2.0]) == pytest.approx([0.5])
    assert plane.for_robot(PLANE, ()).upper is None
    both = ToolRegion(center=(0.5, 0.2), size=(0.2, 0.6), point=(0.1, 0.0), normal=(2.0, 0.0)).for_robot(PLANE, ())
    assert both.lower == pytest.approx((-0.1, -0.3, 0.0)) and both.upper == pytest.approx((0.1, 0.3, np.inf))


def test_a_box_in_space_is_turned_by_its_quaternion() -> None:
    q = np.full(SPACE.dof, 0.3)
    tool, turn = SPACE.tool.at(q[None])[0][0], Rotation.from_rotvec([0.2, 0.1, -0.4])
    box = ToolRegion(center=(0.1, 0.2, 0.3), size=(1.0, 1.0, 1.0), quaternion=tuple(turn.as_quat().tolist()))
    assert values(box, SPACE, q) == pytest.approx(turn.inv().apply(tool - [0.1, 0.2, 0.3]))


def test_the_speed_of_the_tool_is_that_of_its_point_and_falls_with_time() -> None:
    assert values(ToolSpeed(max=1.0), PLANE, [0.0, 0.0], [0.5, 0.0]) == pytest.approx([0.5])  # 1 m from the base
    assert values(ToolSpeed(max=1.0), PLANE, [0.0, np.pi / 2.0], [0.0, 2.0]) == pytest.approx([0.8])
    assert ToolSpeed(max=1.0).for_robot(PLANE, ()).degree == 1.0
    others: list[HandConstraint] = [
        Upright(tolerance=0.1),
        ToolOrientation(quaternion=(0.0, 0.0, 0.0, 1.0), tolerance=0.1),
        ToolRegion(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0)),
    ]
    assert [each.for_robot(SPACE, ()).degree for each in others] == [None, None, None]


def test_names_are_those_of_the_kinds() -> None:
    assert ToolSpeed(max=1.0).name == "tool speed" and ToolSpeed(max=1.0, name="slow").name == "slow"
    assert list(HAND_CONSTRAINTS) == ["upright", "tool orientation", "tool region", "tool speed", "relative pose"]


REFUSED: list[tuple[type[HandConstraint], dict[str, Any], str]] = [
    (Upright, {"tolerance": 0.0}, "tolerance: 0 is not within 1e-06 and 3 rad"),
    (Upright, {"tolerance": 0.1, "axis": (0.0, 0.0, 0.0)}, "axis: a direction is needed, not zero"),
    (Upright, {"tolerance": 0.1, "axis": (1.0,)}, "axis: 1 coordinates are not within 2 and 3"),
    (Upright, {"tolerance": 0.1, "toward": (1.0, 0.0)}, "toward: 2 coordinates, the axis has 3"),
    (ToolOrientation, {"tolerance": 0.1, "quaternion": (1.0, 1.0, 0.0, 0.0)}, "quaternion: .* is not of length 1"),
    (ToolOrientation, {"tolerance": 0.1, "quaternion": (1.0, 0.0, 0.0, 0.0), "free": "w"}, "free: "),
    (ToolRegion, {}, "center: say a box"),
    (ToolRegion, {"center": (0.0, 0.0)}, "size: missing beside center"),
    (ToolRegion, {"size": (1.0, 1.0)}, "center: missing beside size"),
    (ToolRegion, {"point": (0.0, 0.0)}, "normal: missing beside point"),
    (ToolRegion, {"normal": (0.0, 1.0)}, "point: missing beside normal"),
    (ToolRegion, {"center": (0.0, 0.0), "size": (1.0, 1.0, 1.0)}, "size: 3 numbers, center has 2"),
    (ToolRegion, {"center": (0.0, 0.0), "size": (1.0, 0.0)}, "size: 0 is not within"),
    (ToolRegion, {"point": (0.0, 0.0), "normal": (0.0, 1.0), "angle": 0.1}, "angle: only a box is turned"),
    (ToolRegion, {"center": (0.0,) * 3, "size": (1.0,) * 3, "angle": 0.1}, "angle: of a box in the plane"),
    (
        ToolRegion,
        {"center": (0.0,) * 2, "size": (1.0,) * 2, "quaternion": (0.0, 0.0, 0.0, 1.0)},
        "quaternion: of a box in space",
    ),
    (ToolSpeed, {"max": 0.0}, "max: 0 is not within 1e-06 and 1e[+]06 m/s"),
]


@pytest.mark.parametrize(("kind", "keys", "said"), REFUSED)
def test_what_fits_nothing_is_refused(kind: type[HandConstraint], keys: dict[str, Any], said: str) -> None:
    with pytest.raises(InvalidProblem, match=f"^{said}"):
        kind(**keys)


@pytest.mark.parametrize(
    ("constraint", "robot", "said"),
    [
        (Upright(tolerance=0.1), PLANE, "'upright': axis has 3 coordinates, for a robot in 2 dimensions"),
        (
            ToolOrientation(quaternion=(0.0, 0.0, 0.0, 1.0), tolerance=0.1),
            PLANE,
            "'tool orientation': of robots in space alone",
        ),
        (ToolRegion(center=(0.0, 0.0), size=(1.0, 1.0)), SPACE, "'tool region': center has 2 coordinates"),
        (ToolRegion(point=(0.0, 0.0), normal=(1.0, 1.0)), SPACE, "'tool region': point has 2 coordinates"),
    ],
)
def test_what_a_robot_has_not_is_refused(constraint: HandConstraint, robot: Robot, said: str) -> None:
    with pytest.raises(InvalidProblem, match=said):
        constraint.for_robot(robot, ())

"""Clouds of points: what is read, what is refused, and boxes that hold the balls around all points."""

from __future__ import annotations

import io

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import InvalidProblem
from problems.geometry import boxes_around, read_cloud

POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 3))
PLY = b"ply\nformat ascii 1.0\nelement vertex %d\nproperty float x\nproperty float y\nproperty float z\nend_header\n"


def npy(array: object) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


def xyz(points: np.ndarray, separator: str = " ") -> bytes:
    return "\n".join(["# x y z", *(separator.join(map(repr, row)) for row in points.tolist())]).encode()


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("cloud.npy", npy(POINTS)),
        ("image.npy", npy(POINTS.reshape(5, 10, 3))),
        ("cloud.XYZ", xyz(POINTS)),
        ("cloud.xyz", xyz(POINTS, ", ")),
        ("cloud.xyz", xyz(np.column_stack([POINTS, POINTS]))),  # with colours
    ],
)
def test_points_are_read(name: str, content: bytes) -> None:
    np.testing.assert_array_equal(read_cloud(name, content), POINTS)


def test_ply_of_text_is_read() -> None:
    assert read_cloud("cloud.ply", PLY % 2 + b"0 0 0\n1 2 3\n\n").tolist() == [[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]


def test_ply_is_read() -> None:
    content = trimesh.PointCloud(POINTS).export(file_type="ply")
    np.testing.assert_allclose(read_cloud("cloud.ply", content), POINTS, atol=1e-6)


def test_pixels_without_depth_are_left_out() -> None:
    holes = POINTS.copy()
    holes[::2, 2] = np.nan
    np.testing.assert_array_equal(read_cloud("cloud.npy", npy(holes)), POINTS[1::2])


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("cloud.pcd", b"", "it ends with 'pcd'; ply, xyz, npy are read"),
        ("cloud.ply", b"ply nonsense", "it cannot be read: "),
        ("cloud.xyz", b"1,5 2,5 3,5\n", "commas and blanks are mixed"),
        (
            "cloud.ply",
            PLY % 4 + b"0 0 0\n1 0 0\n0 1 0\n",
            "it cannot be read: ValueError: its head counts other points",
        ),
        (
            "cloud.ply",
            PLY % 2 + b"0 0 0\n1 0 0\n0 1 0\n",
            "it cannot be read: ValueError: its head counts other points",
        ),
        ("cloud.ply", PLY % 3 + b"0 0 0 1 0 0\n0 1 0\n", "it cannot be read: ValueError: its head counts other points"),
        ("cloud.xyz", b"1 2\n", "it cannot be read: "),
        ("cloud.npy", npy(POINTS[:, :2]), r"not an array \(50, 2\)"),
        ("cloud.npy", npy(np.array([object()])), "it cannot be read: "),
        ("cloud.npy", npy(np.array([["a", "b", "c"]])), "numbers are needed, not an array of <U1"),
        ("cloud.npy", npy(np.full((5, 3), np.nan)), "it has no points"),
        ("cloud.npy", npy(np.array([[1e308, 0.0, 0.0], [-1e308, 0.0, 0.0]])), "it is inf m large"),
        ("cloud.xyz", b"# nothing\n", "it has no points|not an array"),
        ("cloud.npy", npy(1000.0 * POINTS), "m large, of at most 100: is it in mm"),
    ],
)
def test_what_is_refused(name: str, content: bytes, reason: str) -> None:
    with pytest.raises(InvalidProblem, match=reason):
        read_cloud(name, content)


def beyond(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """How far points are outside of all boxes, m; how deep they are inside of one."""
    low, high = boxes[:, 0], boxes[:, 1]
    return np.max(np.stack([low - points[:, None], points[:, None] - high]), axis=(0, 3)).min(axis=1)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**31), st.integers(1, 300), st.sampled_from([5, 40, 1000]), st.sampled_from([0.01, 0.05]))
def test_boxes_hold_the_balls_and_little_else(seed: int, count: int, most: int, radius: float) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-0.5, 0.5, (count, 3)) * [1.0, 1.0, 0.1]
    boxes, cell = boxes_around(points, radius, most)
    assert len(boxes) <= most
    assert (beyond(boxes, points) <= -radius + 1e-12).all()
    somewhere = boxes[rng.integers(0, len(boxes), 200)]
    shares = rng.uniform(size=(200, 3))
    places = somewhere[:, 0] + radius + shares * (np.ptp(somewhere, axis=1) - 2.0 * radius)
    nearest = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1)
    assert nearest.max() <= np.sqrt(3.0) * cell + 1e-12


def test_a_table_top_is_one_box() -> None:
    x, y = np.meshgrid(np.linspace(0.0, 1.0, 101), np.linspace(0.0, 0.5, 51))
    boxes, cell = boxes_around(np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 0.7)]), 0.01, 100)
    assert cell == 0.02
    np.testing.assert_allclose(boxes, [[[-0.01, -0.01, 0.69], [1.01, 0.51, 0.71]]], atol=1e-12)


def test_balls_far_smaller_than_the_cloud() -> None:
    boxes, cell = boxes_around(POINTS, 1e-300, 10)
    assert len(boxes) <= 10 and cell > 1e-3
    assert (beyond(boxes, POINTS) <= 0.0).all()

"""The UR5e in closed form: its tool's pose, and all postures that reach one, from its Denavit-Hartenberg numbers.

The shoulder turns the plane of the arm, the wrist's centre is at a fixed distance from it, and the three joints between
have parallel axes (Hawkins, "Analytic inverse kinematics for the Universal Robots", 2013).
"""

from functools import reduce
from itertools import product

import numpy as np

D1, A2, A3, D4, D5, D6 = 0.1625, -0.425, -0.3922, 0.1333, 0.0997, 0.0996  # m, as the maker publishes them
ALPHA = (np.pi / 2, 0.0, 0.0, np.pi / 2, -np.pi / 2, 0.0)
BASE = np.diag([-1.0, -1.0, 1.0, 1.0])  # the frame of a URDF's base, half a turn from the maker's


def link(theta: np.ndarray, a: float, alpha: float, d: float) -> np.ndarray:
    """The pose (n, 4, 4) of a joint's frame in the one before it."""
    c, s, ca, sa = np.cos(theta), np.sin(theta), np.cos(alpha), np.sin(alpha)
    zero, one = np.zeros_like(theta), np.ones_like(theta)
    rows = (c, -s * ca, s * sa, a * c), (s, c * ca, -c * sa, a * s), (zero, sa * one, ca * one, d * one)
    return np.stack([np.stack(row, -1) for row in (*rows, (zero, zero, zero, one))], -2)


def links(theta: np.ndarray) -> list[np.ndarray]:
    """The six poses (n, 4, 4) of postures (n, 6), each in the frame before it."""
    numbers = zip((0.0, A2, A3, 0.0, 0.0, 0.0), ALPHA, (D1, 0.0, 0.0, D4, D5, D6), strict=True)
    return [link(theta[:, joint], *each) for joint, each in enumerate(numbers)]


def forward(theta: np.ndarray) -> np.ndarray:
    """The tool's poses (n, 4, 4) in postures (n, 6)."""
    return reduce(np.matmul, links(theta), BASE)


def inverse(poses: np.ndarray) -> list[np.ndarray]:
    """All postures (k, 6) of each pose (n, 4, 4), at most eight, in turns of any kind."""
    with np.errstate(invalid="ignore"):  # of a branch that does not get there
        theta = np.stack([branch(BASE @ poses, *signs) for signs in product((1.0, -1.0), repeat=3)], axis=1)
    return [each[np.isfinite(each).all(axis=1)] for each in theta]


def apart(postures: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The largest difference of a joint, up to whole turns, of postures (n, dof) and others (m, dof): (n, m), rad."""
    return np.abs(np.angle(np.exp(1j * (postures[:, None] - others[None])))).max(axis=2)


def branch(pose: np.ndarray, shoulder: float, wrist: float, elbow: float) -> np.ndarray:
    """The posture (n, 6) on one side of shoulder, wrist and elbow, of each pose in the maker's frame; NaN for none."""
    p, x, y, z = pose[:, :3, 3], pose[:, :3, 0], pose[:, :3, 1], pose[:, :3, 2]
    centre = p - D6 * z
    first = np.arctan2(centre[:, 1], centre[:, 0]) + np.pi / 2
    first = first + shoulder * np.arccos(D4 / np.hypot(centre[:, 0], centre[:, 1]))
    across = np.stack([np.sin(first), -np.cos(first), 0.0 * first], -1)  # the axis of joints 2, 3 and 4
    fifth = wrist * np.arccos((np.sum(p * across, -1) - D4) / D6)
    sixth = np.arctan2(-np.sum(y * across, -1) / np.sin(fifth), np.sum(x * across, -1) / np.sin(fifth))
    shoulder_frame = link(first, 0.0, ALPHA[0], D1)
    hand = link(fifth, 0.0, ALPHA[4], D5) @ link(sixth, 0.0, ALPHA[5], D6)
    between = np.linalg.inv(shoulder_frame) @ pose @ np.linalg.inv(hand)  # joints 2, 3, 4 in their plane
    point = between[:, 0, 3] + 1j * between[:, 1, 3]
    third = elbow * np.arccos((np.abs(point) ** 2 - A2**2 - A3**2) / (2.0 * A2 * A3))
    second = np.angle(point / (A2 + A3 * np.exp(1j * third)))
    fourth = np.arctan2(between[:, 1, 0], between[:, 0, 0]) - second - third
    return np.stack([first, second, third, fourth, fifth, sixth], -1)

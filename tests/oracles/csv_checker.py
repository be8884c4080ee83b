"""Checks a run folder from ``trajectory.csv`` and the scenario in ``result.json``, in NumPy alone.

The one thing taken from the package is the list of points of a built-in shape of path.
"""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np

from tpbso_casadi import parse_scenario


def check_run(folder: Path) -> dict[str, Any]:
    """Raise AssertionError unless the run is what it says; returns ``result.json``."""
    result = json.loads((folder / "result.json").read_text())
    with (folder / "trajectory.csv").open() as file:
        header, *lines = csv.reader(file)
    arm, task = result["scenario"]["arm"], result["scenario"]["task"]
    k = len(arm["link_lengths"])
    joints = range(1, k + 1)
    assert header == ["t", *(f"{s}{j}" for s in ("q", "qd", "qdd") for j in joints), "x", "y"]
    rows = np.array(lines, dtype=float)
    t, q, qd, qdd, tip = np.split(rows, np.cumsum([1, k, k, k]), axis=1)
    t = t.ravel()
    assert len(t) >= 200
    assert t[0] == 0.0
    assert (np.diff(t) > 0.0).all()
    free_times = result["scenario"]["model"]["motion"] == "spline" or result.get("retiming", {}).get("accepted", False)
    if free_times:
        check_limited(t, q, qd, np.array(arm["max_acceleration"]))
    else:
        check_smooth(t, q, qd, qdd)
    assert (np.abs(qd) <= np.array(arm["max_speed"]) * (1.0 + 1e-9)).all()
    assert (np.abs(qdd) <= np.array(arm["max_acceleration"]) * (1.0 + 1e-9)).all()
    if arm["joint_limits"] is not None:
        low, high = np.array(arm["joint_limits"]).T
        assert ((q >= low - 1e-9) & (q <= high + 1e-9)).all()
    positions = np.cumsum(np.array(arm["link_lengths"]) * np.exp(1j * np.cumsum(q, axis=1)), axis=1)
    positions = np.column_stack([np.zeros(len(t)), positions])
    np.testing.assert_allclose(tip @ [1.0, 1j], positions[:, -1], atol=1e-9)
    for obstacle in result["scenario"]["obstacles"]:
        check_clear(obstacle, positions)
    steps = np.abs(np.diff(positions[:, -1]))
    measured = {"time": t[-1], "rotation": np.abs(np.diff(q, axis=0)).sum(), "length": steps.sum()}[task["objective"]]
    missed = 0.0 if task["objective"] == "time" else 1e-3  # relative: what rows do not see between them
    assert -1e-9 * measured <= result["objective"]["value"] - measured <= (missed + 1e-9) * measured
    (check_passed if free_times else check_task)(result["scenario"], t, tip)
    return result


def check_limited(t: np.ndarray, q: np.ndarray, qd: np.ndarray, most: np.ndarray) -> None:
    """At rest at both ends; no change of speed or angle between two rows needs more than the largest acceleration.

    Accelerations may jump.
    """
    assert np.abs(qd[[0, -1]]).max() <= 1e-6 * np.abs(qd).max()
    h = np.diff(t)[:, None]
    assert (np.abs(np.diff(qd, axis=0)) <= most * h * (1.0 + 1e-6) + 1e-12).all()
    assert (np.abs(np.diff(q, axis=0) - h * (qd[1:] + qd[:-1]) / 2.0) <= most * h**2 / 4.0 * (1.0 + 1e-6) + 1e-12).all()


def check_passed(scenario: dict[str, Any], t: np.ndarray, tip: np.ndarray) -> None:
    """Both ends to 1e-6 m; every given point of a path to its accuracy by some row, in their order."""
    task = scenario["task"]
    if task["kind"] == "point-to-point":
        assert np.linalg.norm(tip[[0, -1]] - np.array([task["start"], task["goal"]]), axis=1).max() <= 1e-6
        return
    points = parse_scenario(scenario).problem().criteria.task.path.array
    assert np.linalg.norm(tip[[0, -1]] - points[[0, -1]], axis=1).max() <= 1e-6
    step, row = np.linalg.norm(np.diff(tip, axis=0), axis=1).max(), 0
    for point in points:
        near = np.flatnonzero(np.linalg.norm(tip[row:] - point, axis=1) <= task["accuracy"] + step)
        assert near.size
        row += int(near[0])


def check_smooth(t: np.ndarray, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> None:
    """At rest at both ends; qd and qdd are derivatives of q, and all three are continuous.

    Between two rows the acceleration of a smooth motion changes little: the trapezoidal rule integrates it to the
    change of speed, and both to the change of angle, up to what a jump of any of them would exceed by far.
    """
    scale_v, scale_a = np.abs(qd).max(), np.abs(qdd).max()
    assert np.abs(qd[[0, -1]]).max() <= 1e-6 * scale_v
    assert np.abs(qdd[[0, -1]]).max() <= 1e-6 * scale_a
    h = np.diff(t)[:, None]
    bends = np.abs(np.diff(qdd, axis=0))
    assert bends.max() <= 0.5 * scale_a
    assert (np.abs(np.diff(qd, axis=0) - h * (qdd[1:] + qdd[:-1]) / 2.0) <= 0.2 * h * bends.max()).all()
    taylor = h * (qd[1:] + qd[:-1]) / 2.0 - h**2 * np.diff(qdd, axis=0) / 12.0
    assert (np.abs(np.diff(q, axis=0) - taylor) <= 0.05 * h**2 * bends.max() + 1e-12).all()


def check_clear(obstacle: dict[str, Any], positions: np.ndarray) -> None:
    """No link meets the ellipse at any row: the distance of each link from the centre of the unit circle."""
    local = (positions - complex(*obstacle["center"])) * np.exp(-1j * obstacle["angle"])
    a, b = obstacle["semi_axes"]
    circle = local.real / a + 1j * local.imag / b
    share = np.linspace(0.0, 1.0, 201)[:, None, None]
    along = circle[:, :-1] + share * (circle[:, 1:] - circle[:, :-1])
    assert np.abs(along).min() > 1.0


def check_task(scenario: dict[str, Any], t: np.ndarray, tip: np.ndarray) -> None:
    """Both ends to 1e-6 m; along a path every given point to its accuracy, at equal shares of the time."""
    task = scenario["task"]
    if task["kind"] == "point-to-point":
        points, allowed = np.array([task["start"], task["goal"]]), 1e-6
    else:
        path = parse_scenario(scenario).problem().criteria.task.path
        points, allowed = path.array, task["accuracy"] * (1.0 + 1e-9)
        corners = tip_at(np.array(path.corners) / (len(points) - 1), t, tip)
        assert np.linalg.norm(corners - points[list(path.corners)], axis=1).max(initial=0.0) < 1e-3
    passed_points = tip_at(np.arange(len(points)) / (len(points) - 1), t, tip)
    assert np.linalg.norm(passed_points - points, axis=1).max() <= allowed
    assert np.linalg.norm(passed_points[[0, -1]] - points[[0, -1]], axis=1).max() <= 1e-6


def tip_at(share: np.ndarray, t: np.ndarray, tip: np.ndarray) -> np.ndarray:
    """The tip at shares of the time: those rows are in the file."""
    rows = np.array([np.argmin(np.abs(t - s * t[-1])) for s in share], dtype=int)
    assert np.abs(t[rows] - share * t[-1]).max(initial=0.0) <= 1e-9 * t[-1]
    return tip[rows]

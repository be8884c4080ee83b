"""Verdicts on all that a URDF holds, against Pinocchio and coal: none is false, and none clear is refused."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from helpers.random_urdf import RandomUrdf, random_urdf
from helpers.slow import slow_except

import tpbso_casadi as tp
from tpbso_casadi.scenario import ScenarioError

pin = pytest.importorskip("pinocchio")
SAMPLES, ROBOTS = 200, 200
CLEAR, LARGE_CLEAR = 0.006, 0.02  # m: balls stick out by 2 mm and a little, those of a cart or a wall by 1 % of it


class Truth:
    """Distances of a file's own shapes, by the tree that the file states."""

    def __init__(self, made: RandomUrdf, left_out: set[str]) -> None:
        self.made = made
        self.model = pin.buildModelFromXML(made.text)
        self.shapes = pin.buildGeomFromUrdfString(self.model, made.text, pin.GeometryType.COLLISION)
        links = [shape.name.rsplit("_", 1)[0] for shape in self.shapes.geometryObjects]
        self.pairs = [
            (links[a], links[b])
            for a, b in combinations(range(len(links)), 2)
            if left_out.isdisjoint((links[a], links[b])) and made.separates(links[a], links[b])
        ]
        for one, two in self.pairs:
            self.shapes.addCollisionPair(pin.CollisionPair(links.index(one), links.index(two)))
        self.data, self.geometry = self.model.createData(), self.shapes.createData()

    def distances(self, theta: np.ndarray) -> np.ndarray:
        """Of each pair at postures (n, dof) of the chain, (n, pairs), m."""
        found = []
        for row in theta:
            q = pin.neutral(self.model)
            chain = {name: float(value) for (name, *_), value in zip(self.made.joints, row, strict=True)}
            for name in self.model.names[1:]:
                q[self.model.joints[self.model.getJointId(name)].idx_q] = self.made.value(name, chain)
            pin.computeDistances(self.model, self.data, self.shapes, self.geometry, q)
            found.append([result.min_distance for result in self.geometry.distanceResults])
        return np.array(found).reshape(len(theta), len(self.pairs))


def rest_to_rest(start: np.ndarray, goal: np.ndarray, duration: float = 3.0) -> tuple[np.ndarray, ...]:
    """Times, positions, speeds and accelerations of a quintic, at 31 times."""
    s = np.linspace(0.0, 1.0, 31)[:, None]
    shape = 10 * s**3 - 15 * s**4 + 6 * s**5, 30 * s**2 - 60 * s**3 + 30 * s**4, 60 * s - 180 * s**2 + 120 * s**3
    rates = [part * (goal - start) / duration**order for order, part in enumerate(shape)]
    return duration * s[:, 0], start + rates[0], *rates[1:]


def judged(made: RandomUrdf, folder: Path, rows: tuple[np.ndarray, ...], ignored: list[str]) -> tp.Plan:
    (folder / "robot.urdf").write_text(made.text)
    (folder / "robot.toml").write_text(
        f'[robot]\nurdf = "robot.urdf"\nbase_link = "base"\ntip_link = "l{len(made.joints) - 1}"\n'
        f"max_speed = 5.0\nmax_acceleration = 50.0\nmax_jerk = 1e5\nignore_geometry = {ignored}\n"
    )
    return tp.certify(rows, folder / "robot.toml", without=["torque", "jerk"])


@pytest.mark.parametrize("seed", slow_except(range(ROBOTS), 2))
def test_a_verdict_on_own_links_is_that_of_the_whole_file(seed: int, tmp_path: Path) -> None:
    made = random_urdf(seed)
    rng = np.random.default_rng(1000 + seed)
    low, high = np.array([ends for _, *ends in made.joints]).T
    rows = rest_to_rest(*rng.uniform(low, high, (2, len(low))))
    rods = [link for link in ("rod0", "rod1") if made.followers]
    if rods:
        with pytest.raises(ScenarioError, match=r"link 'rod0': joint 'm0' moves it with 'j0', .* ignore_geometry"):
            judged(made, tmp_path, rows, [])
    plan = judged(made, tmp_path, rows, rods)
    row = next((row for row in plan.verdicts if row.name == "self clearance"), None)
    said = " / ".join(plan.not_judged)
    truth = Truth(made, set(rods))
    found = truth.distances(plan.trajectory(np.linspace(0.0, plan.duration, SAMPLES)))
    compared = [number for number, pair in enumerate(truth.pairs) if " and ".join(sorted(pair)) not in said]
    for number, (one, two) in enumerate(truth.pairs):
        if number not in compared:
            is_joined = len(made.separates(one, two)) == 1 and made.solid.isdisjoint(made.between(one, two))
            assert is_joined or found[:, number].max() < CLEAR, (one, two)
    nearest = found[:, compared].min() if compared else np.inf
    large = {"cart", "wall"} & {link for number in compared for link in truth.pairs[number]}
    if row is None:
        assert not compared
    elif nearest < 0.0:
        assert not row.satisfied
    elif nearest > (LARGE_CLEAR if large else CLEAR):
        assert row.satisfied, (row, nearest)

"""End postures of least displacement: against SciPy, against the closed form of two links."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from problems import PlanarArm
from problems.families.two_segments.starts import SKEWED, EndPostures
from problems.nlp.starts import LONGEST, SUM, Displacement
from problems.tasks import Elbow

START, GOAL = (1.0, 0.0), (0.5, 1.5)
SPEED, ACCELERATION = (4.0, 2.0, 6.0), (20.0, 30.0, 10.0)


def ends(displacement: Displacement, elbow: Elbow = "up", links: int = 3) -> EndPostures:
    arm = PlanarArm((2.0 / links,) * links, SPEED[:links], ACCELERATION[:links])
    return EndPostures(arm, START, GOAL, elbow, displacement, SKEWED)


def tip(arm: PlanarArm, theta: np.ndarray) -> np.ndarray:
    psi = np.cumsum(theta)
    return np.array(arm.link_lengths) @ np.column_stack([np.cos(psi), np.sin(psi)])


@pytest.mark.parametrize("displacement", [LONGEST, SUM], ids=["longest", "sum"])
@pytest.mark.parametrize("elbow", ["up", "free"])
def test_no_other_solver_finds_a_shorter_way(displacement: Displacement, elbow: Elbow) -> None:
    program = ends(displacement, elbow)
    [best] = program.best(np.random.default_rng(0), 12, 1)
    assert tip(program.robot, best.theta_s) == pytest.approx(START, abs=1e-6)
    assert tip(program.robot, best.theta_f) == pytest.approx(GOAL, abs=1e-6)
    assert best.value == pytest.approx(program.value(best.theta_f - best.theta_s))

    def smooth(z: np.ndarray) -> float:  # a p-norm close to the largest, or a rounded sum
        way = z[3:] - z[:3]
        if displacement.longest:
            each = np.maximum(
                SKEWED.peaks[0] * np.abs(way) / SPEED, np.sqrt(SKEWED.peaks[1] * (np.abs(way) + 1e-9) / ACCELERATION)
            )
            return float((each**40).sum() ** (1.0 / 40.0))
        return float(np.sqrt(way**2 + 1e-8).sum())

    def miss(z: np.ndarray) -> np.ndarray:
        return np.append(tip(program.robot, z[:3]), tip(program.robot, z[3:])) - [*START, *GOAL]

    on_points = {"type": "eq", "fun": miss}
    box = [(-9.0, 9.0), (0.0, np.pi) if elbow == "up" else (-9.0, 9.0), (-9.0, 9.0)] * 2
    theirs, rng = [], np.random.default_rng(1)
    for _ in range(12):
        start = program.draw(rng)
        z = np.concatenate([start.theta_s, start.theta_f])
        result = minimize(smooth, z, constraints=[on_points], bounds=box, method="SLSQP", options={"maxiter": 200})
        if result.success and np.abs(miss(result.x)).max() < 1e-6:
            theirs.append(program.value(result.x[3:] - result.x[:3]))
    assert theirs
    assert best.value <= min(theirs) * (1.0 + 1e-3)


def test_two_links_have_no_choice() -> None:
    """Elbow up at both ends: theta_2 from the law of cosines, theta_1 from the triangle."""
    solutions = ends(SUM, links=2).best(np.random.default_rng(0), 2, 2)
    theta = []
    for x, y in (START, GOAL):
        second = np.arccos((x * x + y * y) / 2.0 - 1.0)
        theta.append([np.arctan2(y, x) - second / 2.0, second])
    assert len(solutions) == 1
    assert solutions[0].value == pytest.approx(np.abs(np.subtract(*theta)).sum(), abs=1e-6)


def test_the_same_seed_gives_the_same_ends() -> None:
    first, again, other = (ends(LONGEST).draw(np.random.default_rng(seed)) for seed in (3, 3, 4))
    assert (first.theta_s == again.theta_s).all()
    assert (first.theta_f == again.theta_f).all()
    assert (first.theta_s != other.theta_s).any()


def test_joint_limits_hold_at_both_ends() -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), SPEED, ACCELERATION, ((-0.5, 1.2), (0.2, 2.8), (-2.0, 2.0)))
    low, high = np.array(arm.joint_limits).T
    for solution in EndPostures(arm, START, GOAL, "up", SUM, SKEWED).best(np.random.default_rng(0), 8, 8):
        for theta in (solution.theta_s, solution.theta_f):
            assert (theta >= low - 1e-6).all()
            assert (theta <= high + 1e-6).all()

"""Margins, widths, links that must not touch: the limits, and their proofs for all t."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.cases import moving
from helpers.slow import slow_except
from oracles.outlines import along, dense, nearest, skeletons, to_segment

from problems import CertificateStatus, Ellipse, InvalidProblem, Obstacle, PlanarArm, Polygon, Rectangle, Trajectory
from problems.base import as_array
from problems.certify import limit_verdicts, prove_clearance
from problems.evaluation import EvaluationOptions
from problems.limits import Clearance, Proximity, StepLimit, proximity_limits
from problems.limits.proximity import SelfClearance
from problems.motions import Samples
from problems.scene import crossing_clearance
from problems.tasks import Joints
from solvers import PSO, Budget, SearchBox, minimize

ARM = PlanarArm(
    (0.6, 0.5, 0.5, 0.3),
    (4.0,) * 4,
    (20.0,) * 4,
    link_radius=(0.05, 0.04, 0.03, 0.02),
    base_point=(0.1, -0.2),
    base_angle=0.3,
    tool_offset=(0.1, 0.05),
    margin=0.02,
    self_collision=True,
)
OBSTACLES: tuple[Obstacle, ...] = (
    Ellipse((0.9, 0.7), (0.25, 0.1), 0.5),
    Rectangle((-0.4, 1.0), (0.4, 0.1), 0.2),
    Polygon(((1.5, -0.5), (1.5, 0.4), (1.4, 0.4), (1.4, -0.4), (1.0, -0.4), (1.0, -0.5))),
)


def segments_clearance(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Of segments (n, 2 ends, 2)."""
    pairs = [(ca.DM(each[:, 0]), ca.DM(each[:, 1])) for each in (first, second)]
    return as_array(crossing_clearance(*pairs)).ravel()


def cross(first: np.ndarray, second: np.ndarray) -> bool:
    (a, b), (c, d) = first @ [1.0, 1j], second @ [1.0, 1j]
    one, two = ([((q - p) * np.conj(z - p)).imag for z in ends] for p, q, ends in ((a, b, (c, d)), (c, d, (a, b))))
    return one[0] * one[1] < 0.0 and two[0] * two[1] < 0.0


def test_segments_against_dense_points() -> None:
    first, second = np.random.default_rng(0).normal(size=(2, 300, 2, 2))
    for one, two, clearance in zip(first, second, segments_clearance(first, second), strict=True):
        if cross(one, two):
            assert clearance < 0.0
            ways = [to_segment(one, *two).min(), to_segment(two, *one).min()]
            assert -clearance <= min(ways) + 1e-12  # no farther than moving an end to the other
        else:
            expected = min(to_segment(one, *two).min(), to_segment(two, *one).min())
            assert clearance == pytest.approx(expected, abs=1e-12)


def test_segments_by_hand() -> None:
    base = [[0.0, 0.0], [1.0, 0.0]]
    for other, expected in (
        ([[2.0, 0.0], [3.0, 0.0]], 1.0),  # in line, as those of a stretched arm
        ([[1.0, 0.0], [2.0, 0.0]], 0.0),
        ([[0.0, 0.5], [1.0, 0.5]], 0.5),
        ([[0.5, -1.0], [0.5, 1.0]], -0.5),
        ([[0.9, -0.2], [0.9, 1.0]], -0.1),
        ([[0.5, 0.0], [0.5, 1.0]], 0.0),
        ([[2.0, 1.0], [2.0, 1.0]], np.sqrt(2.0)),
    ):
        assert segments_clearance(np.array([base]), np.array([other]))[0] == pytest.approx(expected, abs=1e-12)
    nearly = segments_clearance(np.array([base]), np.array([[[2.0, -1e-17], [3.0, 1e-17]]]))[0]
    assert nearly == pytest.approx(1.0)


def test_segments_change_by_no_more_than_their_points_move() -> None:
    rng = np.random.default_rng(1)
    first, second = rng.normal(size=(2, 3000, 2, 2))
    second[:1000] = first[:1000] + rng.normal(size=(1000, 1, 2))  # parallel ones among them
    step = rng.normal(size=(3000, 2, 2)) * rng.choice([1e-9, 1e-3, 0.3], (3000, 1, 1))
    change = np.abs(segments_clearance(first, second + step) - segments_clearance(first, second))
    assert (change <= np.hypot(step[..., 0], step[..., 1]).max(axis=1) + 1e-12).all()


def true_clearances(limit: Proximity, theta: np.ndarray) -> np.ndarray:
    """Of each pair by dense points, (n, pairs); where things meet, 0 less the radii."""
    columns = []
    for pair in limit.pairs:
        body = pair.body if isinstance(limit, Clearance) else pair.second
        frames = skeletons(ARM, theta)
        points = [along(one[body.start], one[body.end], 60) for one in frames]
        if isinstance(limit, Clearance):
            boundary = dense(pair.obstacle.outline(400), 2 if isinstance(pair.obstacle, Ellipse) else 100)
            columns.append([nearest(some, boundary) - body.radius for some in points])
        else:
            first = [(one[pair.first.start], one[pair.first.end]) for one in frames]
            distances = [to_segment(some, *ends).min() for some, ends in zip(points, first, strict=True)]
            columns.append(np.array(distances) - body.radius - pair.first.radius)
    return np.array(columns).T


def test_clearances_are_what_capsules_keep() -> None:
    theta = np.random.default_rng(2).uniform(-2.0, 2.0, (10, 4))
    samples = Samples(robot=ARM, derivatives=(ca.DM(theta),), duration=ca.DM(1.0))
    limits = proximity_limits(ARM, OBSTACLES)
    assert [limit.name for limit in limits] == ["clearance", "self clearance"]
    for limit in limits:
        [constraint] = limit.constraints_at(samples)
        assert constraint.bounds[0].tolist() == [0.02] * len(limit.pairs)
        assert limit.constraints_at(samples, 1e-3)[0].bounds[0] == pytest.approx(0.02 + 1e-3 * ARM.reach()[1])
        for row, expected in zip(as_array(constraint.expression), true_clearances(limit, theta), strict=True):
            for pair, value, true in zip(limit.pairs, row, expected, strict=True):
                radii = pair.body.radius if isinstance(limit, Clearance) else pair.first.radius + pair.second.radius
                if value + radii > 0.0:
                    assert value <= true + 1e-9
                    assert value + radii >= 0.85 * (true + radii) - 0.005


def test_what_stands_too_near_is_kept_in_mind_as_a_pair() -> None:
    beyond = Ellipse((ARM.base[0] + ARM.reach()[1] + 0.13, ARM.base[1]), (0.1, 0.1))
    assert Clearance.for_robot(ARM, [beyond]) is not None
    assert Clearance.for_robot(replace(ARM, margin=0.0, link_radius=None), [beyond]) is None
    step = StepLimit.for_robot(ARM, [beyond])
    assert step is not None
    assert step.width == pytest.approx(0.2 + 2.0 * (0.02 + 0.02))


def random_motion(seed: int) -> Trajectory:
    rng = np.random.default_rng(seed)
    start = rng.uniform(-0.9, 0.9, 4)
    start[0] += rng.choice([1.5, 3.5])  # where there is room
    pieces = [np.vstack([start, rng.normal(0.0, 0.1, (4, 4))])]
    for _ in range(2):
        powers = np.arange(5)
        start = pieces[-1].sum(axis=0)
        pieces.append(np.vstack([start, (powers[:, None] * pieces[-1]).sum(axis=0), rng.normal(0.0, 0.1, (3, 4))]))
    return Trajectory.from_pieces(np.array([0.4, 0.4, 0.4]), pieces)


@pytest.mark.parametrize("seed", slow_except(range(20), 3))
def test_proofs_against_very_many_samples(seed: int) -> None:
    trajectory = random_motion(seed)  # with jumps of the acceleration
    times = np.linspace(0.0, trajectory.duration, 5_000)
    for limit in proximity_limits(ARM, OBSTACLES):
        proof = prove_clearance(limit, trajectory)
        assert proof is not None
        [constraint] = limit.constraints_at(trajectory.samples(times, ARM))
        densest = float(as_array(constraint.expression).min())
        if proof.status is CertificateStatus.CERTIFIED:
            assert ARM.margin <= proof.proven <= densest + 1e-12
            assert proof.proven >= ARM.margin + 0.8 * (densest - ARM.margin) - 1e-9
        else:
            assert densest < ARM.margin + 1e-3
        if proof.status is CertificateStatus.VIOLATED:
            row = trajectory.at(np.array([proof.time]))
            assert true_clearances(limit, row).min() < ARM.margin + 1e-3


def test_near_an_oval_undecided_is_not_violated() -> None:
    oval = Ellipse((1.0, 0.0), (0.5, 0.05))
    arm = PlanarArm((0.3, 0.3), (1.0,) * 2, (1.0,) * 2, base_point=(1.0, 0.6), base_angle=-np.pi / 2.0)
    still = Trajectory(np.array([0.0, 1.0]), np.array([[[1.1, 0.4]]]))
    limit = Clearance.for_robot(arm, [oval])
    assert limit is not None
    [pair] = [pair for pair in limit.pairs if pair.body.name == "link 2"]
    true = pair.distance(arm.positions(ca.DM([[1.1, 0.4]])))
    for share, status in ((0.5, "certified"), (1.01, "violated")):
        keeping = replace(arm, margin=share * true)
        held = Clearance.for_robot(keeping, [oval])
        assert held is not None
        [verdict] = limit_verdicts([held], still)
        assert (verdict.status, verdict.bound) == (status, share * true)
    bound = float(oval.segment_distance(*(arm.positions(ca.DM([[1.1, 0.4]]))[i] for i in (1, 2))))
    if bound < true - 1e-9:
        held = Clearance.for_robot(replace(arm, margin=(bound + true) / 2.0), [oval])
        assert held is not None
        assert limit_verdicts([held], still)[0].status == "undecided"


@pytest.mark.slow
def test_a_search_keeps_margin_and_width() -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, link_radius=(0.04,) * 3, margin=0.05, self_collision=True)
    wall = Rectangle((0.7, 1.0), (0.2, 0.2), 0.3)
    problem = moving(arm, (1.2, 0.0), (0.2, 1.4), "length", "up", "reduced", obstacles=(wall,), samples=30)
    result = minimize(problem.evaluator(EvaluationOptions("vm")), SearchBox(*problem.bounds), PSO(), Budget(1500), 1)
    trajectory = problem.trajectory(result.x)
    verdicts = {verdict.name: verdict for verdict in problem.criteria.verify(trajectory)}
    assert verdicts["clearance"].satisfied
    assert verdicts["self clearance"].satisfied
    assert verdicts["clearance"].bound == verdicts["self clearance"].bound == 0.05
    frames = skeletons(arm, trajectory.at(np.linspace(0.0, trajectory.duration, 1000)))
    boundary = dense(wall.outline(), 100)
    least = min(to_segment(boundary, one[i], one[i + 1]).min() for one in frames for i in range(3))
    assert verdicts["clearance"].worst <= least - 0.04 + 1e-9
    assert 0.05 <= least - 0.04 <= 0.07  # kept, and no more than needed


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": (1.0, 0.85)}, "start: (1.0, 0.85) is 0.05 m from the obstacle at (0.85, 0.85); margin and link"),
        ({"goal": (0.85, 0.85)}, "goal: (0.85, 0.85) lies inside the obstacle at (0.85, 0.85)"),
        (
            {"obstacles": (Rectangle((0.0, 0.2), (0.2, 0.24)),)},
            "obstacles: the base is 0.08 m from the obstacle at (0.0, 0.2)",
        ),
        (
            {"obstacles": (Rectangle((0.0, 0.0), (0.2, 0.2)),)},
            "obstacles: the base lies inside the obstacle at (0.0, 0.0)",
        ),
    ],
)
def test_ends_and_base_that_are_too_near(changes: dict[str, object], message: str) -> None:
    arm = PlanarArm((0.7, 0.7, 0.6), (4.0,) * 3, (20.0,) * 3, link_radius=(0.04,) * 3, margin=0.05)
    stated = {"start": (1.2, 0.0), "goal": (0.2, 1.4), "obstacles": (Rectangle((0.85, 0.85), (0.2, 0.2)),)} | changes
    with pytest.raises(InvalidProblem) as caught:
        moving(arm, stated.pop("start"), stated.pop("goal"), **stated)
    assert str(caught.value).startswith(message)


def test_postures_that_are_too_near() -> None:
    with pytest.raises(InvalidProblem, match=r"^start: link 1, link 3: self clearance -0\.\d+ m, not 0.02 m"):
        Joints((0.0, 2.6, 2.6, 0.0)).check(ARM, (), "start")
    blocked = Rectangle(tuple(skeletons(ARM, np.zeros((1, 4)))[0, 2] + [0.0, 0.1]), (0.1, 0.1))
    named = (
        r"^goal: goal\[1\]: link \d, obstacle 1, Rectangle at \(1\.15\d+, 0\.22\d+\): clearance 0\.0\d+ m, not 0.02 m"
    )
    with pytest.raises(InvalidProblem, match=named):
        Joints((0.0,) * 4).check(ARM, (blocked,), "goal", "goal[1]: ")
    Joints((0.0,) * 4).check(ARM, (), "start")


def test_no_limit_where_nothing_is_asked_for() -> None:
    assert SelfClearance.for_robot(replace(ARM, self_collision=False), ()) is None
    two = PlanarArm((1.0, 1.0), (1.0, 1.0), (1.0, 1.0), self_collision=True)
    assert SelfClearance.for_robot(two, ()) is None

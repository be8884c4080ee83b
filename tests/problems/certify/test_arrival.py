"""What comes after arrival: against times by hand and dense sampling, and what a search makes of [task] stay."""

from __future__ import annotations

import math
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, ConstantVelocity, InvalidProblem, MoveProblem, MovingObstacle, Trajectory
from problems.base import FloatArray, as_array
from problems.certify import AtGoal, StaySettings, at_goal, stay_verdicts, verification
from problems.families.splines import move
from problems.limits import clearances, limits_of
from problems.robots import PlanarArm
from problems.scene import Ellipse, Obstacle, Rectangle, Tabulated
from problems.tasks import Joints, Move

ARM = PlanarArm((1.0, 1.0), (4.0,) * 2, (20.0,) * 2)
STRAIGHT = Trajectory(np.array([0.0, 2.0]), np.zeros((1, 1, 2)))  # along the x axis, from t = 0 to its arrival at 2 s
DISC = Ellipse((0.0, 0.0), (0.1, 0.1))


def moving(origin: tuple[float, float], velocity: tuple[float, float], rate: float = 0.0) -> MovingObstacle:
    return MovingObstacle(DISC, ConstantVelocity(velocity, origin), rate)


def after(*obstacles: Obstacle, robot: PlanarArm = ARM, trajectory: Trajectory = STRAIGHT) -> AtGoal | None:
    return at_goal(limits_of(robot, obstacles), obstacles, trajectory)


def found(*obstacles: Obstacle, robot: PlanarArm = ARM) -> AtGoal:
    result = after(*obstacles, robot=robot)
    assert result is not None
    return result


def test_nothing_moves() -> None:
    assert after() is None
    still = replace(DISC, center=(0.0, 1.0))
    assert after(still) is None
    assert stay_verdicts(limits_of(ARM, (still,)), STRAIGHT, 5.0) == []


HAND: dict[str, tuple[list[MovingObstacle], float, float, bool]] = {  # obstacles, margin; clear until, touched
    "comes down from 3 m at 0.5 m/s: (3 - 0.1) / 0.5": ([moving((1.0, 3.0), (0.0, -0.5))], 0.0, 5.8, True),
    "a margin is kept: 3 - 0.1 - 0.5 t = 0.2": ([moving((1.0, 3.0), (0.0, -0.5))], 0.2, 5.4, True),
    "it grows: 3 - 0.1 - 0.5 t = 0.2 + 0.1 t": ([moving((1.0, 3.0), (0.0, -0.5), 0.1)], 0.2, 4.5, True),
    "has passed and never comes back": ([moving((1.0, -0.3), (0.0, -0.5))], 0.0, math.inf, False),
    "flies past beside the arm": ([moving((-5.0, 0.2), (1.0, 0.0))], 0.0, math.inf, False),
    "creeps and is followed for a minute": ([moving((1.0, 0.5), (0.0, 1e-3))], 0.0, 2.0 + StaySettings.longest, False),
    "may be anywhere: (0.5 - 0.1) / 0.01": ([moving((1.0, 0.5), (0.0, 0.0), 0.01)], 0.0, 40.0, True),
    "at 80 s, which is not looked at": ([moving((1.0, 0.9), (0.0, 0.0), 0.01)], 0.0, 2.0 + StaySettings.longest, False),
    "touches already": ([moving((1.0, 0.0), (0.0, 0.0))], 0.0, 2.0, True),
    "the first counts": ([moving((1.0, 3.0), (0.0, -0.2)), moving((1.5, -3.0), (0.0, 1.0))], 0.0, 2.9, True),
}


@pytest.mark.parametrize(("obstacles", "margin", "until", "touched"), HAND.values(), ids=HAND)
def test_by_hand(obstacles: list[MovingObstacle], margin: float, until: float, touched: bool) -> None:
    result = found(*obstacles, robot=replace(ARM, margin=margin))
    assert result.touched is touched
    assert result.clear_until == pytest.approx(until, abs=2e-3)
    assert result.clear_until <= until or until == math.inf or margin


def test_a_table_ends_and_what_it_moves_stands() -> None:
    rows = np.array([[1.0, 3.0], [1.0, 2.0], [1.0, 1.0]])
    assert found(MovingObstacle(DISC, Tabulated.through([0.0, 1.0, 5.0], rows))) == AtGoal(math.inf, touched=False)
    ended = Tabulated.through([0.0, 0.5, 1.0], rows)
    assert found(MovingObstacle(DISC, ended)) == AtGoal(math.inf, touched=False)
    down = Tabulated.through([0.0, 1.0, 5.0], np.array([[1.0, 3.0], [1.0, 2.4], [1.0, 0.0]]))
    result = found(MovingObstacle(DISC, down))
    assert down.placed(np.zeros((1, 2)), result.clear_until)[0, 1] == pytest.approx(0.1, abs=2e-3)


def test_a_goal_that_is_passed() -> None:
    start, goal = Joints((0.0, 0.5)), Joints((0.5, 0.5))
    obstacle = moving((5.0, 5.0), (0.0, -1.0))
    passing = move(Move(ARM, start, (goal,), obstacles=(obstacle,), goal_velocity=(1.0, 0.0)))
    trajectory = passing.trajectory(np.mean(passing.bounds, axis=0))
    assert passing.criteria.at_goal(trajectory) is None


numbers = st.floats(-3.0, 3.0)


@settings(max_examples=15, deadline=None)
@given(numbers, numbers, numbers, numbers, st.floats(0.0, 0.3), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_against_dense_samples(
    x: float, y: float, u: float, v: float, rate: float, first: float, second: float
) -> None:
    """What is said to be clear is, at 2,000 times; what is said to touch does so a moment later."""
    box = MovingObstacle(Rectangle((0.0, 0.0), (0.3, 0.2), 0.4), ConstantVelocity((u, v), (x, y)), rate)
    posture = np.array([[[first, second]]])
    result = after(box, trajectory=Trajectory(np.array([0.0, 1.0]), posture))
    assert result is not None
    [limit] = (limit for limit in limits_of(ARM, (box,)) if limit.time_dependent_part is not None)
    last = min(result.clear_until, 1.0 + StaySettings.longest)

    def nearest(times: np.ndarray) -> np.ndarray:
        positions = ARM.positions(ca.DM(np.repeat(posture[0], times.size, axis=0)))
        return as_array(clearances(limit.pairs, positions, ca.DM(times))).min(axis=1)  # type: ignore[attr-defined]

    if last > 1.0:
        assert (nearest(np.linspace(1.0, last, 2_000, endpoint=False)) >= 0.0).all()
    if result.touched:
        speed = float(np.hypot(u, v)) + rate
        assert nearest(np.array([result.clear_until]))[0] <= 3e-3 * speed + 1e-9


# [task] stay


def crossing(stay: float, **more: object) -> Move:
    """Two postures reach the goal; a disc flies through one of them at 1.8 s, through the other at 2.6 s."""
    return Move(
        robot=ARM,
        start=Joints((0.0, 0.6)),
        goals=(Joints((0.3, 1.2)), Joints((1.5, -1.2))),
        obstacles=(moving((0.75, -2.0), (0.0, 1.2)),),
        stay=stay,
        **more,  # type: ignore[arg-type]
    )


def test_a_stay_is_a_number_of_the_statement() -> None:
    with pytest.raises(InvalidProblem, match=r"stay: .*within 0 and 1e\+09 s"):
        crossing(-1.0)
    with pytest.raises(InvalidProblem, match="stay: the robot does not stop at its goal"):
        crossing(1.0, goal_velocity=(1.0, 0.0))


def test_the_verdict_is_about_the_posture_at_the_end() -> None:
    """The disc touches at 5.8 s: 3.8 s after arrival."""
    limits = limits_of(ARM, (moving((1.0, 3.0), (0.0, -0.5)),))
    assert stay_verdicts(limits, STRAIGHT, 0.0) == []
    [kept], [broken] = (stay_verdicts(limits, STRAIGHT, seconds) for seconds in (3.0, 3.9))
    assert kept.name == broken.name == "clearance at the goal"
    assert kept.status is CertificateStatus.CERTIFIED
    assert 0.3 <= kept.worst <= 0.4  # the distance at 5 s, less what a proof gives away
    assert broken.status is CertificateStatus.VIOLATED
    assert broken.worst < 0.0


@pytest.fixture(scope="module")
def problems() -> tuple[MoveProblem, MoveProblem]:
    """Without and with a stay."""
    return move(crossing(0.0), samples=20), move(crossing(1.4), samples=20)


def test_a_stay_costs_where_the_goal_is_reached_later(problems: tuple[MoveProblem, MoveProblem]) -> None:
    """The compiled cost against the constraints written out: infeasible exactly where the posture at the goal is."""
    rng = np.random.default_rng(3)
    without, staying = problems
    lower, upper = staying.bounds
    of_path = [variable.name.startswith(("bend", "offset")) for variable in staying.variables]
    x = rng.uniform(lower, upper, (24, lower.size)) * np.where(of_path, 0.3, 1.0)
    feasible, kept = without.cost(x) <= without.objective_upper_bound, staying.cost(x) <= staying.objective_upper_bound
    assert not (kept & ~feasible).any()
    decided = 0
    for row, cost in zip(x[feasible], staying.cost(x[feasible]), strict=True):
        trajectory = staying.trajectory(row)
        [verdict] = stay_verdicts(staying.criteria.limits, trajectory, 1.4)
        if abs(verdict.worst) > 0.02:  # else the margin of samples decides
            decided += 1
            assert (cost <= staying.objective_upper_bound) == verdict.satisfied
    assert decided > 5
    assert 0 < kept.sum() < feasible.sum()


def test_what_comes_after_a_doubtful_moment_is_not_promised(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lower bounds of distances may dip for a moment, and not be seen there again once cells are smaller."""
    looked: list[float] = []

    def seen(limit: object, theta: object, cells: FloatArray) -> tuple[FloatArray, FloatArray]:
        middles = cells.mean(axis=1)
        first, later = not looked, middles > 40.0  # from 40 s on something is there
        looked.extend(middles)
        near = np.where(later, -1.0, 1.0)
        near[len(near) // 4] = -1.0 if first else near[len(near) // 4]
        return near, near.copy()

    monkeypatch.setattr(verification, "_clearances", seen)
    assert found(moving((1.0, 300.0), (0.0, -0.5))).clear_until <= 40.0


def test_the_least_velocity_is_one() -> None:
    """Its square is zero."""
    assert ConstantVelocity((0.0, 1e-170), (3.0, 0.0)).quiet_after(2.0) == 0.0
    assert ConstantVelocity((1e-170, 0.0), (-1.0, 0.0)).quiet_after(2.0) == pytest.approx(3e170)

"""Spheres that hold a robot's bodies: covering shapes, read from files, and which of them have to keep apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.urdf import ARM
from hypothesis import given, settings
from hypothesis import strategies as st

from problems import CertificateStatus, InvalidProblem, Joints, Move, Trajectory
from problems.assembly import Criteria
from problems.limits import SelfClearance, limits_of
from problems.objectives import OBJECTIVES
from problems.robots import (
    ChainJoint,
    FixedFrame,
    OwnContacts,
    SpatialArm,
    Sphere,
    built_in,
    read_spheres,
    read_urdf,
)
from problems.robots import own_pairs as own_pairs_module
from problems.robots.chain import Chain
from problems.robots.own_pairs import own_pairs_of
from problems.robots.spheres import MOST_BALLS, Ball, cover_box, cover_cylinder, covered_capsule

SIZES = st.floats(0.001, 2.0)
POINTS = 2_000


def depth(balls: tuple[Ball, ...], points: np.ndarray) -> float:
    """How far the point that is held worst is from the nearest ball's surface, m; positive outside of all."""
    centers, radii = np.array([ball.center for ball in balls]), np.array([ball.radius for ball in balls])
    gaps = np.linalg.norm(points[:, None] - centers, axis=2) - radii
    return float(gaps.min(axis=1).max())


def directions(count: int) -> np.ndarray:
    vectors = np.random.default_rng(0).normal(size=(count, 3))
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])


@settings(deadline=None, max_examples=25)
@given(sizes=st.tuples(SIZES, SIZES, SIZES))
def test_boxes(sizes: tuple[float, float, float]) -> None:
    points = np.random.default_rng(0).uniform(-0.5, 0.5, (POINTS, 3))
    points[: POINTS // 2] = np.sign(points[: POINTS // 2]) * 0.5  # the corners too
    balls = cover_box(sizes)
    assert depth(balls, points * sizes) <= 1e-12
    assert len(balls) <= MOST_BALLS


@settings(deadline=None, max_examples=25)
@given(radius=SIZES, length=SIZES)
def test_cylinders(radius: float, length: float) -> None:
    rng = np.random.default_rng(0)
    turn, height = rng.uniform(0.0, 2.0 * np.pi, POINTS), rng.choice([-0.5, 0.5, 0.1], POINTS)
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height * length])
    assert depth(cover_cylinder(radius, length), points) <= 1e-12


@settings(deadline=None, max_examples=25)
@given(radius=SIZES, end=st.tuples(SIZES, SIZES, SIZES))
def test_capsules(radius: float, end: tuple[float, float, float]) -> None:
    along = np.random.default_rng(1).uniform(0.0, 1.0, (POINTS, 1))
    points = along * np.array(end) + radius * directions(POINTS)
    assert depth(covered_capsule((0.0, 0.0, 0.0), end, radius), points) <= 1e-12


def test_usual_shapes_are_held_tightly() -> None:
    assert all(ball.radius < 1.11 * 0.05 for ball in cover_cylinder(0.05, 0.4))
    assert all(ball.radius < 1.11 * 0.05 for ball in covered_capsule((0.0, 0.0, 0.0), (0.4, 0.0, 0.0), 0.05))
    assert len(covered_capsule((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.05)) == 1
    box = cover_box((0.1, 0.1, 0.2))
    reach = max(np.abs(np.array(ball.center)[2]) + ball.radius for ball in box)
    assert reach - 0.1 == pytest.approx(0.015, abs=0.01)


LINKS = read_urdf(ARM, tip_link="tool0").links
SPHERE = '[[spheres]]\nlink = "mast"\ncenter = [0.1, 0, 0.2]\nradius = 0.05\n'


def test_spheres_are_moved_to_the_bodies_that_carry_their_links() -> None:
    text = "".join(SPHERE.replace("mast", link) for link in ("world", "base", "mast", "bolted", "tool0"))
    world, base, mast, bolted, tool = read_spheres(text, LINKS)
    assert [sphere.link for sphere in (world, base, mast, bolted, tool)] == [0, 0, 1, 1, 2]
    assert world.center == (0.1, 0.0, 0.2)
    assert base.center == (0.1, 0.0, 1.2)  # the stand is 1 m high
    assert bolted.center == (0.4, 0.0, 0.2)
    assert tool.center == pytest.approx((0.1, 0.0, 0.0))  # upside down, 0.2 m from the jib
    assert (tool.radius, tool.name) == (0.05, "tool0")


def test_capsules_are_held_by_spheres() -> None:
    text = '[[capsules]]\nlink = "mast"\nstart = [0, 0, 0]\nend = [0, 0, 0.3]\nradius = 0.05\n'
    spheres = read_spheres(SPHERE + text, LINKS)
    assert spheres[0].center == (0.1, 0.0, 0.2)
    assert spheres[1].center == (0.0, 0.0, 0.0)
    assert spheres[-1].center == pytest.approx((0.0, 0.0, 0.3))
    assert all(0.05 <= sphere.radius < 0.0556 for sphere in spheres[1:])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("spheres = [", "not TOML: "),
        ("", r"neither \[\[spheres\]\] nor \[\[capsules\]\]"),
        ("spheres = 3", r"\[\[spheres\]\] is a list of tables"),
        ("spheres = [3]", "sphere 1: needs center, link, radius and nothing else"),
        ("[[balls]]\nradius = 1", "unknown key 'balls'; there are spheres, capsules"),
        (SPHERE + "colour = 1", "sphere 1: needs center, link, radius and nothing else"),
        (SPHERE.replace("mast", "sail"), "sphere 1: no link 'sail' in the chain; there are world, base, mast"),
        (SPHERE.replace('"mast"', "7"), "sphere 1: no link 7 in the chain"),
        (SPHERE.replace("0.05", "0"), "sphere 1: radius: 0 m is not above 0"),
        (SPHERE.replace("0.05", "nan"), "sphere 1: radius: nan is not within 10000 m"),
        (SPHERE.replace("0.05", "1" + "0" * 400), "a number of more than 300 digits is not within 10000 m"),
        (SPHERE.replace("0.05", "1" * 5000), "a whole number of thousands of digits"),
        (SPHERE.replace("[0.1, 0, 0.2]", "[0.1, 0]"), "sphere 1: center: three coordinates are needed"),
        (SPHERE.replace("[0.1, 0, 0.2]", '[0.1, 0, "up"]'), "sphere 1: center: a number is needed, not 'up'"),
        (SPHERE * 1_001, "more than 1000"),
        ("#" * 1_000_001, "1000001 characters, of at most 1000000"),
        ("a." * 60 + "b = 1", "a key of more than 50 parts"),
    ],
)
def test_what_is_wrong_is_named(text: str, message: str) -> None:
    with pytest.raises(InvalidProblem, match="^spheres: .*" + message):
        read_spheres(text, LINKS)


def arm(*spheres: Sphere, bend: float = 3.0) -> SpatialArm:
    """Three links of 1 m in a plane, whose joints bend by so much."""
    poses = (FixedFrame(), *[FixedFrame(translation=(1.0, 0.0, 0.0))] * 2)
    joints = tuple(ChainJoint(name=f"j{i}", link=f"l{i}", pose=pose) for i, pose in enumerate(poses))
    return SpatialArm(
        chain=Chain(name="arm", joints=joints),
        max_speed=(1.0,) * 3,
        max_acceleration=(1.0,) * 3,
        position_limits=((-bend, bend),) * 3,
        spheres=spheres,
    )


def ball(link: int, x: float, radius: float = 0.1) -> Sphere:
    return Sphere(link, (x, 0.0, 0.0), radius, f"l{link}")


JOINED = frozenset(frozenset((f"l{i}", f"l{i + 1}")) for i in range(3))


BRACKET = replace(ball(2, 0.5), name="bracket")
PAIRS: dict[str, tuple[SpatialArm, frozenset[frozenset[str]], tuple[tuple[int, int], ...]]] = {  # kept pairs
    "what can touch has to keep apart": (arm(ball(0, 0.5), ball(1, 0.5), ball(3, 0.9)), JOINED, ((0, 2), (1, 2))),
    "what a joint connects may touch": (arm(ball(1, 0.5), BRACKET), frozenset({frozenset(("l1", "bracket"))}), ()),
    "but not what is fixed to it": (arm(ball(1, 0.5), BRACKET), JOINED, ((0, 1),)),
    "what never touches needs no watching": (arm(ball(1, 0.5), ball(3, 0.9), bend=0.5), frozenset(), ()),
    "what always touches is one thing": (arm(ball(0, 0.0, 1.2), ball(2, 0.0, 0.3)), frozenset(), ()),
    "at least 1.75 m apart": (arm(ball(1, 0.0), ball(3, 0.0), bend=1.0), frozenset(), ()),
    "of which a margin is more": (
        replace(arm(ball(1, 0.0), ball(3, 0.0), bend=1.0), margin=1.7),
        frozenset(),
        ((0, 1),),
    ),
}


@pytest.mark.parametrize(("robot", "connected", "kept"), PAIRS.values(), ids=PAIRS)
def test_pairs_that_have_to_keep_apart(
    robot: SpatialArm, connected: frozenset[frozenset[str]], kept: tuple[tuple[int, int], ...]
) -> None:
    assert own_pairs_of(robot, connected=connected).kept == kept


def test_links_are_named_to_override() -> None:
    robot = arm(ball(0, 0.5), ball(1, 0.5), ball(3, 0.9))
    assert own_pairs_of(robot, disabled=[("l3", "l0")], connected=JOINED).kept == ((1, 2),)
    assert own_pairs_of(robot, kept=[("l0", "l1")], connected=JOINED).kept == ((0, 1), (0, 2), (1, 2))
    stiff = arm(ball(1, 0.5), ball(3, 0.9), bend=0.5)
    assert own_pairs_of(stiff, kept=[("l1", "l3")]).kept == ((0, 1),)
    assert own_pairs_of(robot, disabled=[("l0", "l3"), ("l1", "l3")], connected=JOINED).kept == ()


def test_what_cannot_be_overridden_is_refused() -> None:
    robot = arm(ball(0, 0.5), ball(1, 0.5), replace(ball(1, 0.9), name="bracket"), ball(3, 0.9))
    with pytest.raises(InvalidProblem, match="kept_pairs: 'l1' and 'bracket' are one body: no joint is between them"):
        own_pairs_of(robot, kept=[("l0", "l3"), ("l1", "bracket")])
    with pytest.raises(InvalidProblem, match="disabled_pairs: no spheres on link 'l7'; there are bracket, l0, l1, l3"):
        own_pairs_of(robot, disabled=[("l0", "l7")])


def test_links_that_are_known_to_be_near_may_touch_if_they_have_spheres() -> None:
    near = (("panda_link5", "panda_link7"), ("panda_link5", "panda_hand"))
    description = replace(built_in("panda"), disabled=near)
    spheres = [sphere for sphere in description.spheres if sphere.name != "panda_hand"]
    robot = description.arm(spheres=spheres)
    links = {
        frozenset((spheres[one].name, spheres[two].name)) for one, two in OwnContacts(description, robot).spheres.kept
    }
    assert frozenset(("panda_link5", "panda_link7")) not in links
    assert frozenset(("panda_link2", "panda_link7")) in links


def test_what_random_postures_never_bring_together_is_judged_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """Small spheres that a random posture hardly ever brings together: a search leaves them out, a verdict does not."""
    monkeypatch.setattr(own_pairs_module, "SETTINGS", replace(own_pairs_module.SETTINGS, samples=3))
    closed = 2.0 * np.pi / 3.0  # where the end of the last link is back at the base
    start, goal = (0.0, closed - 0.1, closed + 0.1), (0.0, closed + 0.1, closed - 0.1)
    robot = arm(ball(1, 0.0, 0.005), ball(3, 1.0, 0.005))
    pairs = own_pairs_of(robot)
    assert (pairs.kept, pairs.far) == ((), ((0, 1),))
    robot = replace(robot, proven_pairs=pairs.far, self_collision=True)
    ends = Joints(start), (Joints(goal),)
    middle = Trajectory(np.array([0.0, 1.0]), np.array([[np.subtract(goal, start)], [start]]))
    criteria = Criteria(task=Move(robot, *ends), objective=OBJECTIVES["time"], limits=limits_of(robot, ()))
    assert not any(isinstance(limit, SelfClearance) for limit in criteria.limits)
    (own,) = [row for row in criteria.verify(middle) if row.name == "self clearance"]
    assert own.status is CertificateStatus.VIOLATED
    assert own.worst == pytest.approx(-0.01, abs=1e-6)
    aside = Trajectory(middle.breakpoints, middle.coefficients + np.array([[[0.0] * 3], [[0.0, 0.2, 0.0]]]))
    (own,) = [row for row in criteria.verify(aside) if row.name == "self clearance"]
    turns = np.cumsum(aside.at(np.linspace(0.0, 1.0, 20_001)), axis=1)
    least = float(np.hypot(np.cos(turns).sum(axis=1), np.sin(turns).sum(axis=1)).min()) - 0.01
    assert own.status is CertificateStatus.CERTIFIED
    assert 0.8 * least < own.worst <= least

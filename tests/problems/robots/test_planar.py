"""Planar arms: kinematics there and back, reach, levers and own pairs, against complex exponentials."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles.outlines import along, skeletons

from problems import InvalidProblem, PlanarArm
from problems.base import Arguments, as_array
from problems.robots import wrap_to
from problems.robots.planar_links import angular_range, restore
from problems.tasks.place import half_turn


def arm_of(link_lengths: list[float], **more: object) -> PlanarArm:
    k = len(link_lengths)
    return PlanarArm(tuple(link_lengths), (1.0,) * k, (1.0,) * k, **more)


def tip_of(link_lengths: list[float], theta: np.ndarray) -> complex:
    return complex(np.sum(np.array(link_lengths) * np.exp(1j * np.cumsum(theta))))


def as_point(z: complex) -> ca.DM:
    return ca.DM([z.real, z.imag])


def test_normalised_redundancy_covers_both_intervals_around_a_hole() -> None:
    arm, target = arm_of([1.4, 0.5, 0.8]), 1.3
    scan = np.linspace(-np.pi, np.pi, 4001)
    reached = np.abs(target - 0.8 * np.exp(1j * scan))
    allowed = (reached >= 0.9) & (reached <= 1.9)
    _, beta_in, beta_out = (float(v) for v in angular_range(arm.link_lengths, 3, as_point(target)))
    assert beta_in > 0.0
    assert (allowed == ((np.abs(scan) >= beta_in) & (np.abs(scan) <= beta_out))).all()
    values = {x: float(restore(arm.link_lengths, as_point(target), ca.DM([x]))) for x in (0.0, 0.5 - 1e-12, 0.5, 1.0)}
    assert list(values.values()) == pytest.approx([-beta_out, -beta_in, beta_in, beta_out], abs=1e-9)


@pytest.mark.parametrize(
    ("links", "point"),
    [([1.0, 1.0], 2.0), ([1.0, 1.0], 0.0), ([1.0, 1.0, 1.0], 3.0), ([1.0, 1.0, 1.0], 0.0), ([2.0, 0.5, 0.5], 1.0)],
    ids=["time_scaled", "folded", "time_scaled 3", "on the base", "edge of the hole"],
)
def test_edges_of_the_reach_are_no_nan(links: list[float], point: float) -> None:
    arm = arm_of(links)
    for x in np.linspace(0.0, 1.0, 7):
        phi = arm.closed_form.restore_redundancy(as_point(point), ca.DM([x] * (arm.links - 2)))
        theta, _ = arm.closed_form.inverse(as_point(point), phi, -1.0)
        assert np.isfinite(np.asarray(theta)).all()
        assert abs(tip_of(links, np.asarray(theta).ravel()) - point) < 1e-6


@given(st.floats(-30.0, 30.0), st.floats(-30.0, 30.0))
def test_nearest_turn(given_angle: float, reference: float) -> None:
    angle = float(wrap_to(ca.DM(given_angle), ca.DM(reference)))
    assert abs(angle - reference) <= np.pi + 1e-9
    assert np.exp(1j * angle) == pytest.approx(np.exp(1j * given_angle), abs=1e-9)


def test_joint_limits_decide_the_turn() -> None:
    free, limited = arm_of([1.0, 1.0]), arm_of([1.0, 1.0], joint_limits=((0.0, 2.0 * np.pi), (-4.0, 1.0)))
    theta = ca.DM([-0.5, 3.0]).T
    assert np.asarray(free.closed_form.wrap(theta)).ravel() == pytest.approx([-0.5, 3.0])
    assert np.asarray(limited.closed_form.wrap(theta)).ravel() == pytest.approx([2.0 * np.pi - 0.5, 3.0 - 2.0 * np.pi])
    near = limited.closed_form.wrap_near(ca.DM([-0.1, 2.9]).T, ca.DM([0.1, 0.5]).T)
    assert np.asarray(near).ravel() == pytest.approx([2.0 * np.pi - 0.1, 2.9 - 2.0 * np.pi])


def posed_arm(seed: int, links: int | None = None, **more: object) -> PlanarArm:
    """Every fourth one stands at the origin and has no tool."""
    rng = np.random.default_rng(seed)
    k = int(rng.integers(2, 6)) if links is None else links
    lengths = tuple(rng.uniform(0.3, 1.0, k).tolist())
    pose = {
        "base_point": tuple(rng.uniform(-2.0, 2.0, 2).tolist()),
        "base_angle": float(rng.uniform(-3.0, 3.0)),
        "tool_offset": tuple(rng.uniform(-0.2, 0.4, 2).tolist()),
    }
    return PlanarArm(lengths, (4.0,) * k, (20.0,) * k, **((pose if seed % 4 else {}) | more))


def postures(arm: PlanarArm, count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, arm.dof))


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_there_and_back(seed: int) -> None:
    arm = posed_arm(seed)
    for theta in postures(arm, 3, seed):
        frames = arm.skeleton(theta[None])[0]
        np.testing.assert_allclose(frames, skeletons(arm, theta[None])[0][: len(frames)], atol=1e-12)
        assert (np.vstack([as_array(place) for place in arm.positions(ca.DM(theta).T)]) == frames).all()
        point = ca.DM(frames[-1])
        assert as_array(arm.tool.position(ca.DM(theta).T)).ravel().tolist() == frames[-1].tolist()
        phi = arm.closed_form.redundant_values(theta[None])[0]
        assert np.exp(1j * phi) == pytest.approx(np.exp(1j * (arm.base_angle + np.cumsum(theta)[2:])))
        elbow = 1.0 if np.sin(theta[1] - arm.closed_form.stretched) >= 0.0 else -1.0
        found, cosine = arm.closed_form.inverse(point, ca.DM(phi), elbow)
        assert np.exp(1j * as_array(found).ravel()) == pytest.approx(np.exp(1j * theta), abs=1e-5)
        assert abs(float(cosine)) <= 1.0
        assert any(arm.tool_offset) or float(cosine) == pytest.approx(np.cos(theta[1]), abs=1e-6)
        interval = half_turn("up" if elbow > 0 else "down", theta[1], (-10.0, 10.0), arm.closed_form.stretched)
        assert interval is not None
        assert interval[0] - 1e-9 <= theta[1] <= interval[1] + 1e-9


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(0.0, 1.0), st.floats(-np.pi, np.pi))
def test_normalised_redundancy_reaches_all_within_reach(seed: int, far: float, direction: float) -> None:
    arm = posed_arm(seed)
    inner, outer = arm.reach()
    point = np.array(arm.base) + (inner + far * (outer - inner)) * np.array([np.cos(direction), np.sin(direction)])
    shares = np.random.default_rng(seed).random(arm.closed_form.redundancy)
    phi = arm.closed_form.restore_redundancy(ca.DM(point), ca.DM(shares))
    theta, _ = arm.closed_form.inverse(ca.DM(point), phi, -1.0)
    assert skeletons(arm, as_array(theta))[0, -1] == pytest.approx(point, abs=1e-6)
    if arm.closed_form.redundancy:
        lower, upper = arm.closed_form.redundancy_ranges(as_array(theta), point[None])
        values = arm.closed_form.redundant_values(as_array(theta))
        assert ((lower - 1e-6 <= values) & (values <= upper + 1e-6)).all()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_snapping_to_a_point_nearby(seed: int) -> None:
    arm = posed_arm(seed)
    theta = postures(arm, 1, seed)
    theta[0, 1] = arm.closed_form.stretched + 0.8
    point = skeletons(arm, theta)[0, -1] + 1e-5
    moved = as_array(arm.closed_form.project_to_point(ca.DM(theta), ca.DM(point)))
    assert skeletons(arm, moved)[0, -1] == pytest.approx(point, abs=1e-12)
    assert np.abs(moved - theta).max() < 1e-2


@pytest.mark.parametrize("seed", range(4))
def test_reach_levers_and_relative_levers_bound_how_bodies_move(seed: int) -> None:
    arm = posed_arm(seed, links=4, self_collision=True)
    theta, h = postures(arm, 400, seed), 1e-6
    rates = np.random.default_rng(seed).normal(size=theta.shape)
    now, later = skeletons(arm, theta), skeletons(arm, theta + h * rates)
    assert np.hypot(*(now[:, -1] - arm.base).T).max() <= arm.reach()[1] + 1e-9
    assert np.hypot(*(now[:, -1] - arm.base).T).min() >= arm.reach()[0] - 1e-9
    for number, body in enumerate(arm.bodies.each):
        moved = np.array([along(b - a, d - c, 9) for a, b, c, d in zip(*_ends(now, later, body), strict=True)])
        speed = np.hypot(moved[..., 0], moved[..., 1]).max(axis=1) / h
        allowed = np.abs(rates @ arm.bodies.turns.T) @ arm.bodies.levers[number]
        assert (speed <= allowed * (1.0 + 1e-4) + 1e-6).all()
    for first, second in arm.bodies.pairs:
        turns, levers = arm.bodies.motion(second, seen_from=first)
        seen = [_seen_from(frames, first.start, first.end) for frames in (now, later)]
        moved = np.array([along(b - a, d - c, 9) for a, b, c, d in zip(*_ends(*seen, second), strict=True)])
        speed = np.hypot(moved[..., 0], moved[..., 1]).max(axis=1) / h
        allowed = np.abs(rates @ turns.T) @ levers
        assert (speed <= allowed * (1.0 + 1e-4) + 1e-6).all()
        assert (speed > 0.3 * allowed).any()  # and not far above


def _ends(now: np.ndarray, later: np.ndarray, body: object) -> tuple[np.ndarray, ...]:
    return now[:, body.start], later[:, body.start], now[:, body.end], later[:, body.end]


def _seen_from(frames: np.ndarray, start: int, end: int) -> np.ndarray:
    """Frames in a system of axes that is fixed to a link."""
    z = frames @ [1.0, 1j]
    way = z[:, end] - z[:, start]
    local = (z - z[:, [end]]) * np.conj(way / np.abs(way))[:, None]
    return np.stack([local.real, local.imag], axis=2)


def test_which_bodies_are_pairs() -> None:
    lengths = {"link_lengths": (0.5,) * 4, "max_speed": (1.0,) * 4, "max_acceleration": (1.0,) * 4}
    named = [f"{a.name}-{b.name}" for a, b in PlanarArm(**lengths).bodies.pairs]
    assert named == ["link 1-link 3", "link 1-link 4", "link 2-link 4"]
    with_tool = PlanarArm(**lengths, tool_offset=(0.0, 0.1), link_radius=(0.1, 0.1, 0.1, 0.03))
    assert [f"{a.name}-{b.name}" for a, b in with_tool.bodies.pairs] == [
        *(*named[:2], "link 1-tool"),
        *(named[2], "link 2-tool"),
        "link 3-tool",
    ]
    assert with_tool.bodies.each[-1].radius == 0.03
    assert len(with_tool.positions(ca.DM.zeros(1, 4))) == 6


def test_zero_is_structure() -> None:
    plain, stated = (
        PlanarArm((0.5,) * 3, (1.0,) * 3, (1.0,) * 3, **more)
        for more in ({}, {"base_point": (0.0, 0.0), "base_angle": -0.0, "link_radius": (0.0,) * 3, "margin": 0.0})
    )
    for arm in (plain, stated):
        arguments = Arguments()
        symbolic_copy = arguments.symbolic_copy(arm)
        assert arguments.values.size == 9
        assert not any(isinstance(body.radius, ca.SX) for body in symbolic_copy.bodies.each)
    arguments = Arguments()
    symbolic_copy = arguments.symbolic_copy(posed_arm(1, 3, link_radius=(0.1, 0.0, 0.1), margin=0.01))
    assert arguments.values.size == 9 + 5 + 3 + 1
    theta = postures(plain, 1, 0)
    tool = ca.Function("tool", [arguments.symbols], [symbolic_copy.tool.position(ca.DM(theta))])
    assert as_array(tool(arguments.values)) == pytest.approx(
        as_array(posed_arm(1, 3).tool.position(ca.DM(theta))), abs=1e-12
    )


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"link_lengths": (1.0,)}, "link_lengths: "),
        ({"link_lengths": (1.0, 0.0, 1.0)}, "link_lengths: "),
        ({"max_speed": (1.0,)}, "max_speed: "),
        ({"max_acceleration": (1.0, 0.0, 1.0)}, "max_acceleration: "),
        ({"joint_limits": ((0.0, 1.0), (1.0, 1.0), (0.0, 1.0))}, "joint_limits: "),
        ({"base_point": (float("nan"), 0.0)}, "base_point: nan"),
        ({"base_angle": 1e9}, "base_angle: 1e\\+09 is not within"),
        ({"tool_offset": (-0.5, 0.0)}, "tool_offset: the tool lies on the last joint"),
        ({"link_radius": (0.1, 0.1)}, "link_radius: 2 values for 3 links"),
        ({"link_radius": (0.1, -0.1, 0.1)}, "link_radius: -0.1 is not within 0"),
        ({"max_jerk": (1.0,)}, "max_jerk: 1 values for 3 links"),
        ({"max_jerk": (1.0, 0.0, 1.0)}, "max_jerk: 0 is not a positive number"),
        ({"margin": -0.1}, "margin: -0.1 is not within 0"),
        (
            {"link_radius": (0.2, 0.2, 0.2), "margin": 0.1, "self_collision": True},
            "self_collision: link 1 and link 3 cannot keep 0.5 m: what joins them is 0.5 m long",
        ),
    ],
)
def test_impossible_arms(more: dict[str, object], message: str) -> None:
    valid = dict.fromkeys(("link_lengths", "max_speed", "max_acceleration"), (1.0,) * 3) | {"link_lengths": (0.5,) * 3}
    with pytest.raises(InvalidProblem, match=f"^{message}"):
        PlanarArm(**(valid | more))

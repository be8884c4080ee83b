"""Joints on each other in a tree: frames, dynamics, expressions, and how fast bodies move against each other."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from helpers.core_robots import placed, postures, robot_of

from problems.base import as_array
from problems.core import CoreExpression, Dynamics
from problems.motions import Samples, traced
from problems.robots import FixedFrame, SpatialArm, Transform, built_in
from problems.robots.inertia import Inertia

pytestmark = pytest.mark.usefixtures("compiled")


def two(name: str) -> SpatialArm:
    """An arm twice on one base, joint by joint; the second one is turned and elsewhere, and carries the tool."""
    arm = built_in(name).arm()
    away = FixedFrame(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)), (0.8, 0.1, 0.05))
    joints = []
    for number, joint in enumerate(arm.chain.joints):
        bodies = (max(0, 2 * number - 1), 2 * number)  # of the two, that joints before move
        beyond = FixedFrame.of(Transform(away.rotation, away.translation) @ joint.pose) if number == 0 else joint.pose
        joints += [replace(joint, name=f"one {number}", parent=bodies[0])]
        joints += [replace(joint, name=f"two {number}", parent=bodies[1], pose=beyond)]
    double = {key: tuple(np.repeat(getattr(arm, key), 2)) for key in ("max_speed", "max_acceleration")}
    chain = replace(arm.chain, joints=tuple(joints), tip_body=2 * arm.dof)
    return SpatialArm(chain, **double, gravity=(0.0, 0.0, -9.81))


def test_bodies_and_what_they_have_in_common() -> None:
    chain = robot_of("fork").chain
    assert chain.parents == (0, 1, 1, 2, 3, 4, 5)
    assert chain.above(6) == [6, 4, 2, 1]
    assert chain.above(6, 2) == [6, 4]
    assert [chain.common(*pair) for pair in ((6, 7), (4, 6), (0, 5), (3, 3))] == [1, 4, 0, 3]
    assert built_in("panda").arm().chain.parents == tuple(range(7))


@pytest.mark.parametrize("name", ["panda", "ur5e"])
def test_two_arms_on_a_base_have_the_torques_of_each(name: str) -> None:
    both, arm = two(name), built_in(name).arm()
    states = np.random.default_rng(0).normal(size=(11, 3, both.dof))
    one = FixedFrame(((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))
    for first, standing in ((0, arm), (1, replace(arm, base_frame=one))):
        assert both.rigid_chain is not None and standing.rigid_chain is not None
        own = as_array(standing.rigid_chain.torques(*map(ca.DM, states[:, :, first::2].swapaxes(0, 1))))
        together = as_array(both.rigid_chain.torques(*map(ca.DM, states.swapaxes(0, 1))))
        np.testing.assert_allclose(together[:, first::2], own, rtol=0.0, atol=1e-11)
    core = Dynamics.of_chain(both.rigid_chain)
    assert core is not None
    moving, held = core.torques(states.reshape(11, -1))
    friction = both.rigid_chain.viscous(ca.DM(states[:, 1])) + both.rigid_chain.coulomb(ca.DM(states[:, 1]))
    np.testing.assert_allclose(moving + held + as_array(friction), together, rtol=0.0, atol=1e-11)


def heavy_fork() -> SpatialArm:
    rng, fork = np.random.default_rng(3), robot_of("fork")
    joints = []
    for joint in fork.chain.joints:
        size = rng.uniform(0.05, 0.2, (20, 3))
        points = size - size.mean(axis=0)
        matrix = np.eye(3) * (points**2).sum() - points.T @ points
        center = tuple(rng.normal(0.0, 0.1, 3).tolist())
        joints.append(
            replace(joint, inertia=Inertia(mass=2.0, center=center, matrix=tuple(map(tuple, matrix.tolist()))))
        )
    return replace(fork, chain=replace(fork.chain, joints=tuple(joints)))


def energy(robot: SpatialArm, theta: np.ndarray, speed: np.ndarray) -> float:
    """The kinetic energy less the work of gravity, J, from differences of frames in NumPy."""
    step, total = 1e-6, 0.0
    turns, places = placed(robot, np.array([theta - step * speed, theta, theta + step * speed]))
    for body, joint in enumerate(robot.chain.joints, start=1):
        inertia = joint.inertia
        centers = places[:, body] + turns[:, body] @ np.array(inertia.center)
        rate = (turns[2, body] - turns[0, body]) / (2.0 * step) @ turns[1, body].T
        spin = turns[1, body].T @ np.array([rate[2, 1], rate[0, 2], rate[1, 0]])
        velocity = (centers[2] - centers[0]) / (2.0 * step)
        total += 0.5 * inertia.mass * velocity @ velocity + 0.5 * spin @ np.array(inertia.matrix) @ spin
        total -= inertia.mass * np.array(robot.gravity) @ centers[1]
    return float(total)


def test_torques_of_a_tree_do_the_work_that_its_energy_takes() -> None:
    robot, rng, step = heavy_fork(), np.random.default_rng(1), 1e-4
    core = Dynamics.of(robot)
    assert core is not None
    for _ in range(20):
        theta, speed, acceleration = rng.normal(size=(3, robot.dof))
        before, after = (
            energy(robot, theta + t * speed + t**2 / 2.0 * acceleration, speed + t * acceleration)
            for t in (-step, step)
        )
        moving, held = core.torques(np.concatenate([theta, speed, acceleration])[None])
        assert (moving + held)[0] @ speed == pytest.approx((after - before) / (2.0 * step), rel=1e-5, abs=1e-5)


def test_expressions_of_the_tool_of_a_tree() -> None:
    robot = robot_of("fork")
    function = traced(lambda m: ca.vertcat(m.tool, m.tool_velocity, ca.vec(m.rotation), m.positions[7]), robot, "hand")
    core = CoreExpression.of(robot, function)
    assert core is not None
    states = np.random.default_rng(2).normal(size=(9, 4, robot.dof))
    numeric = Samples(derivatives=tuple(map(ca.DM, states.swapaxes(0, 1))), duration=ca.DM(1.0), robot=robot)
    found = core.values(np.column_stack([states.reshape(9, -1), np.zeros(9)]), 1.0)
    np.testing.assert_allclose(found, as_array(function.at(numeric)), rtol=0.0, atol=1e-12)


def test_no_body_is_faster_against_another_than_is_said() -> None:
    robot, rng, step = robot_of("fork"), np.random.default_rng(4), 1e-6
    theta, speed = postures(robot, rng, 400), rng.normal(size=(400, robot.dof))
    bodies, spheres = robot.bodies, robot.spheres
    turns, places = (
        np.stack(part) for part in zip(*(placed(robot, theta + t * speed) for t in (-step, step)), strict=True)
    )
    for one, two in ((14, 13), (15, 5), (9, 7), (6, 12), (3, 8)):
        centers = [
            places[:, :, s.link] + turns[:, :, s.link] @ np.array(s.center) for s in (spheres[one], spheres[two])
        ]
        apart = np.linalg.norm(centers[0] - centers[1], axis=2)
        rates, levers = bodies.motion(bodies.each[one], bodies.each[two])
        most = np.abs(speed @ rates.T) @ levers
        assert (np.abs(apart[1] - apart[0]) / (2.0 * step) <= most * (1.0 + 1e-6)).all()
        common = robot.chain.common(spheres[one].link, spheres[two].link)
        moving = {*robot.chain.above(spheres[one].link, common), *robot.chain.above(spheres[two].link, common)}
        assert {int(np.flatnonzero(row)[0]) + 1 for row in rates} == moving

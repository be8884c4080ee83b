"""Torques of the compiled core against the CasADi model, and their slopes against its derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from problems.limits import TorqueLimit
from problems.polish.torques import CoreTorques, JointTorques
from problems.robots import FixedFrame, SpatialArm, built_in
from problems.robots.chain import JointKind

pytestmark = pytest.mark.usefixtures("compiled")

STATES = 37  # no multiple of the lanes


def arm_of(name: str) -> SpatialArm:
    return built_in(name).arm()


def turned() -> SpatialArm:
    """With friction of both kinds, on a base that is askew, and with a joint that slides."""
    arm = arm_of("ur5e")
    joints = list(arm.chain.joints)
    joints[2] = replace(joints[2], kind=JointKind.PRISMATIC, position=(-0.5, 0.5), axis=(0.6, 0.0, 0.8))
    friction = tuple(0.1 * (1 + joint) for joint in range(arm.dof))
    return replace(
        arm,
        chain=replace(arm.chain, joints=tuple(joints)).with_friction(friction, friction[::-1]),
        base_frame=FixedFrame(((0.36, 0.48, -0.8), (-0.8, 0.6, 0.0), (0.48, 0.64, 0.6))),
        spheres=(),
        kept_pairs=(),
        proven_pairs=(),
    )


@pytest.fixture(params=["panda", "iiwa14", "turned"])
def torques(request: pytest.FixtureRequest) -> tuple[CoreTorques, JointTorques]:
    arm = turned() if request.param == "turned" else arm_of(request.param)
    limit = TorqueLimit(arm)
    core = JointTorques.of(limit)
    assert isinstance(core, CoreTorques)
    return core, JointTorques(limit)


@pytest.mark.parametrize("seed", range(3))
def test_torques_and_slopes_are_those_of_the_model(torques: tuple[CoreTorques, JointTorques], seed: int) -> None:
    core, model = torques
    states = np.random.default_rng(seed).normal(0.0, 2.0, (STATES, 3 * core.dof))
    np.testing.assert_allclose(core.shares(states), model.shares(states), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(core.slopes(states), model.slopes(states), rtol=0.0, atol=1e-12)
    for scale in (0.1, 1.0, 3.0):
        states[:, core.dof :] *= scale
        assert core.time_scale(states) == pytest.approx(model.time_scale(states), rel=1e-12)


def test_one_state_and_none() -> None:
    core = JointTorques.of(TorqueLimit(arm_of("panda")))
    assert core.shares(np.zeros((1, 21))).shape == (1, 7)
    assert core.slopes(np.zeros((0, 21))).shape == (0, 7, 3, 7)


def test_a_limit_of_another_kind_is_not_taken_for_that_of_torques() -> None:
    class Doubled(TorqueLimit):
        @property
        def bounds(self) -> tuple[float, ...]:
            return tuple(2.0 * bound for bound in super().bounds)

    assert not isinstance(JointTorques.of(Doubled(arm_of("panda"))), CoreTorques)

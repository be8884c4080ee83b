"""Public robots straight from their files, against Pinocchio and coal on the meshes themselves."""

from __future__ import annotations

import numpy as np
import pytest

import tpbso_casadi as tp
from benchmarks.off_the_shelf import ARMS, ROBOTS
from problems.certify import CertificateStatus, limit_verdicts
from problems.limits import cover_limits
from problems.robots import SpatialArm, read_urdf
from problems.scene.solids import Box
from problems.timing.free_space import rest_to_rest

pytestmark = pytest.mark.skipif(not ROBOTS.exists(), reason="example-robot-data is not installed")
TIPS = {
    **{"ur3": "tool0", "ur5": "tool0", "ur10": "tool0", "ur5_gripper": "tool0", "panda": "panda_hand_tcp"},
    **{"panda_collision": "panda_hand_tcp", "kinova": "j2s6s200_end_effector", "xarm7": "link_eef", "z1": "link06"},
    **{"so100": "gripper", "so101": "gripper_link", "talos_left_arm": "wrist_left_ft_tool_link"},
    **{"baxter": "left_hand_link", "tiago_no_hand": "wrist_ft_tool_link"},
}


@pytest.mark.parametrize("name", ARMS)
def test_the_tip_is_before_grippers_and_sensors(name: str) -> None:
    arm = ARMS[name]
    ends = (arm.keys.get("base_link"), arm.keys.get("tip_link"))
    chain = read_urdf((ROBOTS / arm.file).read_text(), *ends).chain
    assert chain.tip_link == TIPS[name]
    assert not any("grip" in joint.name.lower() or "finger" in joint.name for joint in chain.joints)


@pytest.mark.parametrize(
    ("file", "line"),
    [
        (
            "baxter_description/urdf/baxter.urdf",
            r"\(7 joints: right_s0 to right_w2\), .* \(7 joints: left_s0 to left_w2\)",
        ),
        (
            "pr2_description/urdf/pr2.urdf",
            r"'r_gripper_tool_frame' \(8 joints: torso_lift_joint to r_wrist_roll_joint\)",
        ),
    ],
)
def test_where_there_are_several_arms_one_line_lists_them(file: str, line: str) -> None:
    with pytest.raises(ValueError, match=f"^tip_link: must be stated, for several chains end at .*{line}"):
        read_urdf((ROBOTS / file).read_text())


@pytest.mark.slow
def test_the_public_ur5_is_not_certified_through_a_pillar() -> None:
    """It was one sphere of 8.7 mm; by its meshes the fastest motion is 35.7 mm inside."""
    arm = tp.robot(ROBOTS / ARMS["ur5"].file, max_acceleration=10.0, payload={"mass": 2.0}).model
    assert isinstance(arm, SpatialArm)
    ends = np.array([[-1.0, -1.2, 1.4, -1.8, -1.57, 0.0], [1.0, -1.2, 1.4, -1.8, -1.57, 0.0]])
    motion = rest_to_rest(ends[0], ends[1], arm.limits)
    limits = cover_limits(arm, [Box(center=(0.34, 0.0, 0.5), size=(0.06, 0.06, 1.0))])
    (verdict,) = limit_verdicts(limits, motion)
    assert verdict.status is CertificateStatus.VIOLATED
    assert verdict.worst < -0.02
    pytest.importorskip("pinocchio")
    from benchmarks.off_the_shelf import Meshes  # noqa: PLC0415

    scene = Meshes(ROBOTS / ARMS["ur5"].file, arm, np.array([[0.34, 0.0, 0.5]]), (0.06, 0.06, 1.0))
    for theta in motion.at(np.linspace(0.0, motion.duration, 200)):
        exact, found = scene.distance(theta), limits[0].clearances(theta[None], np.zeros(1))[0]
        if exact > 0.0:
            assert -1e-6 <= exact - found <= 0.003

"""The URDF that other libraries are given is of the same robot."""

from __future__ import annotations

from benchmarks.motion_bench_maker.setting import Setting
from benchmarks.peers.space.urdf import links_of_bodies, locked


def test_joints_that_are_not_planned_are_fixed(setting: Setting) -> None:
    joints = {joint.get("name"): joint for joint in locked(setting).iter("joint")}
    kinds = {name: joint.get("type") for name, joint in joints.items()}
    assert kinds == {"turn": "revolute", "lift": "revolute", "roll": "revolute", "grip": "fixed", "close": "fixed"}
    assert joints["close"].find("axis") is None
    assert joints["close"].find("limit") is None
    assert joints["turn"].find("limit") is not None


def test_a_body_is_the_link_whose_frame_it_has(setting: Setting) -> None:
    assert links_of_bodies(setting.kinematics) == {0: "foot", 1: "upper", 2: "lower", 3: "wrist"}

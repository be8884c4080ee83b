"""A small arm in space for tests: seven joints, turned in alternation about the z and y axes of their own frames."""

from typing import Any

from problems.robots import ChainJoint, FixedFrame, SpatialArm
from problems.robots.chain import Chain, JointKind

LENGTHS = (0.3, 0.0, 0.4, 0.0, 0.35, 0.0, 0.0)  # m, to each joint from the one before
TOOL = 0.15  # m, from the last joint to the tool


def placed(x: float = 0.0, z: float = 0.0) -> FixedFrame:
    """Ahead of the frame before, or above it, and turned as it is."""
    return FixedFrame(translation=(x, 0.0, z))


def small_arm(joints: int = 7, **changes: Any) -> SpatialArm:
    """The arm, 1.2 m long and upright at zero; fewer joints leave out those nearest the tool."""
    axes = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    chain = Chain(
        name="small arm",
        joints=tuple(
            ChainJoint(name=f"joint_{i}", link=f"link_{i}", pose=placed(z=length), axis=axes[i % 2])
            for i, length in enumerate(LENGTHS[:joints])
        ),
        tip=placed(z=TOOL),
    )
    settings: dict[str, Any] = {
        "chain": chain,
        "max_speed": (2.0,) * joints,
        "max_acceleration": (10.0,) * joints,
        "position_limits": ((-2.8, 2.8),) * joints,
    }
    return SpatialArm(**(settings | changes))


def sliding_arm() -> SpatialArm:
    """A lift of 0.5 m with three turning joints on it: x forward, z up."""
    joints = (
        ChainJoint(name="lift", link="carriage", kind=JointKind.PRISMATIC, position=(0.0, 0.5)),
        ChainJoint(name="shoulder", link="upper arm"),
        ChainJoint(name="elbow", link="forearm", pose=placed(x=0.4)),
        ChainJoint(name="wrist", link="hand", pose=placed(x=0.4), axis=(0.0, 1.0, 0.0)),
    )
    return SpatialArm(
        chain=Chain(name="lift", joints=joints, tip=placed(x=0.2)),
        max_speed=(0.5, 2.0, 2.0, 2.0),
        max_acceleration=(2.0, 10.0, 10.0, 10.0),
        position_limits=((0.0, 0.5), (-2.8, 2.8), (-2.8, 2.8), (-2.0, 2.0)),
    )

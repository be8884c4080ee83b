"""Sequential linear programs over a path and the speed along it, which polish plans among obstacles."""

from problems.sequential.polish import PathSpeedPolish, can_be_polished, limits_can_be_polished
from problems.sequential.torques import JointTorques

__all__ = ["JointTorques", "PathSpeedPolish", "can_be_polished", "limits_can_be_polished"]

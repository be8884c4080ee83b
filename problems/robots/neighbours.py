"""Neighbouring links of an arm: those that a joint connects, and those that no posture of a joint parts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from problems.base import FloatArray
from problems.geometry import Balls
from problems.robots.arm_cover import CoveredLink
from problems.robots.chain import ChainJoint, LinkFrame


@dataclass(frozen=True, kw_only=True)
class NeighbourSettings:
    """Settings of the proof that two links always touch.

    Values are chosen.

    Attributes:
        most_cells: cells of a joint's range before the proof gives up.
        counted_overlap: share of an overlap that is counted on: rounding takes less than the rest.
    """

    most_cells: int = 200
    counted_overlap: float = 0.95


SETTINGS = NeighbourSettings()


def connected_links(
    frames: Sequence[LinkFrame], parents: Sequence[int], solid: Collection[str]
) -> frozenset[frozenset[str]]:
    """Pairs of names of links that one joint connects, directly or via fixed links without geometry.

    The way leads from a link towards the base: what is fixed beside a joint's parent, as a wall beside an arm, is not
    connected with what the joint moves.

    Args:
        frames: of all links.
        parents: the number of the body that each joint is on.
        solid: names of those with geometry.
    """
    known, pairs = {frame.name: frame for frame in frames}, set()
    for frame in frames:
        here = frame
        near = {frame.body, parents[frame.body - 1] if frame.body else 0}
        while frame.name in solid and here.parent and known[here.parent].body in near:
            here = known[here.parent]
            if here.name in solid:
                if here.body != frame.body:
                    pairs.add(frozenset((frame.name, here.name)))
                break
    return frozenset(pairs)


def are_never_parted(one: CoveredLink, two: CoveredLink, joint: ChainJoint, bounds: tuple[float, float]) -> bool:
    """Whether two links touch wherever the only joint between them is, so that no posture is clear.

    They do where balls in them overlap: those of their covers, less what these may stick out. Two balls that overlap
    by d go on doing so until the joint has turned by d over the distance of the second one's centre from the axis, or
    slid by d. Cells of the range that this does not show are halved.

    Args:
        one: link on the body before the joint.
        two: link on the body that it moves.
        joint: that is between them.
        bounds: of it, rad or m.
    """
    whole_turn = joint.turns and bounds[1] - bounds[0] >= 2.0 * np.pi
    cells, looked = [(-np.pi, np.pi) if whole_turn else bounds], 0
    inner = one.balls.shrunk(one.overhang), two.balls.shrunk(two.overhang)
    levers = _levers(two.balls, joint)
    while cells:
        low, high = cells.pop()
        middle, looked = (low + high) / 2.0, looked + 1
        depths = _depths(*inner, joint, middle)
        if looked > SETTINGS.most_cells or not (depths > 0.0).any():
            return False
        shown = float(np.max(SETTINGS.counted_overlap * depths / levers))
        if middle - low > shown:
            cells += [(low, middle), (middle, high)]
    return True


def _levers(balls: Balls, joint: ChainJoint) -> FloatArray:
    """The distances of centres from the axis, (k,), m; 1 for a joint that slides."""
    if not joint.turns:
        return np.ones(len(balls))
    axis = np.array(joint.axis)
    across = balls.centers - np.outer(balls.centers @ axis, axis)
    return np.asarray(np.maximum(np.linalg.norm(across, axis=1), 1e-9))


def _depths(one: Balls, two: Balls, joint: ChainJoint, value: float) -> FloatArray:
    """How deep each ball of two overlaps one of the others most, (k,), m."""
    pose = joint.moved(ca.DM(value))
    turn = np.array([[float(entry) for entry in row] for row in pose.rotation])
    return one.overlaps(Balls(two.centers @ turn.T + np.array([float(part) for part in pose.translation]), two.radii))

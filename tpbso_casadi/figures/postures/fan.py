"""The times at which an arm is shown: a fan from light to dark, and the closest approach."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from problems.base.matrix import FloatArray
from tpbso_casadi.figures.style.colours import CLOSEST, shade_of
from tpbso_casadi.planning.motion import Motion

COUNT = 9
OPACITIES, CLOSE = (0.12, 0.22, 0.35), 0.55  # of obstacles that move: at the start, halfway, at the end; when closest


@dataclass(frozen=True)
class Snapshot:
    """A time at which the arm is shown.

    Attributes:
        label: of it; empty for those between start and goal.
        colour: of the arm.
        time: s.
        opacity: of the obstacles that move; 0 where they are not shown.
    """

    label: str
    colour: Any
    time: float
    opacity: float = 0.0


def fan_of(motion: Motion) -> list[Snapshot]:
    """``COUNT`` postures, equally spaced in time, the first at the start, the last at the end, from light to dark."""
    shares = np.linspace(0.0, 1.0, COUNT)
    labels = {0: "start", COUNT - 1: "end"}
    opacities = dict(zip((0, COUNT // 2, COUNT - 1), OPACITIES, strict=True))
    return [
        Snapshot(labels.get(k, ""), shade_of(share), share * motion.trajectory.duration, opacities.get(k, 0.0))
        for k, share in enumerate(shares.tolist())
    ]


def snapshots(motion: Motion) -> list[Snapshot]:
    """The fan, and the posture of the closest approach to an obstacle, if there is one within reach."""
    closest = motion.closest_approach
    fan = fan_of(motion)
    return fan if closest is None else [*fan, Snapshot("closest", CLOSEST, closest.time, CLOSE)]


def times_of(shown: list[Snapshot]) -> FloatArray:
    """Their times, (n,), s."""
    return np.array([snapshot.time for snapshot in shown])


def legend_of(motion: Motion) -> str:
    """What a legend says of the fan."""
    return f"{COUNT} postures, every {motion.trajectory.duration / (COUNT - 1):.3g} s, light to dark"

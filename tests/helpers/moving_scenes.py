"""Scenes in the plane in which obstacles move: what waits for them, what crosses their way."""

from __future__ import annotations

from problems import Ellipse, Joints, Move, PlanarArm
from problems.scene.moving import ConstantVelocity, MovingObstacle

ARM = PlanarArm((1.0, 0.1), (2.0, 2.0), (10.0, 10.0), ((-1.2, 1.2), (-0.5, 0.5)))
HERE, THERE = Joints((-0.8, 0.0)), Joints((0.8, 0.0))
TRAIN = MovingObstacle(Ellipse((2.1, 0.0), (2.0, 0.05)), ConstantVelocity((0.3, 0.0)))  # its tail leaves the base
CROSSING = MovingObstacle(Ellipse((1.6, 0.5), (0.1, 0.1)), ConstantVelocity((-1.0, -0.4)))

WAITING = Move(ARM, HERE, (THERE,), obstacles=(TRAIN,))
CROSSED = Move(ARM, HERE, (THERE,), obstacles=(CROSSING,))
# The tip is 1.088 m from the base at least: it can pass the train's tail when that is as far away, 3.29 s later. Link 1
# is then at 0.044 rad at most: the rest takes 0.756 rad / 2 rad/s and half of braking, 0.1 s. There is no way around.
WAITING_BOUND = 3.76

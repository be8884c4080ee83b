"""What the motors have to give with a payload, by Pinocchio: for checking, apart from the models that are checked."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from problems.base import FloatArray


@dataclass(frozen=True)
class Payload:
    """A mass in kg at a point in the tool's frame, m."""

    mass: float
    center: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def stated(self) -> dict[str, Any]:
        """As a table of a scenario."""
        return {"mass": self.mass, "center": list(self.center)}


@dataclass(frozen=True)
class Motors:
    """Torques of a robot that carries something.

    Attributes:
        urdf: file of the robot.
        names: of its joints, in the order of the motion.
        tool: link that carries the payload.
        payload: it.
    """

    urdf: Path
    names: tuple[str, ...]
    tool: str
    payload: Payload

    @cached_property
    def _model(self) -> Any:
        import pinocchio  # noqa: PLC0415 (an extra)

        model = pinocchio.buildModelFromUrdf(str(self.urdf))
        frame = model.frames[model.getFrameId(self.tool)]
        point = np.array(self.payload.center)
        inertia = pinocchio.Inertia(self.payload.mass, point, np.zeros((3, 3)))
        model.appendBodyToJoint(frame.parentJoint, inertia, frame.placement)
        return model

    def peak(self, theta: FloatArray, speed: FloatArray, acceleration: FloatArray) -> float:
        """The largest torque as a share of the effort that the URDF states.

        Args:
            theta: joint angles, (n, k), rad.
            speed: (n, k), rad/s.
            acceleration: (n, k), rad/s^2.
        """
        import pinocchio  # noqa: PLC0415 (an extra)

        model = self._model
        data, at = model.createData(), [model.joints[model.getJointId(name)].idx_v for name in self.names]
        full = np.zeros((3, len(theta), model.nv))
        full[:, :, at] = theta, speed, acceleration
        torques = np.array([pinocchio.rnea(model, data, *state) for state in full.transpose(1, 0, 2)])[:, at]
        torques += model.damping[at] * speed + model.friction[at] * np.sign(speed)
        return float((np.abs(torques) / model.effortLimit[at]).max())

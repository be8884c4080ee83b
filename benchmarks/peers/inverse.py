"""Inverse kinematics of other libraries, each as its documentation says, to the same tolerance.

A solver takes a pose and a random generator and returns postures: all of them where a library has a closed form, else
one or none. Numerical ones begin at random postures within the limits, and again where that fails.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeAlias
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray

Truths: TypeAlias = NDArray[np.bool_]
Solve: TypeAlias = Callable[[FloatArray, np.random.Generator], FloatArray]  # a pose (4, 4): postures (n, dof)
Descend: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray | None]  # a pose and a start (dof,): a posture
TOLERANCE = 1e-6  # m and rad, that all are asked for
STARTS = 100  # of numerical solvers, at most
LOCKED = 16  # angles of a joint too many, of closed forms
TURN = 2.0 * np.pi
HALF_A_TURN = np.diag([-1.0, -1.0, 1.0, 1.0])  # of a base about its axis


@dataclass(frozen=True)
class AskedArm:
    """An arm as other libraries are given it.

    Attributes:
        name: of the built-in robot.
        urdf: a file with its chain alone, from the base to the tool.
        base: the first link.
        tip: the last link.
        low: the least of each joint, (dof,), rad.
        high: the most.
        at_zero: the tool's pose with all joints at zero, (4, 4).
    """

    name: str
    urdf: Path
    base: str
    tip: str
    low: FloatArray
    high: FloatArray
    at_zero: FloatArray

    @property
    def ranges(self) -> list[tuple[float, float]]:
        """Least and most of each joint."""
        return list(zip(self.low.tolist(), self.high.tolist(), strict=True))

    def start(self, rng: np.random.Generator) -> FloatArray:
        """A random posture (dof,)."""
        return rng.uniform(self.low, self.high)

    def turned(self, theta: FloatArray) -> FloatArray:
        """Postures in the turns nearest to the middle of the limits."""
        return np.asarray(theta - TURN * np.round((theta - (self.low + self.high) / 2.0) / TURN))

    def keeps(self, theta: FloatArray) -> Truths:
        """Whether each posture is within the limits, which TRAC-IK holds in single precision."""
        return np.asarray(((theta >= self.low - TOLERANCE) & (theta <= self.high + TOLERANCE)).all(axis=-1))

    def none(self) -> FloatArray:
        """No posture."""
        return np.empty((0, len(self.low)))


def chain_alone(urdf: str, tip: str) -> tuple[str, str]:
    """A URDF without what is beside the way to a link and without masses, and the name of the first link."""
    root = ElementTree.fromstring(urdf)
    ends = {joint: [joint.find(end).get("link") for end in ("parent", "child")] for joint in root.findall("joint")}
    parents, kept = {child: parent for parent, child in ends.values()}, [tip]
    while kept[-1] in parents:
        kept.append(parents[kept[-1]])
    for joint, (_, child) in ends.items():
        if child not in kept:
            root.remove(joint)
    for link in root.findall("link"):
        if link.get("name") not in kept:
            root.remove(link)
        link[:] = []
    return ElementTree.tostring(root, encoding="unicode"), kept[-1]


def restarted(arm: AskedArm, descend: Descend) -> Solve:
    """A solver that descends from random postures until one arrives within the limits."""

    def solve(pose: FloatArray, rng: np.random.Generator) -> FloatArray:
        for _ in range(STARTS):
            theta = descend(pose, arm.start(rng))
            if theta is not None and arm.keeps(turned := arm.turned(theta)):
                return turned[None]
        return arm.none()

    return solve


def pinocchio(arm: AskedArm, step: float, most: int) -> Solve:
    """The loop of Pinocchio's example "Inverse kinematics (clik)", whose step is 0.1 and which takes up to 1,000."""
    import pinocchio as pin  # noqa: PLC0415

    model = pin.buildModelFromUrdf(str(arm.urdf))
    data, frame = model.createData(), model.frames[model.getFrameId(arm.tip)]
    joint, damping = frame.parentJoint, 1e-12 * np.eye(6)

    def descend(pose: FloatArray, theta: FloatArray) -> FloatArray | None:
        wanted = pin.SE3(pose) * frame.placement.inverse()
        for _ in range(most):
            pin.forwardKinematics(model, data, theta)
            missing = data.oMi[joint].actInv(wanted)
            error = pin.log(missing).vector
            if np.linalg.norm(error) < 0.1 * TOLERANCE:
                return theta
            jacobian = -pin.Jlog6(missing.inverse()) @ pin.computeJointJacobian(model, data, theta, joint)
            speed = -jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + damping, error)
            theta = pin.integrate(model, theta, step * speed)
        return None

    return restarted(arm, descend)


def ikpy(arm: AskedArm) -> Solve:
    """Least squares of SciPy within the limits, position and orientation together."""
    from ikpy.chain import Chain  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # fixed links that are active, before the mask is known
        links = Chain.from_urdf_file(str(arm.urdf), base_elements=[arm.base]).links
        moving = [link.joint_type == "revolute" for link in links]
        chain = Chain.from_urdf_file(str(arm.urdf), base_elements=[arm.base], active_links_mask=moving)

    def descend(pose: FloatArray, theta: FloatArray) -> FloatArray | None:
        begun = chain.active_to_full(theta, np.zeros(len(links)))
        found = chain.inverse_kinematics_frame(pose, begun, orientation_mode="all", tol=1e-14)
        if np.abs(chain.forward_kinematics(found) - pose).max() > 0.5 * TOLERANCE:
            return None
        return np.asarray(chain.active_from_full(found))

    return restarted(arm, descend)


def robotics_toolbox(arm: AskedArm) -> Solve:
    """Its compiled Levenberg and Marquardt steps with its own restarts and limits; residuals are half squares."""
    from roboticstoolbox import Robot  # noqa: PLC0415

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that this way to read a URDF will go
        chain = Robot.URDF(str(arm.urdf)).ets(end=arm.tip)

    def solve(pose: FloatArray, rng: np.random.Generator) -> FloatArray:
        found = chain.ik_LM(pose, q0=arm.start(rng), tol=0.1 * TOLERANCE**2, joint_limits=True)
        return found.q[None] if found.success else arm.none()

    return solve


def trac_ik(arm: AskedArm) -> Solve:
    """TRAC-IK with its own restarts: KDL's Newton steps and quadratic programs side by side, in two threads."""
    from trac_ik import TracIK  # noqa: PLC0415

    solver = TracIK(arm.base, arm.tip, str(arm.urdf), timeout=0.1, epsilon=0.1 * TOLERANCE, solver_type="Speed")

    def solve(pose: FloatArray, rng: np.random.Generator) -> FloatArray:
        found = solver.ik(pose[:3, 3], pose[:3, :3], arm.start(rng))
        return arm.none() if found is None else np.asarray(found)[None]

    return solve


def eaik(arm: AskedArm) -> Solve:
    """EAIK's closed forms; the last of seven joints is locked at one angle after the other until there is an answer."""
    from eaik.IK_URDF import UrdfRobot  # noqa: PLC0415

    shares = sorted((np.arange(LOCKED) + 0.5) / LOCKED, key=lambda share: abs(share - 0.5))
    angles = [[(6, low + share * (high - low))] for low, high in arm.ranges[6:] for share in shares]
    robots = [UrdfRobot(str(arm.urdf), fixed_axes=each) for each in angles or [[]]]
    tool = np.linalg.inv(robots[0].fwdKin(np.zeros(len(arm.low)))) @ arm.at_zero  # a URDF's tool is left out by it
    back = np.linalg.inv(tool)

    def solve(pose: FloatArray, _: np.random.Generator) -> FloatArray:
        for robot in robots:
            found = robot.IK(pose @ back)
            exact = [theta for theta, nearest in zip(found.Q, found.is_LS, strict=True) if not nearest]
            theta = arm.turned(np.array(exact).reshape(-1, len(arm.low)))
            if (kept := arm.keeps(theta)).any():
                return theta[kept]
        return arm.none()

    return solve


def ur_analytic_ik(arm: AskedArm) -> Solve:
    """The closed form of Universal Robots' arms in C++, in the maker's frame, half a turn from that of a URDF."""
    import ur_analytic_ik as library  # noqa: PLC0415

    model = getattr(library, arm.name)

    def solve(pose: FloatArray, _: np.random.Generator) -> FloatArray:
        found = model.inverse_kinematics(np.ascontiguousarray(HALF_A_TURN @ pose))
        return arm.turned(np.array(found).reshape(-1, len(arm.low)))

    return solve


@dataclass(frozen=True)
class Peer:
    """A library and how it is used.

    Attributes:
        title: in tables.
        package: of the package index, whose version is stated.
        make: its solver for an arm.
        closed: whether it returns all postures at once, as far as it finds them.
        arms: it knows; all if there are none.
    """

    title: str
    package: str
    make: Callable[[AskedArm], Solve]
    closed: bool = False
    arms: tuple[str, ...] = ()


PEERS = (
    Peer("Pinocchio, step 0.1", "pin", partial(pinocchio, step=0.1, most=1000)),
    Peer("Pinocchio, step 1", "pin", partial(pinocchio, step=1.0, most=100)),
    Peer("ikpy", "ikpy", ikpy),
    Peer("Robotics Toolbox, ik_LM", "roboticstoolbox-python", robotics_toolbox),
    Peer("TRAC-IK", "pytracik", trac_ik),
    Peer("EAIK", "eaik", eaik, closed=True),
    Peer("ur-analytic-ik", "ur-analytic-ik", ur_analytic_ik, closed=True, arms=("ur5e",)),
)

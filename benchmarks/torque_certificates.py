"""Is the certificate of torques right? Random robots and motions, each certificate against a dense sampling.

Planar arms of 2 to 4 links with friction, and the built-in robots, with and without a payload, run random splines. The
limits of each are set so that its largest torque among 100,000 samples is a little below or above them, by a share
between 1e-9 and 1e-1, or by just ``--excess``. A certificate is false when a sample breaks a limit that it calls
certified.

    python -m benchmarks.torque_certificates --count 1000 --workers 2
    python -m benchmarks.torque_certificates --count 1000 --workers 2 --excess 1e-6
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial
from math import factorial
from typing import Any

import casadi as ca
import numpy as np
from scipy.interpolate import BSpline

from problems import CertificateStatus, PlanarArm, Trajectory
from problems.base import FloatArray, as_array
from problems.certify.torque import prove_torques
from problems.limits import TorqueLimit
from problems.robots import BUILT_IN, Payload, Robot, built_in

CHECK_SAMPLES = 100_000
SAMPLES_PER_CHUNK = 2_000
EXCESS = (-9.0, -1.0)  # powers of ten: how far the largest torque is from its limit
ALLOWED = 1e-9  # relative: what a certificate forgives as rounding
PLANAR = "planar"


@dataclass(frozen=True)
class Checked:
    """One motion: what the certificate says, and what samples do.

    Attributes:
        kind: of the robot.
        status: the certificate's.
        seen: the largest torque of all that the certificate has seen, relative to its limit.
        sampled: the largest of the dense samples, likewise.
        milliseconds: of one core, that the certificate took.
    """

    kind: str
    status: CertificateStatus
    seen: float
    sampled: float
    milliseconds: float

    @property
    def is_false(self) -> bool:
        """Whether it certifies what a sample breaks."""
        return self.status is CertificateStatus.CERTIFIED and self.sampled > 1.0 + ALLOWED


def random_payload(rng: np.random.Generator) -> Payload | None:
    """Something in the hand, in every other case."""
    if rng.random() < 0.5:
        return None
    center, side = rng.uniform(-0.1, 0.1, 3).tolist(), float(rng.uniform(0.001, 0.02))
    matrix = ((side, 0.0, 0.0), (0.0, side, 0.0), (0.0, 0.0, side))
    return Payload(mass=float(rng.uniform(0.1, 3.0)), center=tuple(center), matrix=matrix)


def planar_arm(rng: np.random.Generator) -> PlanarArm:
    """Links with masses, most with friction."""
    k = int(rng.integers(2, 5))

    def each(low: float, high: float) -> Any:
        return tuple(rng.uniform(low, high, k).tolist())

    arm = PlanarArm(each(0.2, 1.0), (9.0,) * k, (99.0,) * k, link_masses=each(0.1, 5.0), payload=random_payload(rng))
    viscous, coulomb = (each(0.0, 2.0) if rng.random() < 0.5 else None for _ in range(2))
    return replace(arm, viscous_friction=viscous, coulomb_friction=coulomb, max_torque=(1.0,) * k)


def random_motion(rng: np.random.Generator, joints: int) -> Trajectory:
    """A spline of degree 2 to 6, of a few pieces or many; at rest at its ends, or not."""
    degree, pieces = int(rng.integers(2, 7)), int(rng.choice([1, 3, 10, 60]))
    points = rng.uniform(-2.0, 2.0, joints) + np.cumsum(0.3 * rng.normal(size=(pieces + degree, joints)), axis=0)
    if rng.random() < 0.5 and pieces > 3:
        points[:3], points[-3:] = points[0], points[-1]
    joined = np.linspace(0.0, 10.0 ** rng.uniform(-0.5, 1.0), pieces + 1)
    knots = np.concatenate([np.full(degree, joined[0]), joined, np.full(degree, joined[-1])])
    spline = BSpline(knots, points, degree)
    orders = range(degree, -1, -1)
    coefficients = np.array([(spline.derivative(n) if n else spline)(joined[:-1]) / factorial(n) for n in orders])
    return Trajectory(joined, coefficients)


@cache
def inverse_dynamics(robot: Robot) -> ca.Function:
    """The motors' torques of one sample, (k,), from angles, speeds and accelerations, (k,) each."""
    state = [ca.SX.sym("state", robot.dof) for _ in range(3)]
    return ca.Function("torques", state, [robot.dynamics.torques(*(part.T for part in state)).T])


def sampled_torques(robot: Robot, motion: Trajectory, count: int) -> FloatArray:
    """The largest torque of each joint among so many samples and both sides of breakpoints, (k,)."""
    inner = motion.breakpoints[1:-1]
    times = np.concatenate([np.linspace(0.0, motion.duration, count), inner, np.nextafter(inner, 0.0)])
    parts = [
        as_array(inverse_dynamics(robot)(*(motion.at(some, order).T for order in range(3))))
        for some in np.array_split(times, 1 + times.size // SAMPLES_PER_CHUNK)
    ]
    return np.asarray(np.max([np.abs(part).max(axis=1) for part in parts], axis=0))


def random_case(rng: np.random.Generator, excess: float | None, count: int) -> tuple[str, Any, Trajectory, float]:
    """A robot, its motion, and how large a share of its limit the largest torque of so many samples is."""
    kind = str(rng.choice([PLANAR, *BUILT_IN]))
    robot: Any = planar_arm(rng)
    if kind != PLANAR:
        robot = built_in(kind).arm(max_acceleration=15.0, payload=random_payload(rng))
    motion = random_motion(rng, robot.dof)
    share = 1.0 + (rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(*EXCESS) if excess is None else excess)
    unlimited = np.array(robot.max_torque)
    most = float((sampled_torques(robot, motion, count) / unlimited).max())
    return kind, replace(robot, max_torque=tuple((unlimited * most / share).tolist())), motion, share


def check(seed: int, excess: float | None = None, count: int = CHECK_SAMPLES) -> Checked:
    """Certify one random motion whose samples are known."""
    kind, robot, motion, sampled = random_case(np.random.default_rng(seed), excess, count)
    limit = TorqueLimit(robot)
    prove_torques(limit, motion)  # compiles what it needs of the robot
    began = time.process_time()
    proof = prove_torques(limit, motion)
    milliseconds = (time.process_time() - began) * 1e3
    return Checked(kind, proof.status, abs(proof.worst) / limit.bounds[proof.joint], sampled, milliseconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--excess", type=float, default=None)
    options = parser.parse_args()
    with ProcessPoolExecutor(options.workers) as pool:
        every = list(pool.map(partial(check, excess=options.excess), range(options.count), chunksize=10))
    print("| robot | certified | violated | undecided | false certified | between samples | CPU ms median | worst |")
    print("|---|---|---|---|---|---|---|---|")
    for kind in (PLANAR, *BUILT_IN):
        cases = [case for case in every if case.kind == kind]
        statuses = Counter(case.status for case in cases)
        between = sum(case.status is CertificateStatus.VIOLATED and case.sampled <= 1.0 for case in cases)
        counts = [*(statuses[status] for status in CertificateStatus), sum(case.is_false for case in cases), between]
        times = np.array([case.milliseconds for case in cases])
        print(f"| {kind} | {' | '.join(map(str, counts))} | {np.median(times):.1f} | {times.max():.1f} |")
    less = np.array([1.0 - case.seen / case.sampled for case in every])
    print(f"\nlargest torque seen, below that of all samples: median {np.median(less):.1e}, most {less.max():.1e}")


if __name__ == "__main__":
    main()

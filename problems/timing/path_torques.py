"""Torques along a path: rows of linear programs, with friction.

With b the square of du/dt, and u the path's parameter, the inverse dynamics are linear in b and in its slope:

    tau = m(u) d2u/dt2 + c(u) b + g(u) + viscous q'(u) du/dt + coulomb sign(q'(u))
    m = M(q) q',  c = M(q) q'' + C(q, q') q'
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.interpolate import PPoly

from problems.base import FloatArray, InvalidProblem, as_array
from problems.motions import JointPath
from problems.robots import JointLimits, RigidChain, time_scales_of_arrays

NODES = 7  # through which a polynomial is drawn
TRAVEL = 0.15  # rad (or m) that a joint turns at most while one polynomial holds
FEWEST = 2  # polynomials for each piece of the path
TRAVEL_SAMPLES = 9  # of a piece, to measure what its joints turn
MARGIN = 1e-4  # of every torque limit: what is left to prove the motion by, and for what lies between samples
LEAST_ROOM = 1e-6  # of a limit: what is left of it counts as at least this where friction takes all of it


@dataclass(frozen=True)
class PathTorques:
    """The dynamics along a path.

    Args:
        path: of k joints.
        curve: m, c and g, (3, k), N m for a rate of the parameter in 1/s.
        bound: what the motors may give, the margin taken off, (k,), N m.
        viscous: friction, (k,), N m s.
        coulomb: friction, (k,), N m.
    """

    path: JointPath
    curve: PPoly
    bound: FloatArray
    viscous: FloatArray
    coulomb: FloatArray

    @classmethod
    def of(cls, path: JointPath, limits: JointLimits, chain: RigidChain | None) -> PathTorques | None:
        """Those of a chain with torque limits; None where there is neither.

        Raises:
            InvalidProblem: the motors cannot hold the chain, or overcome its friction, somewhere on the path.
        """
        if chain is None or limits.torque is None:
            return None
        nodes = (1.0 - np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)) / 2.0
        starts = _starts(path)
        lengths = np.diff(starts)
        u = starts[:-1] + nodes[:, None] * lengths
        values = _dynamics(path, chain, u.ravel()).reshape(3, *u.shape, -1)
        ascending = np.linalg.solve(np.vander(nodes, increasing=True), values.swapaxes(0, 1).reshape(NODES, -1))
        scaled = ascending.reshape(NODES, 3, lengths.size, -1).swapaxes(1, 2)
        powers = lengths ** np.arange(NODES)[:, None]
        one = ca.DM.ones(1, len(limits.torque))
        viscous, coulomb = (as_array(part(one))[0] for part in (chain.viscous, chain.coulomb))
        bound = np.array(limits.torque) * (1.0 - MARGIN)
        made = cls(path, PPoly((scaled / powers[..., None, None])[::-1], starts), bound, viscous, coulomb)
        made._check_held(np.union1d(u, starts))
        return made

    def at(self, u: FloatArray, derivative: int = 0) -> tuple[FloatArray, FloatArray, FloatArray]:
        """m, c and g, or derivatives of them, (..., k) at parameters (...)."""
        inertia, bend, held = np.moveaxis(np.asarray(self.curve(u, derivative)), -2, 0)
        return inertia, bend, held

    def time_scale(self, u: FloatArray, rate: FloatArray, change: FloatArray) -> float:
        """How many times slower a motion has to be run, at samples in order; below 1 where time can be saved.

        Args:
            u: parameters (n,).
            rate: du/dt, (n,).
            change: d2u/dt2, (n,).
        """
        inertia, bend, held = self.at(u)
        velocity = self.path.at(u, 1) * rate[:, None]
        inertial = inertia * change[:, None] + bend * rate[:, None] ** 2
        viscous = self.viscous * velocity
        sign, either = self.friction(velocity)
        held, bound = held + sign, self.bound - either
        over, under = (np.maximum(room, LEAST_ROOM * self.bound) for room in (bound - held, bound + held))
        above = time_scales_of_arrays(inertial, viscous, over)
        return float(np.maximum(above, time_scales_of_arrays(-inertial, -viscous, under)).max())

    def friction(self, velocity: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coulomb friction at samples in order, (n, k): what it is, and half of what it may be where it jumps."""
        sign = np.sign(velocity)
        padded = np.pad(sign, ((1, 1), (0, 0)), mode="edge")
        sure = (sign == padded[:-2]) & (sign == padded[2:]) & (sign != 0.0)
        return np.where(sure, sign, 0.0) * self.coulomb, np.where(sure, 0.0, 1.0) * self.coulomb

    def _check_held(self, u: FloatArray) -> None:
        """Whether the motors can run the chain along the path slowly."""
        torque = np.abs(self.at(u)[2] + self.coulomb * np.sign(self.path.at(u, 1)))
        where, joint = np.unravel_index(np.argmax(torque / self.bound), torque.shape)
        if torque[where, joint] > self.bound[joint]:
            share = u[where] / self.path.breakpoints[-1]
            raise InvalidProblem(
                "path",
                f"joint {joint + 1} has to give {torque[where, joint]:.4g} N m to hold the arm {share:.0%} along the "
                f"path, and may give {self.bound[joint] / (1.0 - MARGIN):g} N m, of which {MARGIN:.2%} is kept free",
            )


def _starts(path: JointPath) -> FloatArray:
    """Where polynomials begin, and the last ends: breakpoints of the path among them."""
    shares = np.linspace(0.0, 1.0, TRAVEL_SAMPLES)[:, None]
    lengths = np.diff(path.breakpoints)
    inner = path.at(np.minimum(path.breakpoints[:-1] + shares * lengths, np.nextafter(path.breakpoints[1:], 0.0)))
    turned = np.abs(np.diff(inner, axis=0)).sum(axis=0).max(axis=1)
    counts = np.maximum(np.ceil(turned / TRAVEL).astype(int), FEWEST)
    pieces = zip(path.breakpoints[:-1], lengths, counts, strict=True)
    return np.concatenate([*(a + h * np.arange(n) / n for a, h, n in pieces), path.breakpoints[-1:]])


def _dynamics(path: JointPath, chain: RigidChain, u: FloatArray) -> FloatArray:
    """m, c and g at parameters (n,): (3, n, k)."""
    theta, first, second = (ca.DM(path.at(u, order)) for order in range(3))
    still = ca.DM.zeros(*theta.shape)
    parts = chain.inertial(theta, still, first), chain.inertial(theta, first, second), chain.gravitational(theta)
    return np.stack([as_array(part) for part in parts])

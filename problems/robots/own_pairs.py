"""Pairs of a robot's own bodies, chosen as the MoveIt Setup Assistant chooses pairs of links.

Links that a joint connects are left out, and so are spheres that touch at almost all of many random postures within
the joints' limits. Those that come near each other at none of them are left out of a search; sampling proves nothing,
so the verdict on a finished motion looks at them too.
"""

from __future__ import annotations

import json
from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import combinations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, as_array, cached_text, structure_key
from problems.robots.arm_cover import ArmCover
from problems.robots.spatial_arm import SpatialArm
from problems.robots.transform import as_point


@dataclass(frozen=True, kw_only=True)
class SamplingSettings:
    """Settings of the random postures by which pairs of spheres are chosen.

    Values follow the MoveIt Setup Assistant where it has them, and are chosen else.

    Attributes:
        samples: uniform postures.
        nearest: postures around which more are tried.
        spread: share of the joints' ranges in which these lie.
        always: share of the postures: spheres that touch at so many belong together.
        slack: distance, m: spheres that come no nearer never touch.
        largest_angle: largest angle, rad, of a joint that can turn farther.
        distances_at_once: distances that are computed at once.
    """

    samples: int = 2_000
    nearest: int = 400
    spread: float = 0.1
    always: float = 0.95
    slack: float = 0.01
    largest_angle: float = np.pi
    distances_at_once: int = 1_000_000


SETTINGS = SamplingSettings()
DIGITS = 6  # of m, of centres of spheres
MOST_KNOWN = 64  # choices that a process remembers


LinkPairs = Collection[tuple[str, str]]
Named = frozenset[frozenset[str]]


@dataclass(frozen=True)
class OwnPairs:
    """Pairs of a robot's spheres, on bodies that move against each other, by their numbers in ascending order.

    Attributes:
        kept: that come together at some random posture, and must not.
        far: that came together at none; they must not either.
        together: that touch at nearly every posture, so that they belong together.
    """

    kept: tuple[tuple[int, int], ...] = ()
    far: tuple[tuple[int, int], ...] = ()
    together: tuple[tuple[int, int], ...] = ()


def own_pairs_of(
    robot: SpatialArm, disabled: LinkPairs = (), kept: LinkPairs = (), connected: Named = frozenset()
) -> OwnPairs:
    """Pairs of spheres that have to keep apart; the same for the same robot.

    Args:
        robot: its spheres, limits of the joints and margin decide.
        disabled: names of links that may touch.
        kept: names of links that must not, whatever a joint connects and the random postures say.
        connected: names of links that a joint connects.

    Raises:
        InvalidProblem: ``disabled_pairs`` or ``kept_pairs`` names a link without spheres, ``kept_pairs`` links that no
            joint moves against each other.
    """
    _check(robot, disabled, kept)
    must_not = frozenset(map(frozenset, kept))
    return _chosen(_sampled_arm(robot), frozenset(map(frozenset, disabled)), must_not, connected - must_not)


def _sampled_arm(robot: SpatialArm) -> SpatialArm:
    """The arm by which pairs are chosen: what decides on them, wherever it stands, in rounded numbers.

    So they are the same where a body is taken up in the same way, to rounding, elsewhere.
    """
    spheres = tuple(
        replace(sphere, center=as_point([round(part, DIGITS) for part in sphere.center])) for sphere in robot.spheres
    )
    return SpatialArm(
        robot.chain,
        robot.max_speed,
        robot.max_acceleration,
        position_limits=robot.position_limits,
        spheres=spheres,
        cover=None if robot.cover is None else ArmCover((), ()),
        margin=robot.margin,
    )


@lru_cache(maxsize=MOST_KNOWN)
def _chosen(robot: SpatialArm, disabled: Named, kept: Named, connected: Named) -> OwnPairs:
    spheres = robot.spheres
    pairs = np.array(
        [
            (one, two)
            for one, two in combinations(range(len(spheres)), 2)
            if spheres[one].link != spheres[two].link and {spheres[one].name, spheres[two].name} not in connected
        ],
        dtype=int,
    ).reshape(-1, 2)
    may_touch, must_not = (_named(robot, pairs, names) for names in (disabled, kept))
    pairs, must_not = pairs[~may_touch], must_not[~may_touch]
    if not len(pairs):
        return OwnPairs()
    least, touching = _least_and_touching(robot, pairs)
    together = ~must_not & (touching >= SETTINGS.always)
    near = ~together & (must_not | (least < max(SETTINGS.slack, robot.margin)))
    return OwnPairs(*(_numbers(pairs[chosen]) for chosen in (near, ~together & ~near, together)))


def _least_and_touching(robot: SpatialArm, pairs: NDArray[np.int64]) -> tuple[FloatArray, FloatArray]:
    """The results of random postures for pairs (m, 2), cached: see :attr:`_Sampled.result`."""
    key = structure_key("own pairs", robot, pairs)
    text = cached_text(key, "pairs", lambda: json.dumps([part.tolist() for part in _Sampled(robot, pairs).result]))
    least, touching = json.loads(text)
    return np.array(least), np.array(touching)


def _numbers(pairs: NDArray[np.int64]) -> tuple[tuple[int, int], ...]:
    return tuple((int(one), int(two)) for one, two in pairs)


def _check(robot: SpatialArm, disabled: LinkPairs, kept: LinkPairs) -> None:
    bodies: dict[str, set[int]] = {}
    for sphere in robot.spheres:
        bodies.setdefault(sphere.name, set()).add(sphere.link)
    for field, names in (("disabled_pairs", disabled), ("kept_pairs", kept)):
        for link in (link for pair in names for link in pair):
            if link not in bodies:
                raise InvalidProblem(field, f"no spheres on link {link!r}; there are {', '.join(sorted(bodies))}")
    for one, two in kept:
        if bodies[one] == bodies[two]:
            raise InvalidProblem("kept_pairs", f"{one!r} and {two!r} are one body: no joint is between them")


def _named(robot: SpatialArm, pairs: NDArray[np.int64], names: Named) -> NDArray[np.bool_]:
    """Whether each pair is of spheres on two links that are named together."""
    links = [sphere.name for sphere in robot.spheres]
    return np.array([frozenset((links[one], links[two])) in names for one, two in pairs], dtype=bool)


@dataclass
class _Sampled:
    """Distances at random postures.

    Attributes:
        robot: that has the spheres.
        pairs: of their numbers, (m, 2).
    """

    robot: SpatialArm
    pairs: NDArray[np.int64]

    @property
    def result(self) -> tuple[FloatArray, FloatArray]:
        """The least distance of each pair, (m,), m, and the share of the uniform postures at which it touches."""
        rng = np.random.default_rng(0)
        low, high = self._ranges
        theta = rng.uniform(low, high, (SETTINGS.samples, self.robot.dof))
        least, nearest, touching = self._distances(theta)
        near = theta[np.unique(nearest)[: SETTINGS.nearest]]
        around = np.repeat(near, max(1, SETTINGS.samples // len(near)), axis=0)
        around = np.clip(around + SETTINGS.spread * (high - low) * rng.normal(size=around.shape), low, high)
        return np.minimum(least, self._distances(around)[0]), touching

    @property
    def _ranges(self) -> tuple[FloatArray, FloatArray]:
        most = SETTINGS.largest_angle
        limits = self.robot.position_limits or ((-most, most),) * self.robot.dof
        low, high = np.array(limits, dtype=float).T
        turning = np.array([joint.turns for joint in self.robot.chain.joints]) & (high - low > 2.0 * most)
        return np.where(turning, -most, low), np.where(turning, most, high)

    @cached_property
    def _centers(self) -> ca.Function:
        """Centers of the spheres, one after the other, (3 spheres, 1), of a posture (dof, 1)."""
        theta = ca.SX.sym("theta", self.robot.dof)
        points = self.robot.positions(theta.T)
        centers = [points[body.start].T for body in self.robot.bodies.each]
        return ca.Function("centers", [theta], [ca.densify(ca.vertcat(*centers))])

    def _distances(self, theta: FloatArray) -> tuple[FloatArray, NDArray[np.int64], FloatArray]:
        """The least distance of each pair, m, the posture that has it, and the share of postures that touch."""
        centers = as_array(self._centers(theta.T)).T.reshape(len(theta), -1, 3)
        robot = self.robot
        radii = np.array([s.radius if robot.cover is None else s.inner or 0.0 for s in robot.spheres])
        one, two = self.pairs.T
        least, nearest = np.full(len(one), np.inf), np.zeros(len(one), dtype=np.int64)
        touching = np.zeros(len(one))
        chunk = max(1, SETTINGS.distances_at_once // len(one))
        for start in range(0, len(theta), chunk):
            x, y, z = np.moveaxis(centers[start : start + chunk], 2, 0)
            squares = (x[:, one] - x[:, two]) ** 2 + (y[:, one] - y[:, two]) ** 2 + (z[:, one] - z[:, two]) ** 2
            gaps = np.sqrt(squares) - (radii[one] + radii[two])
            lowest = np.min(gaps, axis=0)
            nearest = np.where(lowest < least, start + np.argmin(gaps, axis=0), nearest)
            least = np.minimum(least, lowest)
            touching += np.sum(gaps < 0.0, axis=0)
        return least, nearest, touching / len(theta)

"""The division of a certificate's proof into cells of time and balls around balls, and the planes in it.

The bounds are those of the checker, which does not trust this division: it computes each of them again, and whether
cells and balls hold everything.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.linalg import norm

from problems.base import FloatArray
from problems.certify.check_certificate import Cells, Claim, RefusedError, Scene, Stage, Whole, formed
from problems.certify.settings import DEFAULT_DIVISION, DivisionSettings
from problems.geometry import Hull

TINY_LENGTH = 1e-300


class DividedStage(Stage):
    """A stage whose planes are searched, not read."""

    settings: DivisionSettings = DEFAULT_DIVISION

    def clear(self, pairs: Whole, cells: Cells) -> tuple[FloatArray, FloatArray]:
        ball = pairs[:, 0]
        ends, _ = Scene(self, cells).follow(self.robot.body[ball], self.robot.ends[:, ball], 0)
        directions = np.empty_like(ends[0])
        for k in np.unique(pairs[:, 1]):
            among, o = pairs[:, 1] == k, self.given.obstacles[k]
            seen = (ends[:, among] - o.center - cells.times[cells.of[among], None] * o.velocity) @ o.rotation
            directions[among] = direction_from(o, nearest_of(o, seen, self.settings.bisections))
        room, planes = np.full(len(pairs), -np.inf), directions
        lengths = (self.settings.coarse_normal, self.settings.fine_normal)
        for rounded in (*(np.round(length * directions) for length in lengths), directions):  # as few digits as will do
            planes = np.where((room >= 0.0)[:, None], planes, rounded)
            self.used, self.given.planes = 0, planes
            room, travel = super().clear(pairs, cells)
        return room, travel


def divided(content: dict[str, Any], settings: DivisionSettings = DEFAULT_DIVISION) -> dict[str, Any]:
    """The proof of a stage of a certificate, and the planes in it.

    Args:
        content: of the stage, of which proof and planes do not count.
        settings: of the search.

    Raises:
        RefusedError: there is none within the settings; the message names the claim.
    """
    empty = {"planes": [], "proof": {"limits": [], "obstacles": [], "own": []}}
    with np.errstate(all="ignore"):
        stage = DividedStage(formed({**content, **empty}, "STAGE", "stage", {}), "stage")
        stage.settings = settings
        claims, stage.claims = stage.claims, {}
        stage.check()  # its ends and what joins its pieces
        planes: list[FloatArray] = [np.empty((0, 3))]
        proof = {key: _levels(stage, claim, planes) for key, claim in claims.items()}
    shortest = [[int(x) if x.is_integer() else x for x in row] for row in np.concatenate(planes).tolist()]
    return {"planes": shortest, "proof": proof}


def _levels(stage: DividedStage, claim: Claim, planes: list[FloatArray]) -> list[str]:
    """Digits of a proof, level by level."""
    levels: list[str] = []
    count = 0
    while len(claim.cells):
        count += len(claim.cells)
        room, travel = claim.look(claim.pairs, Cells(stage, claim.cells))
        balls = np.arange(2) < claim.balls
        sizes = (stage.robot.divisible[claim.pairs * balls] * balls).max(axis=1)
        digits = np.where(room >= 0.0, 0, np.where(sizes > travel, 2, 1)).astype(np.uint8)
        hopeless = (digits == 1) & (sizes == 0.0) & ~(room + travel >= (0.0 if claim.balls else -np.inf))
        hopeless |= ~np.isfinite(room)
        if hopeless.any() or count > stage.settings.most_items or len(levels) > stage.settings.most_levels:
            k = int(np.argmax(hopeless if hopeless.any() else digits > 0))
            raise RefusedError(f"no proof of the {claim.words(k)}")
        if claim.balls == 1:
            planes.append(stage.given.planes[digits == 0])
        levels.append("".join(map(str, digits.tolist())))
        claim.divide(digits)
    return levels


def nearest_of(o: Any, ends: FloatArray, bisections: int) -> FloatArray:
    """The points (n, 3) of segments (2, n, 3), or points (1, n, 3), nearest to an obstacle at the origin."""
    start, along = ends[0], ends[-1] - ends[0]
    low, high = np.zeros((len(start), 1)), np.ones((len(start), 1))
    for _ in range(bisections if along.any() else 0):  # the distance is convex, and this the sign of its slope
        middle = (low + high) / 2.0
        rising = (direction_from(o, start + middle * along) * along).sum(axis=1, keepdims=True) > 0.0
        low, high = np.where(rising, low, middle), np.where(rising, middle, high)
    return np.asarray(start + (low + high) / 2.0 * along)


def direction_from(o: Any, p: FloatArray) -> FloatArray:
    """About the direction from the nearest point of an obstacle at the origin to points (n, 3), of length 1."""
    s, up = o.sizes, np.array([0.0, 0.0, 1.0])
    flat = p * (1.0 - up)
    inner = np.clip(p, -s[-1] * up, s[-1] * up) if len(s) else p
    around = flat * np.minimum(1.0, s[0] / np.maximum(norm(flat, axis=1), TINY_LENGTH))[:, None] if len(s) else p
    directions: dict[str, Callable[[], FloatArray]] = {
        "ball": lambda: p,
        "box": lambda: p - np.clip(p, -s, s),
        "capsule": lambda: p - inner,
        "cylinder": lambda: p - inner - around,
        "ellipsoid": lambda: _ellipsoid_normal(p, s),
        "half-space": lambda: np.tile(up, (len(p), 1)),
        "polytope": lambda: _polytope_normal(p, o.points),
    }
    direction = directions[o.shape]()
    return np.asarray(direction / np.maximum(norm(direction, axis=1), TINY_LENGTH)[:, None])


def _ellipsoid_normal(p: FloatArray, axes: FloatArray) -> FloatArray:
    """The normal by Newton's method for t in p = y + t n, n being y over the squares of the axes."""
    t = np.maximum((axes * np.abs(p) - axes**2).max(axis=1), 0.0)
    for _ in range(20):
        w = axes * p / (t[:, None] + axes**2)
        slope = (w * w / (t[:, None] + axes**2)).sum(axis=1)
        t = np.maximum(t + ((w * w).sum(axis=1) - 1.0) / np.maximum(2.0 * slope, TINY_LENGTH), 0.0)
    return np.asarray(p / (t[:, None] + axes**2))


def _polytope_normal(p: FloatArray, points: FloatArray) -> FloatArray:
    """The normal of the face, or the direction from the edge, beyond which points are farther."""
    hull = Hull.of(points)
    faces = hull.normals[np.argmax(p @ hull.normals.T - hull.offsets, axis=1)]
    best, least = np.tile(points[0], (len(p), 1)), np.full(len(p), np.inf)
    for start, edge in zip(*hull.edges, strict=True):
        foot = start + np.clip((p - start) @ (edge / (edge @ edge)), 0.0, 1.0)[:, None] * edge
        nearer = norm(p - foot, axis=1) < least
        best[nearer], least = foot[nearer], np.minimum(least, norm(p - foot, axis=1))
    directions = (p - best) / np.maximum(norm(p - best, axis=1), TINY_LENGTH)[:, None]
    beyond = [np.einsum("ij,ij->i", n, p) - (n @ points.T).max(axis=1) for n in (faces, directions)]
    return np.asarray(np.where((beyond[0] > beyond[1])[:, None], faces, directions))

"""Few balls that hold a body: chosen greedily among balls around points inside, proven to hold every triangle.

The space that no flood from outside reaches is filled, so that a body counts as solid whether its mesh is or not. A
ball around a point inside may reach as far beyond the nearest outer triangle as the cover is to overhang; around a
point of the surface, it has just that radius. Of these, each in turn is taken that holds most of the samples of the
surface that no other holds yet. What the proof finds in no ball becomes samples of the next round.
"""

from __future__ import annotations

import heapq
import logging
import struct
import time
import zlib
from base64 import b64decode, b64encode
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from itertools import product

import numpy as np
import scipy  # whose parts are loaded when they are used
from numpy.typing import NDArray

from problems.base import FloatArray, InvalidProblem, cache, cached_text
from problems.geometry.proof import Balls, unheld
from problems.geometry.surface import Surface, pieces_of, thinned

LOG = logging.getLogger(__name__)
VERSION = "1"  # of how covers are made: another finds none of those kept before
MOST_STORED_BALLS, MOST_BALLS = 200_000, 10_000  # in a stored text, and in a cover of a body
QUANTUM = 2.0**-17  # m: places and radii are whole multiples, so that what is stored is what was proven


@dataclass(frozen=True, kw_only=True)
class CoverSettings:
    """Settings of the choice of the balls of a cover.

    Values are chosen for meshes of robots of up to a few metres.

    Attributes:
        largest_voxel: side of a voxel, m; the overhang where that is less.
        most_voxels: voxels of a lattice.
        padding: voxels around a body, on both sides together.
        far_side: longest side, in voxels, of the triangles to which distances from deep inside are computed.
        far_depth: depth, in voxels, from which these larger triangles are used.
        aligned_share: share of the distance to a neighbour: where depth grows by more, the neighbour's ball is
            better.
        thinning: share of the radius of the cap that a ball covers of a plane, by which candidates of a size
            are apart.
        sample_depth: share of the overhang by which samples lie inside a ball that holds them.
        coarseness: share of the overhang: size of pieces of a triangle that the proof does not cut for samples.
        most_rounds: rounds of choice and proof.
        directions: directions in which the overhang of a ball is measured.
    """

    largest_voxel: float = 0.0025
    most_voxels: int = 30_000_000
    padding: int = 6
    far_side: float = 4.0
    far_depth: float = 8.0
    aligned_share: float = 0.8
    thinning: float = 0.2
    sample_depth: float = 0.1
    coarseness: float = 0.5
    most_rounds: int = 20
    directions: int = 48


SETTINGS = CoverSettings()


@dataclass(frozen=True)
class Cover:
    """Balls that hold a body, and how far they stick out of it.

    Attributes:
        balls: of the cover.
        usual_overhang: 95 % of its surface are no farther from the body, m.
        largest_overhang: nor any of it that was looked at, m.
        volume_ratio: of its volume to the body's.
    """

    balls: Balls
    usual_overhang: float
    largest_overhang: float
    volume_ratio: float

    @property
    def text(self) -> str:
        """The cover in letters and digits, to be stored."""
        figures = struct.pack("<3d", self.usual_overhang, self.largest_overhang, self.volume_ratio)
        numbers = np.column_stack([self.balls.centers, self.balls.radii]) / QUANTUM
        return b64encode(figures + zlib.compress(numbers.astype("<i4").T.tobytes(), 9)).decode()

    @classmethod
    def from_text(cls, text: str) -> Cover:
        """The cover that a text states.

        Raises:
            InvalidProblem: ``cover`` is none.
        """
        try:
            content = b64decode(text.encode(), validate=True)
            unpacker = zlib.decompressobj()
            numbers = unpacker.decompress(content[24:], 16 * MOST_STORED_BALLS)
            columns = np.frombuffer(numbers, "<i4").reshape(4, -1).astype(np.float64) * QUANTUM
            figures = struct.unpack("<3d", content[:24])
        except (ValueError, struct.error, zlib.error) as error:
            raise InvalidProblem("cover", f"it is none: {error}") from error
        if not unpacker.eof or not columns.size or not (columns[3] > 0.0).all() or not np.isfinite(figures).all():
            raise InvalidProblem("cover", "it is none, or not whole")
        return cls(Balls(columns[:3].T.copy(), columns[3].copy()), *figures)


def cover_of(corners: FloatArray, overhang: float) -> Cover:
    """A cover of triangles, proven to hold all of them; made once, and cached on disk.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        overhang: how far a ball may reach beyond the triangles, m; farther where more than ``MOST_BALLS`` balls were
            needed, as for large sheets.

    Raises:
        InvalidProblem: ``mesh`` needs more voxels than there may be, or its cover cannot be proven.
    """
    made_of = sha256(np.ascontiguousarray(corners, dtype="<f8").tobytes()).hexdigest()
    key = cache.key_of("cover", VERSION, made_of, repr(float(overhang)))
    return Cover.from_text(cached_text(key, "cover", lambda: _new_text(corners, overhang)))


def _new_text(corners: FloatArray, overhang: float) -> str:
    began = time.perf_counter()
    cover = new_cover_of(corners, overhang)
    figures = len(corners), len(cover.balls), 1e3 * overhang, time.perf_counter() - began
    LOG.info("cover: %d triangles, %d spheres that stick out by %.3g mm, %.1f s", *figures)
    return cover.text


def new_cover_of(corners: FloatArray, overhang: float) -> Cover:
    """A cover of triangles, proven to hold all of them.

    Args:
        corners: of the triangles, (n, 3, 3), m.
        overhang: how far a ball may reach beyond the triangles, m.

    Raises:
        InvalidProblem: ``mesh`` needs more voxels than there may be, or its cover cannot be proven.
    """
    solid = Solid(corners, min(overhang, SETTINGS.largest_voxel))
    balls = _proven(corners, solid, overhang)
    if balls is None:
        return new_cover_of(corners, 1.5 * overhang)
    return Cover(balls, *_overhangs(balls, solid), _volume_ratio(balls, solid, overhang))


@dataclass(frozen=True, eq=False)
class Solid:
    """Triangles and what they enclose, on a lattice of voxels.

    Attributes:
        corners: of the triangles, (n, 3, 3), m.
        voxel: length of a side, m.
    """

    corners: FloatArray
    voxel: float

    def __post_init__(self) -> None:
        sizes = np.ptp(self.corners, axis=(0, 1))
        if np.prod(sizes / self.voxel + SETTINGS.padding) > SETTINGS.most_voxels:
            shown = " x ".join(f"{size:.3g}" for size in sizes)
            reason = f"{shown} m make more than {SETTINGS.most_voxels} voxels of {self.voxel * 1e3:g} mm"
            raise InvalidProblem("mesh", f"it is too large to be covered: {reason}")

    @cached_property
    def pieces(self) -> FloatArray:
        """The triangles, cut so that no side is longer than a voxel, (m, 3, 3), m."""
        return pieces_of(self.corners, self.voxel)

    @cached_property
    def _middles(self) -> FloatArray:
        return np.asarray(self.pieces.mean(axis=1))

    @cached_property
    def origin(self) -> FloatArray:
        """The lattice's first corner, (3,), m."""
        return np.asarray(self.corners.min(axis=(0, 1)) - 2.5 * self.voxel)

    @cached_property
    def _shape(self) -> NDArray[np.int64]:
        shape = np.ceil((self.corners.max(axis=(0, 1)) - self.origin) / self.voxel).astype(np.int64) + 3
        return np.asarray(shape)

    def _places(self, points: FloatArray) -> tuple[NDArray[np.int64], ...]:
        places = np.floor((points - self.origin) / self.voxel).astype(np.int64)
        return tuple(np.clip(places, 0, self._shape - 1).T)

    @cached_property
    def _touched(self) -> NDArray[np.bool_]:
        points = np.concatenate([self._middles, self.pieces.reshape(-1, 3)])
        lattice = np.zeros(self._shape, dtype=bool)
        lattice[self._places(points)] = True
        return lattice

    @cached_property
    def filled(self) -> NDArray[np.bool_]:
        """Voxels that triangles touch or enclose, (a, b, c)."""
        return np.asarray(scipy.ndimage.binary_fill_holes(self._touched))

    @cached_property
    def _beside(self) -> NDArray[np.bool_]:
        """Voxels next to those outside, (a, b, c)."""
        return np.asarray(scipy.ndimage.binary_dilation(~self.filled, np.ones((3, 3, 3), dtype=bool)))

    @cached_property
    def outer(self) -> FloatArray:
        """Points of the triangles, no farther from each other than a voxel, that can be seen from outside, (m, 3)."""
        return self._middles[self._beside[self._places(self._middles)]]

    @cached_property
    def _near(self) -> Surface:
        """The surface that can be seen from outside, in small pieces."""
        return Surface(self.pieces[self._beside[self._places(self._middles)]])

    @cached_property
    def _far(self) -> Surface:
        """The surface in larger pieces, some unseen; points deep inside are equally near to many pieces."""
        pieces = pieces_of(self.corners, SETTINGS.far_side * self.voxel)
        points = np.concatenate(
            [0.9 * pieces + 0.1 * pieces.mean(axis=1, keepdims=True), pieces.mean(axis=1)[:, None]], axis=1
        )
        seen = self._beside[self._places(points.reshape(-1, 3))].reshape(len(pieces), -1)
        return Surface(pieces[seen.any(axis=1)])

    def distances(self, points: FloatArray, depths: FloatArray) -> FloatArray:
        """Distances of points (n, 3) from what can be seen from outside, (n,), m, given their approximate depths, m."""
        deep, found = depths > SETTINGS.far_depth * self.voxel, np.empty(len(points))
        for surface, chosen in ((self._near, ~deep), (self._far, deep)):
            found[chosen] = surface.distances(points[chosen]) if chosen.any() else 0.0
        return found

    def encloses(self, points: FloatArray) -> NDArray[np.bool_]:
        """Whether points (n, 3) are in filled voxels, (n,)."""
        inside = ((points >= self.origin) & (points < self.origin + self.voxel * self._shape)).all(axis=1)
        return np.asarray(inside & self.filled[self._places(points)])

    def ridges(self) -> tuple[FloatArray, FloatArray]:
        """Middles (n, 3) of inner voxels whose balls are in no neighbour's, and their depths (n,) to a voxel, m."""
        depth = np.asarray(scipy.ndimage.distance_transform_edt(self.filled)) * self.voxel
        inner = np.argwhere(self.filled & ~self._touched)  # none is at the lattice's border
        numbers, flat = np.ravel_multi_index(tuple(inner.T), depth.shape), depth.ravel()
        own, strides = flat[numbers], np.array(depth.strides) // depth.itemsize
        kept = np.ones(len(inner), dtype=bool)
        for offset in product((-1, 0, 1), repeat=3):
            length = float(np.linalg.norm(offset))
            if length > 0.0:
                kept &= (
                    flat[numbers + int(strides @ np.array(offset))] < own + SETTINGS.aligned_share * self.voxel * length
                )
        return self.origin + (inner[kept] + 0.5) * self.voxel, own[kept]


def _candidates(solid: Solid, overhang: float) -> Balls:
    """Balls around points inside a solid, those of each size spaced."""
    places, depths = solid.ridges()
    order = np.argsort(-depths, kind="stable")
    places, depths = places[order], depths[order]
    sizes = np.floor(np.log2(np.maximum(depths / solid.voxel, 1.0)))
    chosen = []
    for size in np.unique(sizes):
        radius = solid.voxel * 2.0**size + overhang
        same = np.flatnonzero(sizes == size)
        chosen.append(same[thinned(places[same], SETTINGS.thinning * np.sqrt(2.0 * radius * overhang))])
    spaced = np.concatenate([np.empty(0, dtype=np.intp), *chosen])
    inside = np.round(places[spaced] / QUANTUM) * QUANTUM
    radii = solid.distances(inside, depths[spaced]) + overhang
    return Balls(inside, np.floor(radii / QUANTUM) * QUANTUM)


def _around(points: FloatArray, overhang: float) -> Balls:
    """Balls around points of the surface that reach the overhang."""
    centers = np.round(points / QUANTUM) * QUANTUM
    return Balls(centers, np.full(len(centers), np.floor(overhang / QUANTUM) * QUANTUM))


def _proven(corners: FloatArray, solid: Solid, overhang: float) -> Balls | None:
    """The balls of a cover; None where they are too many."""
    candidates, middles = _candidates(solid, overhang), solid.outer
    samples = middles[thinned(middles, max(0.2 * overhang, 0.75 * solid.voxel))]
    bare = (
        samples if not len(candidates) else samples[~candidates.shrunk(SETTINGS.sample_depth * overhang).hold(samples)]
    )
    candidates = candidates.combined(_around(bare[thinned(bare, 0.75 * overhang)], overhang))
    chosen = np.empty(0, dtype=np.intp)
    for _ in range(SETTINGS.most_rounds):
        picked = list(_picked(samples, candidates, SETTINGS.sample_depth * overhang))
        chosen = np.concatenate([chosen, np.array(picked, dtype=np.intp)])
        if len(chosen) > MOST_BALLS:
            return None
        balls = Balls(candidates.centers[chosen], candidates.radii[chosen])
        missed = unheld(corners, balls, SETTINGS.coarseness * overhang)
        if not len(missed):
            return balls
        samples = missed[thinned(missed, SETTINGS.coarseness / 2.0 * overhang)]
        candidates = candidates.combined(_around(samples, overhang))
    raise InvalidProblem("mesh", f"no cover was proven in {SETTINGS.most_rounds} rounds")


def _picked(samples: FloatArray, candidates: Balls, margin: float) -> Iterator[int]:
    """Numbers of balls, each with most of the samples that none before holds, until all are in one."""
    tree, radii = scipy.spatial.cKDTree(samples), candidates.radii - margin
    lists = tree.query_ball_point(candidates.centers, radii, workers=-1, return_sorted=False)
    holds = [np.array(held, dtype=np.int32) for held in lists]
    waiting = [(-len(held), number) for number, held in enumerate(holds) if len(held)]
    heapq.heapify(waiting)
    held = np.zeros(len(samples), dtype=bool)
    while waiting:
        _, number = heapq.heappop(waiting)
        gain = len(holds[number]) - int(np.count_nonzero(held[holds[number]]))
        if gain and waiting and gain < -waiting[0][0]:
            heapq.heappush(waiting, (-gain, number))
        elif gain:
            held[holds[number]] = True
            yield number


def _sphere_points(count: int) -> FloatArray:
    """Points all over the unit sphere, (count, 3), on a spiral."""
    step = np.arange(count) + 0.5
    z, phase = 1.0 - 2.0 * step / count, np.pi * (1.0 + np.sqrt(5.0)) * step
    across = np.sqrt(1.0 - z**2)
    return np.column_stack([across * np.cos(phase), across * np.sin(phase), z])


def _overhangs(balls: Balls, solid: Solid) -> tuple[float, float]:
    """Distances from the solid within which 95 % of the points of a cover's outside are, and all that were tried, m."""
    points = (balls.centers[:, None] + balls.radii[:, None, None] * _sphere_points(SETTINGS.directions)).reshape(-1, 3)
    points = points[~balls.shrunk(QUANTUM).hold(points)]
    points = points[thinned(points, solid.voxel)]
    away = (
        np.where(solid.encloses(points), 0.0, Surface(solid.pieces).distances(points)) if len(points) else np.empty(0)
    )
    return (float(np.quantile(away, 0.95)), float(away.max())) if len(away) else (0.0, 0.0)


def _volume_ratio(balls: Balls, solid: Solid, overhang: float) -> float:
    """The volume of balls over that of a solid, by the points of a lattice."""
    step = max(solid.voxel, SETTINGS.largest_voxel)
    low, high = (solid.corners.min(axis=(0, 1)) - overhang, solid.corners.max(axis=(0, 1)) + overhang)
    axes = [np.arange(a + step / 2.0, b, step) for a, b in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    inside = solid.encloses(points)
    outside = points[~inside]
    return float((inside.sum() + balls.hold(outside).sum()) / max(inside.sum(), 1))
